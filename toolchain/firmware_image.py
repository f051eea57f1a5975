"""What an ELF image for an ARM processor without an operating system holds: functions, their calls, stack frames and sizes."""

import functools
import pathlib
import re
import subprocess

TOOLS = "arm-none-eabi-"
HELPERS = re.compile(r"__aeabi_(c?d[a-z0-9]*|[a-z]+2d)$")  # the compiler's arithmetic on double, named by the ARM runtime ABI


def _run(tool, *arguments):
    return subprocess.run([TOOLS + tool, *map(str, arguments)], check=True, capture_output=True, text=True).stdout


class Function:
    def __init__(self, name):
        self.name = name  # as linked, mangled
        self.calls = set()  # names
        self.calls_indirectly = False
        self.frame = 0  # bytes of stack that it takes itself


def _register_count(registers):
    """Of a list like "r4, r5, r8-r11, lr" or "s16-s31"."""
    count = 0
    for part in registers.split(","):
        ends = part.strip().split("-")
        count += 1 if len(ends) == 1 else int(ends[1][1:]) - int(ends[0][1:]) + 1
    return count


_PUSH = re.compile(r"\t(?:push|stmdb|vpush|vstmdb)(?:\.w)?\t(?:sp!, )?\{(.*?)\}")
_SUB = re.compile(r"\t(?:sub|subw|sub\.w)\tsp, (?:sp, )?#(\d+)")
_STORE_DOWN = re.compile(r"\tstr[db]?(?:\.w)?\t.*\[sp, #-(\d+)\]!")
_CALL = re.compile(r"\t(?:bl|b|b\.w|b\.n|[a-z]+\.w|[a-z]+\.n|cbn?z)\t.*?[0-9a-f]+ <([^>+]+)>")
_INDIRECT = re.compile(r"\t(?:blx|bx)\t(?!lr)")


class Image:
    def __init__(self, path):
        self.path = pathlib.Path(path)
        if not self.path.exists():
            raise SystemExit(f"{path}: no such image; build it first")

    @functools.cached_property
    def symbols(self):
        """(name, kind as nm has it, size) of everything linked."""
        rows = []
        for line in _run("nm", "-S", self.path).splitlines():
            fields = line.split()
            if len(fields) == 4:
                rows.append((fields[3], fields[2], int(fields[1], 16)))
            elif len(fields) == 3:
                rows.append((fields[2], fields[1], 0))
        return rows

    @functools.cached_property
    def sections(self):
        sizes = {}
        for line in _run("size", "-A", self.path).splitlines():
            fields = line.split()
            if len(fields) == 3 and fields[0].startswith("."):
                sizes[fields[0]] = int(fields[1])
        return sizes

    @property
    def flash(self):
        return sum(self.sections.get(name, 0) for name in (".vectors", ".text", ".rodata", ".init_array", ".data"))

    @property
    def ram(self):
        """Static data; the stack comes on top."""
        return self.sections.get(".data", 0) + self.sections.get(".bss", 0)

    @functools.cached_property
    def functions(self):
        functions = {}
        current = None
        for line in _run("objdump", "-d", "--no-show-raw-insn", self.path).splitlines():
            if header := re.match(r"[0-9a-f]+ <(.+)>:$", line):
                current = functions.setdefault(header[1], Function(header[1]))
                continue
            if current is None:
                continue
            if push := _PUSH.search(line):
                current.frame += _register_count(push[1]) * (8 if push[1].startswith("d") else 4)
            elif amount := _SUB.search(line) or _STORE_DOWN.search(line):
                current.frame += int(amount[1])
            elif call := _CALL.search(line):
                if call[1] != current.name:
                    current.calls.add(call[1])
            elif _INDIRECT.search(line):
                current.calls_indirectly = True
        return functions

    @functools.cached_property
    def demangled(self):
        names = list({name for name, _, _ in self.symbols} | set(self.functions))
        text = subprocess.run([TOOLS + "c++filt"], input="\n".join(names), check=True, capture_output=True, text=True).stdout
        return dict(zip(names, text.splitlines()))

    def plain_name(self, name):
        """Qualified name without return type and parameters: "tricoil::solver::solve_direct<float>"."""
        return plain_name(self.demangled.get(name, name))

    def double_users(self):
        """Names of the functions that call a double-precision helper, apart from the helpers themselves."""
        return sorted(
            name
            for name, function in self.functions.items()
            if any(HELPERS.match(call) for call in function.calls) and not name.startswith(("__aeabi_", "__adddf3", "__muldf3"))
        )

    def module_of(self, name):
        """Folder of the project that a symbol belongs to, from its namespace; "library" if none."""
        if ours := re.match(r"_Z(?:GV|T[VIS])?N?K?7tricoil(\d+)(\w+)", name):
            return ours[2][: int(ours[1])]
        return "library" if not name.startswith("_ZN12_GLOBAL__N_1") else "board"


def plain_name(signature):
    signature = signature.split(" [with ")[0]
    depth = 0
    start = 0
    signature = signature.replace("(anonymous namespace)", "{anonymous}").replace("operator()", "operator{}")
    for n, c in enumerate(signature):
        if c == "<":
            depth += 1
        elif c == ">":
            depth -= 1
        elif depth == 0 and c == " ":
            start = n + 1
        elif depth == 0 and c == "(":
            signature = signature[:n]
            break
    return signature[start:].lstrip("*&")


class StackAnalysis:
    """Deepest stack below each function, summed over the call graph of the linked image."""

    def __init__(self, image, indirect):
        self.image = image
        self.indirect = [(re.compile(caller), re.compile(callee)) for caller, callee in indirect]
        self.depths = {}
        self.problems = []

    def callees(self, function):
        names = set(function.calls)
        if function.calls_indirectly:
            plain = self.image.plain_name(function.name)
            patterns = [callee for caller, callee in self.indirect if caller.search(plain)]
            if not patterns:
                self.problems.append(f"{plain} calls through a pointer; say what in [stack.indirect]")
            for pattern in patterns:
                names |= {other for other in self.image.functions if pattern.search(self.image.plain_name(other))}
        return names

    def depth(self, name, above=()):
        if name in above:
            self.problems.append(f"{self.image.plain_name(name)} calls itself, over {len(above)} others")
            return 0
        if name not in self.depths:
            function = self.image.functions.get(name)
            if function is None:
                return 0
            below = [self.depth(callee, (*above, name)) for callee in self.callees(function)]
            self.depths[name] = function.frame + max(below, default=0)
        return self.depths[name]

    def check_against_compiler(self, build_folder):
        """The frames that the compiler reported with -fstack-usage must not exceed those read off the instructions."""
        reported = {}
        for file in pathlib.Path(build_folder).rglob("*.su"):
            for line in file.read_text().splitlines():
                where, size, kind = line.split("\t")
                name = re.sub(r"<.*>", "", plain_name(where.split(":", 3)[3]))
                if "dynamic" in kind and "bounded" not in kind:
                    self.problems.append(f"{name} takes a stack frame of unknown size")
                reported.setdefault(name, []).append(int(size))
        compared = 0
        for name, function in self.image.functions.items():
            sizes = reported.get(re.sub(r"<.*>", "", self.image.plain_name(name)))
            if sizes:
                compared += 1
                if function.frame < min(sizes):
                    self.problems.append(f"{self.image.plain_name(name)}: frame of {function.frame}, the compiler says {min(sizes)}")
        return compared
