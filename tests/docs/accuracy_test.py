#!/usr/bin/env python3
"""Rows of the tables in README.md must agree with the tables of the pages from which they come.

  accuracy_test.py [PAGE...]

A comment `rows of PATH` precedes each table. The cells of a row must occur in this order in one row of a table of that page.
"""
import os
import re
import sys

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))


def rows(text):
    """Cells of every row of the tables in a text, without their headings."""
    lines = text.split("\n")
    for number, line in enumerate(lines):
        is_heading = number + 1 < len(lines) and lines[number + 1].startswith("|---")
        if line.startswith("|") and not line.startswith("|---") and not is_heading:
            yield [cell.strip() for cell in line.strip().strip("|").split("|")]


def contains(owner, cells):
    """Whether the cells occur in this order in a row of the owner."""
    rest = iter(owner)
    return all(cell in rest for cell in cells)


def check(page):
    """Number of rows; their errors, a line each."""
    with open(page) as file:
        tables = re.findall(r"<!-- rows of (\S+) -->\n((?:\|.*\n)+)", file.read())
    if not tables:
        sys.exit(f"{page}: no table with its owner")
    count, wrong = 0, []
    for owner, table in tables:
        with open(os.path.join(ROOT, owner)) as file:
            owned = list(rows(file.read()))
        for cells in rows(table):
            count += 1
            if not any(contains(row, cells) for row in owned):
                wrong.append(f"{page}: {owner} has no row with these figures: {' | '.join(cells)}")
    return count, wrong


def main():
    pages = sys.argv[1:] or [os.path.join(ROOT, "README.md")]
    counts, errors = zip(*map(check, pages))
    wrong = sum(errors, [])
    print("\n".join(wrong) if wrong else f"{sum(counts)} rows in {len(pages)} pages, all as in the pages that own them")
    sys.exit(1 if wrong else 0)


main()
