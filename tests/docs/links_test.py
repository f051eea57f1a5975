#!/usr/bin/env python3
"""Links of all pages lead to existing files, and their anchors to existing headings. Pages that comments and scripts name exist."""
import os
import re
import subprocess
import sys

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
LINK = re.compile(r"\]\(([^)#:\s]*)(?:#([^)\s]+))?\)")
NAMED = re.compile(r"(?<![\w./-])(?:\.github|board|core|drivers|hal|sim|tests|toolchain)/[\w./-]+\.md\b")


def read(path):
    with open(os.path.join(ROOT, path), errors="replace") as file:
        return file.read()


def anchors(page):
    """Anchors of the headings, as GitHub and mkdocs make them."""
    text = re.sub(r"^```.*?^```", "", read(page), flags=re.M | re.S)
    titles = re.findall(r"^#+ (.+)$", text, re.M)
    return {re.sub(r"\s+", "-", re.sub(r"[^\w\s-]", "", title).strip().lower()) for title in titles}


def dead_links(page):
    for path, anchor in LINK.findall(re.sub(r"^```.*?^```", "", read(page), flags=re.M | re.S)):
        target = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
        if not os.path.exists(os.path.join(ROOT, target)):
            yield f"{page}: links to {path}, which does not exist"
        elif anchor and target.endswith(".md") and anchor not in anchors(target):
            yield f"{page}: links to {path}#{anchor}: no such heading"


def main():
    listed = subprocess.run(["git", "-C", ROOT, "ls-files"], capture_output=True, text=True)
    if listed.returncode != 0:
        print(f"links_test: skipped: {ROOT} is no git tree")
        sys.exit(77)
    files = [file for file in listed.stdout.splitlines() if os.path.isfile(os.path.join(ROOT, file))]
    pages = [file for file in files if file.endswith(".md")]
    wrong = [error for page in pages for error in dead_links(page)]
    for file in files:
        wrong += [f"{file}: names {page}, which does not exist" for page in sorted(set(NAMED.findall(read(file))))
                  if not os.path.exists(os.path.join(ROOT, page))]
    print("\n".join(wrong) if wrong else f"{len(pages)} pages: all links lead to existing places")
    sys.exit(1 if wrong else 0)


main()
