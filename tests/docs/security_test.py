#!/usr/bin/env python3
"""Every sentence of board/SECURITY.md names in security.toml the tests that hold it, or why it has none. The tests must exist."""
import pathlib
import re
import sys
import tomllib

TREE = pathlib.Path(__file__).resolve().parents[2]
PAGE = "board/SECURITY.md"
MARK = "\x00"  # in place of a full stop that ends no sentence


def plain(text):
    """Text without marks and links, in one line."""
    return " ".join(re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", text).replace("**", "").split())


def sentences(text):
    """Sentences of paragraphs and list items; of a table, its rows."""
    for block in re.split(r"\n\n", text):
        if block.startswith("#"):
            continue
        if block.startswith("|"):
            yield from (plain(" ".join(cell.strip() for cell in row.strip("|").split("|"))) for row in block.splitlines()[2:])
            continue
        for item in re.split(r"^- ", block, flags=re.M):
            item = re.sub(r"`[^`]*`", lambda code: code[0].replace(".", MARK), plain(item))
            yield from (sentence.replace(MARK, ".") for sentence in re.findall(r"\S.*?[.](?= [A-Z`]|$)", item))


def known_tests():
    """Names of tests in the sources: SUITE.NAME of C++, FILE.test_NAME of Python, fuzz.NAME, and those of ctest."""
    def texts(pattern):
        return ((path, path.read_text(encoding="utf-8")) for path in (TREE / "tests").rglob(pattern))
    names = {"docs.security"} | {f"fuzz.{path.stem.removesuffix('_fuzzer')}" for path, _ in texts("*_fuzzer.cpp")}
    for _, text in texts("*.cpp"):
        names |= {".".join(name) for name in re.findall(r"TEST(?:_F|_P)?\((\w+), (\w+)\)", text)}
        names |= {".".join(name) for name in re.findall(r"TYPED_TEST(?:_P)?\((\w+), (\w+)\)", text)}
    for path, text in texts("*.py"):
        names |= {f"{path.stem}.{name}" for name in re.findall(r"def (test_\w+)", text)}
    for _, text in texts("CMakeLists.txt"):
        names |= set(re.findall(r"NAME ([a-z_.]+)", text))
    return names


def main():
    entries = tomllib.loads((TREE / "tests/docs/security.toml").read_text(encoding="utf-8"))["sentence"]
    names = known_tests()
    found = list(sentences((TREE / PAGE).read_text(encoding="utf-8")))
    used, faults = set(), []
    for sentence in found:
        entry = next((n for n, entry in enumerate(entries) if sentence.startswith(entry["begins"])), None)
        used.add(entry)
        if entry is None:
            faults.append(f"{PAGE}: no entry in security.toml: {sentence}")
    for n, entry in enumerate(entries):
        if n not in used:
            faults.append(f"security.toml: {PAGE} has no such sentence: {entry['begins']}")
        if bool(entry.get("tests")) == bool(entry.get("why")):
            faults.append(f"security.toml: needs either tests or why: {entry['begins']}")
        faults += [f"security.toml: no test {test}: {entry['begins']}" for test in entry.get("tests", ()) if test not in names]
    print("\n".join([*faults, f"{len(found)} sentences of {PAGE}, {len(faults)} faults"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
