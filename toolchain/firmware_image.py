"""Analysis of ELF images for ARM processors without an operating system: functions, calls, stack frames, sizes."""

import collections
import functools
import pathlib
import re
import subprocess
import tempfile

TOOLS = "arm-none-eabi-"
ROOT = pathlib.Path(__file__).resolve().parent.parent
# Compiler helpers for double arithmetic, by their names in the ARM run-time ABI and in libgcc.
HELPERS = re.compile(r"__aeabi_(c?d[a-z0-9]*|[a-z]+2d)$|__[a-z]+df[a-z]*\d?$")
RAM_BEGIN = 0x20000000  # on every ARMv7-M processor

Symbol = collections.namedtuple("Symbol", "address size kind name")  # kind: as nm prints it; function addresses without the Thumb bit


class Unusable(Exception):
    """Input that cannot be measured. The message names it and the remedy."""


def run_tool(tool, *arguments, text=None):
    """Standard output of one of the tools of the compiler."""
    try:
        done = subprocess.run([TOOLS + tool, *map(str, arguments)], input=text, capture_output=True, text=True)
    except FileNotFoundError:
        raise Unusable(f"{TOOLS}{tool}: not installed; run toolchain/install-deps test") from None
    if done.returncode != 0:
        raise Unusable(f"{done.stderr.strip().splitlines()[-1] if done.stderr else tool}; is it an image for ARM?")
    return done.stdout


class Function:
    def __init__(self, address, name):
        self.address = address
        self.name = name  # first of its mangled names
        self.calls = set()  # addresses
        self.calls_indirectly = False
        self.frame = 0  # its own stack frame, bytes


def _register_count(registers):
    """Number of registers in a list like "r4, r5, r8-r11, lr" or "s16-s31"."""
    count = 0
    for part in registers.split(","):
        ends = part.strip().split("-")
        count += 1 if len(ends) == 1 else int(ends[1][1:]) - int(ends[0][1:]) + 1
    return count


_PUSH = re.compile(r"\t(?:push|stmdb|vpush|vstmdb)(?:\.w)?\t(?:sp!, )?\{(.*?)\}")
_SUB = re.compile(r"\t(?:sub|subw|sub\.w)\tsp, (?:sp, )?#(\d+)")
_STORE_DOWN = re.compile(r"\tstr[db]?(?:\.w)?\t.*\[sp, #-(\d+)\]!")
_CALL = re.compile(r"\t(bl|b|b\.w|b\.n|[a-z]+\.w|[a-z]+\.n|cbn?z)\t.*?([0-9a-f]+) <([^>+]+)(\+0x[0-9a-f]+)?>")
_INDIRECT = re.compile(r"\t(?:blx|bx)\t(?!lr)")


