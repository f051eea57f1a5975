#!/usr/bin/env python3
"""A tracker method that only has parameters must not compile where a method needs more: its tracker, its check, its fields in recordings,
its name.
  unfinished_method_test.py COMPILER"""

import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PARAMS = "core/tracking/tracker_params.hpp"
METHODS = re.compile(r"(using MethodParams = std::variant<[^;]+)>;")
NEEDS = {  # the part, the name in the error, the code that needs it
    "tracker": ("any_of", '#include "core/tracking/methods/any_tracker.hpp"\nusing T = decltype(sizeof(tricoil::tracking::AnyTracker));'),
    "check": ("check_method", '#include "core/tracking/tracker_params.cpp"'),
    "fields": ("visit_method", '#include "board/record/json_fields.hpp"\n'
               "void f(tricoil::tracking::TrackerParams<double>& p) { tricoil::host::visit_tracker(p, [](auto...) {}); }"),
    "name": ("kMethods", '#include "board/support/tracker_choice.hpp"'),
}


def errors(compiler, folders):
    """Of one unit that needs all parts."""
    command = [compiler, "-std=c++20", "-fsyntax-only", *(f"-I{folder}" for folder in folders), "-x", "c++", "-"]
    code = "\n".join(code for _, code in NEEDS.values())
    done = subprocess.run(command, input=code, capture_output=True, text=True)
    return [line for line in done.stderr.splitlines() if " error: " in line]


def main():
    failed = False
    text = (ROOT / PARAMS).read_text()
    if not METHODS.search(text):
        sys.exit(f"{PARAMS}: expected MethodParams")
    with tempfile.TemporaryDirectory() as overlay:
        header = pathlib.Path(overlay, PARAMS)
        header.parent.mkdir(parents=True)
        header.write_text(METHODS.sub(r"\1, UnfinishedParams>;", text).replace(
            "/// Method of a tracker,", "struct UnfinishedParams {};\n\n/// Method of a tracker,"))
        finished = errors(sys.argv[1], [ROOT])
        unfinished = errors(sys.argv[1], [overlay, ROOT])
        for part, (name, _) in NEEDS.items():
            of_part = next((line for line in unfinished if name in line), "")
            good = not finished and of_part
            failed |= not good
            print(f"{'' if good else 'WRONG: '}a method without {part}: {of_part or 'compiles'} {' '.join(finished)}")
    return failed


if __name__ == "__main__":
    sys.exit(main())
