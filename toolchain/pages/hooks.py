"""Hooks of mkdocs: the READMEs of folders in the navigation; GitHub's Markdown as Python-Markdown reads it."""
import os
import re

DEMO = "[Try it in this browser](demo/index.html){ .md-button .md-button--primary } Without an installation: a simulated hand, its motion error, metal."
LIST_ITEM = re.compile(r" *([-*]|\d+\.) ")


def pages_of(entry):
    """Paths of all pages below an entry of the navigation."""
    if isinstance(entry, str):
        return [entry]
    return [page for part in (entry.values() if isinstance(entry, dict) else entry) for page in pages_of(part)]


def on_config(config):
    """Adds the READMEs that the navigation does not name to Reference, by folder."""
    named = set(pages_of(config["nav"]))
    folders = {}
    for place, _, files in os.walk(config["docs_dir"]):
        path = os.path.relpath(os.path.join(place, "README.md"), config["docs_dir"])
        if "README.md" in files and path not in named:
            folder = os.path.dirname(path)
            folders.setdefault(folder.split("/")[0], []).append({folder: path})
    entries = [{top: sorted(pages, key=lambda page: list(page))} for top, pages in sorted(folders.items())]
    reference = next(part["Reference"] for part in config["nav"] if "Reference" in part)
    reference.append({"Folders": entries})
    return config


def on_page_markdown(markdown, page, **_):
    """The first page begins with the demo. Code blocks without the tags of tests/docs; an empty line before each list; nested lists indented by
    four."""
    if page.file.src_path == "README.md":
        markdown = markdown.replace("\n\n", f"\n\n{DEMO}\n\n", 1)
    out = []
    in_code = in_list = False
    for line in markdown.split("\n"):
        if line.lstrip().startswith("```"):
            in_code = not in_code
            line = re.sub(r"^( *```\w+) .*", r"\1", line)
        elif not in_code:
            is_item = LIST_ITEM.match(line) is not None
            if is_item and not in_list and out and out[-1].strip():
                out.append("")
            in_list = is_item or (in_list and (not line.strip() or line.startswith(" ")))
            if in_list and line.startswith(" "):
                indent = len(line) - len(line.lstrip())
                line = ("    " if indent < 5 else "        ") + line.lstrip()
        out.append(line)
    return "\n".join(out)