class Image:
    def __init__(self, path):
        self.path = pathlib.Path(path)
        if not self.path.exists():
            raise Unusable(f"{path}: no such image; build it first")

    @functools.cached_property
    def symbols(self):
        """All named symbols, aliases included."""
        rows = []
        for line in run_tool("nm", "-S", self.path).splitlines():
            fields = line.split()
            if len(fields) in (3, 4):
                size = int(fields[1], 16) if len(fields) == 4 else 0
                code = fields[-2] in "tTwW"
                rows.append(Symbol(int(fields[0], 16) & (~1 if code else ~0), size, fields[-2], fields[-1]))
        return rows

    @functools.cached_property
    def names_at(self):
        names = collections.defaultdict(list)
        for symbol in self.symbols:
            names[symbol.address].append(symbol.name)
        return names

    @functools.cached_property
    def address_of(self):
        return {symbol.name: symbol.address for symbol in self.symbols}

    @functools.cached_property
    def _places(self):
        """(bytes, address) of each section."""
        places = {}
        for line in run_tool("size", "-A", self.path).splitlines():
            fields = line.split()
            if len(fields) == 3 and fields[0].startswith("."):
                places[fields[0]] = (int(fields[1]), int(fields[2]))
        return places

    @property
    def sections(self):
        return {name: size for name, (size, _) in self._places.items()}

    @property
    def flash(self):
        return sum(self.sections.get(name, 0) for name in (".boot", ".vectors", ".image_header", ".text", ".rodata", ".init_array", ".data"))

    @property
    def ram(self):
        """Static data in bytes, without the stack."""
        return sum(self.sections.get(name, 0) for name in (".survives_reset", ".data", ".bss"))

    @functools.cached_property
    def functions(self):
        """Functions by address, because a name may belong to several functions and a function may have several names."""
        functions = {}
        current = None
        for line in run_tool("objdump", "-d", "--no-show-raw-insn", self.path).splitlines():
            if header := re.match(r"([0-9a-f]+) <(.+)>:$", line):
                address = int(header[1], 16)
                current = functions.setdefault(address, Function(address, header[2]))
                continue
            if current is None:
                continue
            if push := _PUSH.search(line):
                current.frame += _register_count(push[1]) * (8 if push[1].startswith("d") else 4)
            elif amount := _SUB.search(line) or _STORE_DOWN.search(line):
                current.frame += int(amount[1])
            elif call := _CALL.search(line):
                target = int(call[2], 16) - int(call[4] or "0", 16)
                # A branch into the same function is a loop; only a branch with link is a recursive call.
                if target != current.address or (call[1] == "bl" and not call[4]):
                    current.calls.add(target)
            elif _INDIRECT.search(line):
                current.calls_indirectly = True
        return functions

    @functools.cached_property
    def demangled(self):
        names = list({symbol.name for symbol in self.symbols} | {function.name for function in self.functions.values()})
        # The initialiser of a file's static objects is named after one of its symbols.
        text = run_tool("c++filt", text="\n".join(re.sub("^_GLOBAL__sub_I_(?=_Z)", "", name) for name in names))
        return dict(zip(names, text.splitlines()))

    def plain_name(self, name):
        """Qualified name without return type and parameters: "tricoil::solver::solve_direct<float>"."""
        return plain_name(self.demangled.get(name, name))

    def is_helper(self, address):
        """True if any name of the function is that of a compiler helper for double."""
        return any(HELPERS.match(name) for name in self.names_at.get(address, ()))

    def double_users(self):
        """Names of the functions that call a double-precision helper, apart from the helpers themselves."""
        return sorted(
            function.name
            for function in self.functions.values()
            if any(self.is_helper(call) for call in function.calls) and not self.is_helper(function.address)
        )

    def module_of(self, name):
        """Folder of the project that a symbol belongs to, from its namespace; "library" if none."""
        if _STARTUP.match(name) or name.startswith("_ZN12_GLOBAL__N_1"):
            return "board"
        plain = self.plain_name(name)
        while plain != (plain := re.sub(r"<[^<>]*>", "", plain)):
            pass
        path = plain.split("::")
        if path[0] != "tricoil":
            return "library"
        return path[1] if path[1] in _namespaces() and len(path) > 2 else "base"

    def _string_bytes(self, named):
        """Bytes of .rodata that are strings, terminators included, outside `named` (address: size)."""
        size, begin = self._places.get(".rodata", (0, 0))
        with tempfile.TemporaryDirectory() as folder:
            dump = pathlib.Path(folder) / "rodata"
            run_tool("objcopy", "-O", "binary", "--only-section=.rodata", self.path, dump)
            content = bytearray(dump.read_bytes()[:size]) if dump.exists() else bytearray()
        for address, length in named.items():
            if begin <= address < begin + len(content):
                at = address - begin
                content[at:at + length] = bytes(min(length, len(content) - at))
        return sum(len(string) for string in re.findall(rb"[\t\n -~]{4,}\0", bytes(content)))

    def modules(self):
        """Bytes of flash and of static RAM by module. Every address counts once. Strings without a symbol count as "text", other
                bytes without one (constants, padding) as "unnamed", so that the sums equal those of the image."""
        sizes = collections.defaultdict(lambda: [0, 0])
        largest = {}
        for symbol in self.symbols:
            if symbol.size > largest.get(symbol.address, (0, ""))[0]:
                largest[symbol.address] = (symbol.size, symbol.name)
        data_bytes, data_begin = self._places.get(".data", (0, 0))
        starts = sorted(largest)
        for address, following in zip(starts, [*starts[1:], float("inf")]):
            size, name = largest[address]
            size = min(size, following - address)  # compiler helpers have entry points inside other helpers
            entry = sizes[self.module_of(name)]
            initialised = data_begin <= address < data_begin + data_bytes  # initial values are in flash as well
            entry[0] += size if address < RAM_BEGIN or initialised else 0
            entry[1] += size if address >= RAM_BEGIN else 0
        sizes["text"][0] = self._string_bytes({address: size for address, (size, _) in largest.items()})
        for n, whole in enumerate((self.flash, self.ram)):
            sizes["unnamed"][n] = whole - sum(entry[n] for entry in sizes.values())
        return dict(sizes)


