"""XML files of others."""

from xml.etree import ElementTree

from ._poses import PoseError


def root_of(data: bytes, name: str) -> ElementTree.Element:
    """Root element. A document type could define entities that grow without end. Raises PoseError."""
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise PoseError(f"{name}: an XML file with a document type is not read; remove the lines DOCTYPE and ENTITY")
    try:
        return ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise PoseError(f"{name}: is no XML that can be read ({error})") from None
