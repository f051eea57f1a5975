"""Numbers in texts for people."""


def number_text(value: float | None, form: str) -> str:
    """A number that would be shown as zero has two digits instead, in the same width. None, JSON's word for an unknown number: nan."""
    value = float("nan") if value is None else value
    text = format(value, form)
    return text if value == 0 or any(c in "123456789" for c in text.partition("e")[0]) else f"{value:>{'+' if '+' in form else ''}{len(text)}.2g}"