# Own functions whose names are given by the processor, the linker or the run-time ABI: board/cortex_m and start-up code.
_STARTUP = re.compile(r"(reset_handler|start_program|before_memory|record_fault|\w+_handler|main|abort|kVectors|__cxa_pure_virtual|__dso_handle|_ZdlPvj?"
                      r"|__aeabi_atexit|__aeabi_unwind_cpp_pr\d)$")


@functools.cache
def _namespaces():
    """Namespaces of the tree: each folder with code has a namespace of the same name."""
    tops = ("core", "drivers", "board", "tests")
    return {folder.name for top in tops for folder in (ROOT / top).iterdir() if folder.is_dir()} | set(tops) | {"hal", "sim"}


def plain_name(signature):
    signature = re.sub("^(guard variable|vtable|typeinfo|typeinfo name|VTT) for ", "", signature.split(" [with ")[0])
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


def overload(signature):
    """Identifies one of several functions of the same name, independently of the tool that printed its types: name without template
        arguments, number of parameters, and the arithmetic type it is instantiated for."""
    types = re.findall(r"= (float|double)\b", signature) or re.findall(r"<(float|double)\b", signature)
    name = re.sub(r"<.*>", "", plain_name(signature))
    bare = re.sub(r"operator\(\)|\(anonymous namespace\)| \[with .*", "", signature)
    while bare != (bare := re.sub(r"<[^<>]*>", "", bare)):
        pass
    parameters = re.search(r"\((.*)\)", bare)
    count = len([p for p in parameters[1].split(",") if p.strip() not in ("", "void")]) if parameters else 0
    return name, count, types[0] if types else ""


class StackAnalysis:
    """Deepest stack below each function, summed over the call graph of the linked image."""

    def __init__(self, image, indirect):
        self.image = image
        self.indirect = indirect  # (caller, callee) as compiled expressions
        self.depths = {}
        self.problems = []

    def plain_name(self, address):
        return self.image.plain_name(self.image.functions[address].name)

    def callees(self, function):
        addresses = set(function.calls)
        if function.calls_indirectly:
            plain = self.image.plain_name(function.name)
            patterns = [callee for caller, callee in self.indirect if caller.search(plain)]
            if not patterns:
                self.problems.append(f"{plain} calls through a pointer; name the callee in [stack.indirect]")
            for pattern in patterns:
                addresses |= {other for other in self.image.functions if pattern.search(self.plain_name(other))}
        return addresses

    def depth_of(self, name):
        if name not in self.image.address_of:
            raise Unusable(f"{self.image.path}: has no {name}; is it an image of this project?")
        return self.depth(self.image.address_of[name])

    def depth(self, address, above=()):
        function = self.image.functions.get(address)
        if function is None:
            return 0
        if address in above:
            others = len(above) - 1 - above.index(address)
            self.problems.append(f"{self.plain_name(address)} calls itself" + (f", over {others} others" if others else ""))
            return 0
        if address not in self.depths:
            below = [self.depth(callee, (*above, address)) for callee in self.callees(function)]
            self.depths[address] = function.frame + max(below, default=0)
        return self.depths[address]

    def check_against_compiler(self, build_folder):
        """Checks that no frame reported by -fstack-usage exceeds the frame computed from the instructions."""
        reported = {}
        for file in pathlib.Path(build_folder).rglob("*.su"):
            for line in file.read_text().splitlines():
                where, size, kind = line.split("\t")
                signature = where.split(":", 3)[3]
                if "dynamic" in kind and "bounded" not in kind:
                    self.problems.append(f"{plain_name(signature)} takes a stack frame of unknown size")
                reported.setdefault(overload(signature), []).append(int(size))
        compared = 0
        for function in self.image.functions.values():
            signature = self.image.demangled[function.name]
            sizes = reported.get(overload(signature))
            if sizes and "thunk to " not in signature:  # a jump to the function; the compiler reports no frame for it
                compared += 1
                if function.frame < min(sizes):
                    name = self.image.plain_name(function.name)
                    self.problems.append(f"{name}: frame of {function.frame}, the compiler says {min(sizes)}")
        return compared
