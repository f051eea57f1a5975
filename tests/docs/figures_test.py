#!/usr/bin/env python3
"""Figures in the text of the main pages must agree with their sources: figures.toml names the source of each.

  figures_test.py

Every number in the text of PAGES must be in an entry. Not in text: code, links, tables that other tests compare (rows of a page:
accuracy_test.py; `table NAME`: tests/circuits; TESTED_TABLES), and tables that name the program that prints them (`printed by PATH`).
"""
import ast
import csv
import math
import os
import re
import sys
import tomllib

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
PAGES = ("README.md", "board/ACCURACY.md", "board/nucleo_g474re/HARDWARE.md", "board/nucleo_g474re/BRING-UP.md")
TESTED_TABLES = ("| pin | connection |", "| conversions a sample |")  # tests/stm32g4/hardware_page_test.cpp
NUMBER = re.compile(r"(?<![\w.:+^])\d+(?:,\d{3})*(?:\.\d+)?(?!\w)")


def read(path):
    with open(os.path.join(ROOT, path)) as file:
        return file.read()


def words(text):
    """The text with single spaces, without the marks that begin lines of comments."""
    return " ".join(re.sub(r"^\s*(//+|#)", "", text, flags=re.M).split())


def numbers(text):
    return [match[0] for match in NUMBER.finditer(text)]


def value(number):
    return float(number.replace(",", ""))


def text_of(page):
    """The page with blanks in place of what is no text, so that positions stay."""
    def blank(match):
        return " " * len(match[0])
    text = re.sub(r"```.*?```", blank, read(page), flags=re.S)
    text = re.sub(r"<!-- (?:rows of|printed by) .*? -->\n(\|.*\n)+", blank, text)
    text = re.sub(r"<!-- table .*?<!-- end -->", blank, text, flags=re.S)
    for head in TESTED_TABLES:
        text = re.sub(rf"^{re.escape(head)}.*\n(\|.*\n)+", blank, text, flags=re.M)
    return re.sub(r"`[^`]*`|\]\([^)]*\)|^\d+\. ", blank, text, flags=re.M)


class Sources:
    """Figures that expressions of figures.toml name."""

    def __init__(self):
        self.baselines = tomllib.loads(read("toolchain/baseline.toml"))
        self.budgets = tomllib.loads(read("toolchain/budgets.toml"))
        self.results = {row[0]: float(row[1]) for row in csv.reader(read("board/nucleo_g474re/circuits/results.csv").splitlines())
                        if len(row) == 2 and re.fullmatch(r"[-+.\de]+", row[1])}

    def baseline(self, preset, name):
        return self.baselines[preset][name]

    def budget(self, image, name):
        return self.budgets["size"][image][name]

    def result(self, name):
        return self.results[name]

    def parts(self, which):
        """Sum of the prices of the board's parts; which: from or to."""
        rows = csv.DictReader(read("board/nucleo_g474re/circuits/bill-of-materials.csv").splitlines())
        return sum(float(row["quantity"]) * float(row[f"price each {which} (USD)"]) for row in rows)

    def evaluate(self, expression, n):
        """n: the numbers of `says`."""
        names = {"n": n, "floor": math.floor, "ceil": math.ceil, "round": round, "log10": math.log10, "baseline": self.baseline, "budget": self.budget,
                 "result": self.result, "parts": self.parts}
        return eval(compile(ast.parse(expression, mode="eval"), expression, "eval"), {"__builtins__": {}}, names)


def agrees(number, wanted):
    """Whether a printed number is the wanted one, rounded to the printed decimals."""
    decimals = len(number.partition(".")[2])
    return abs(value(number) - wanted) <= 0.5 * 10 ** -decimals * (1 + 1e-9)


def place_of(entry):
    """Pattern of the entry's text in a page; {} stands for a number."""
    return re.compile(r"\s+".join(re.escape(word) for word in entry["text"].split()).replace(r"\{\}", r"\d[\d,.]*"))


def errors_of(entry, page, sources):
    place = place_of(entry).search(read(page))
    if place is None:
        yield f"{page}: does not contain: {entry['text']}"
        return
    if "own" in entry:
        return
    found = numbers(place[0])
    n = []
    if "says" in entry:
        if words(entry["says"]) not in words(read(entry["in"])):
            yield f"{page}: \"{entry['text']}\": {entry['in']} does not contain: {entry['says']}"
            return
        n = [value(number.replace("'", "").rstrip(",")) for number in re.findall(r"\d[\d,']*(?:\.\d+)?(?:e-?\d+)?", entry["says"])]
    if "derive" not in entry:
        missing = [number for number in found if value(number) not in n]
        if missing:
            yield f"{page}: \"{entry['text']}\": not in the source: {', '.join(missing)}"
        return
    wanted = [sources.evaluate(expression, n) for expression in entry["derive"]]
    if len(wanted) != len(found) or not all(map(agrees, found, wanted)):
        yield f"{page}: \"{entry['text']}\": has {', '.join(found)}, must have {', '.join(f'{figure:.6g}' for figure in wanted)}"


def missing_programs(page):
    for path in re.findall(r"<!-- printed by (.*?) -->", read(page)):
        if not os.path.exists(os.path.join(ROOT, path)):
            yield f"{page}: no program {path}"


def uncovered(page, entries):
    """Numbers in the text of a page that no entry contains."""
    text = text_of(page)
    covered = [False] * len(text)
    for entry in entries:
        for match in place_of(entry).finditer(read(page)):
            covered[match.start():match.end()] = [True] * (match.end() - match.start())
    for match in NUMBER.finditer(text):
        if not covered[match.start()]:
            line = read(page).count("\n", 0, match.start()) + 1
            yield f"{page}:{line}: {match[0]}: no source in tests/docs/figures.toml"


def main():
    entries = tomllib.loads(read("tests/docs/figures.toml"))
    sources = Sources()
    errors = [error for page, list_of in entries.items() for entry in list_of for error in errors_of(entry, page, sources)]
    errors += [error for page in PAGES for error in (*uncovered(page, entries[page]), *missing_programs(page))]
    print("\n".join(errors) if errors else f"{sum(len(numbers(entry['text'])) for list_of in entries.values() for entry in list_of)} figures in "
          f"{len(entries)} pages, all as in their sources")
    sys.exit(1 if errors else 0)


main()
