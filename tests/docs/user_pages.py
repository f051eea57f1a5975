"""The user pages and their commands.

Commands are in code blocks tagged sh, one per line (a backslash at the end continues it). A second tag states why a test may not run
them: NOT_RUN.
"""
import os
import re

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
PAGES = ["README.md", "board/host/GETTING-STARTED.md", "core/error_model/FOR-RESEARCHERS.md", "board/host/serve/FOR-INTEGRATORS.md", "board/host/serve/USE-FROM.md", "drivers/FOR-HARDWARE-BUILDERS.md", "drivers/YOUR-OWN-COILS.md",
         "core/tracking/METAL.md", "board/python/README.md", "board/ACCURACY.md", "board/ARCHITECTURE.md", "board/SECURITY.md",
         "toolchain/package/INSTALL.md", "board/virtual_board/README.md", ".github/CONTRIBUTING.md", "board/nucleo_g474re/HARDWARE.md", "board/nucleo_g474re/BRING-UP.md",
         *(f"board/nucleo_g474re/circuits/{name}.md" for name in ("README", "POWER-STAGE", "ENABLE", "PREAMPLIFIER", "SAFETY"))]
NOT_RUN = {"hardware": "needs a device", "root": "needs root", "browser": "needs a browser", "build": "builds or installs",
           "long": "takes minutes"}


def commands_of(page):
    """(line number, command, tag) of every command; tag None: to be run. Raises ValueError for unknown tags."""
    found = []
    fence = None
    with open(os.path.join(ROOT, page)) as file:
        lines = file.read().split("\n")
    number = 0
    while number < len(lines):
        text = lines[number]
        number += 1
        first = number
        if text.startswith("```"):
            fence = None if fence is not None else text[3:].strip()
            if fence and fence.startswith("sh") and (len(fence.split()) > 2 or any(t not in NOT_RUN for t in fence.split()[1:])):
                raise ValueError(f"{page}:{number}: fence '{fence}'; use sh, or sh with one of {', '.join(NOT_RUN)}")
            continue
        if fence is None or not text.strip() or text.lstrip().startswith("#"):
            continue
        if not fence.startswith("sh"):
            if re.match(r"(tricoil|tricoil-front-end|toolchain/\S+) ", text):
                raise ValueError(f"{page}:{number}: a command in a fence that is not tagged sh")
            continue
        while text.endswith("\\"):
            text = text[:-1] + lines[number].strip()
            number += 1
        tag = fence.split()[1] if " " in fence else None
        found.append((first, text.strip(), tag))
    return found


def command_to_run(command):
    """The command as the tests run it: `tricoil serve` without --duration and `tricoil demo` are interrupted half a second after they have
    printed an address or poses, as by ctrl-C."""
    if not re.match(r"tricoil (serve|demo)\b", command) or "--duration" in command:
        return command
    shown = "grep -s -E -m 1 'serving|live page|\"sequence\"' .served"
    return (f"rm -f .served; env --default-signal=INT {command.split(' #')[0]} >.served & served=$!\n"
            f"until {shown} >/dev/null || ! kill -0 $served 2>/dev/null; do sleep 0.1; done\n"
            "sleep 0.5; kill -INT $served 2>/dev/null || true\n"
            f"wait $served || [ $? = 130 ]  # 130: before the first pose\n{shown}")
