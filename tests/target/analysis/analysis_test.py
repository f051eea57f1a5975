#!/usr/bin/env python3
"""Tests of the image analysis: it reports recursion and double arithmetic, and counts nothing twice.
  analysis_test.py BUILD_FOLDER
"""

import pathlib
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent.parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "toolchain"))
import firmware_image  # noqa: E402

BUILD = None


def target_image(name, folder="tests/target"):
    return firmware_image.Image(BUILD / folder / f"{name}.elf")


class Calls(unittest.TestCase):
    def test_a_function_that_calls_itself_is_reported(self):
        stack = firmware_image.StackAnalysis(target_image("recursion"), [])
        stack.depth_of("main")
        self.assertIn("{anonymous}::fall calls itself", [problem.split(",")[0] for problem in stack.problems])

    def test_a_sum_of_doubles_is_seen(self):
        image = target_image("double_sum")
        helpers = {name for name in image.address_of if firmware_image.HELPERS.match(name)}
        if not helpers:
            self.skipTest("double is in hardware here")
        self.assertIn("main", image.double_users())

    def test_helpers_by_either_name(self):
        for name in ("__aeabi_dadd", "__aeabi_cdcmple", "__aeabi_f2d", "__aeabi_ul2d", "__adddf3", "__cmpdf2", "__fixdfsi", "__extendsfdf2"):
            self.assertTrue(firmware_image.HELPERS.match(name), name)
        for name in ("__aeabi_fadd", "__aeabi_i2f", "__addsf3", "__aeabi_ldivmod", "__udivmoddi4"):
            self.assertFalse(firmware_image.HELPERS.match(name), name)


class Modules(unittest.TestCase):
    def test_rows_add_up_to_the_image(self):
        for name, folder in (("kernels", "tests/target"), ("tracker", "board/qemu_an386"), ("fixed_tracker", "board/qemu_an386")):
            image = target_image(name, folder)
            modules = image.modules()
            self.assertEqual(sum(flash for flash, _ in modules.values()), image.flash)
            self.assertEqual(sum(ram for _, ram in modules.values()), image.ram)
            self.assertGreaterEqual(min(min(sizes) for sizes in modules.values()), 0, f"{name}: something counts twice")
            self.assertLess(modules["unnamed"][0], image.flash / 20)

    def test_symbols_belong_where_their_source_lies(self):
        image = target_image("kernels")
        belongs = {
            "_ZN7tricoil5fixed12solve_directERKNS0_11BlockMatrixENS0_6ScaledE": "fixed",
            "reset_handler": "board",
            "main": "board",
            "memcpy": "library",
        }
        for name, module in belongs.items():
            self.assertEqual(image.module_of(name), module, name)
        local = [name for name in image.address_of if name.startswith("_ZZN7tricoil6target")]
        self.assertEqual({image.module_of(name) for name in local} - {"target"}, set())
        self.assertNotIn("solve_columns", {image.module_of(name) for name in image.address_of})

    def test_names_directly_in_the_product_are_base(self):
        image = target_image("kernels")
        image.demangled.update(probe="tricoil::Status tricoil::TextLine::text(char const*)", lambda_probe="tricoil::solver::f<float>(int)::{lambda(int)#1}::operator()(int) const")
        self.assertEqual(image.module_of("probe"), "base")
        self.assertEqual(image.module_of("lambda_probe"), "solver")


class Overloads(unittest.TestCase):
    def test_are_told_apart_however_the_tool_writes_them(self):
        same = (
            ("tricoil::Status tricoil::fixed::check(const TrackerParams&)", "tricoil::fixed::check(tricoil::fixed::TrackerParams const&)"),
            ("T tricoil::f(const T&, int) [with T = float]", "float tricoil::f<float>(float const&, int)"),
        )
        for compiler, linker in same:
            self.assertEqual(firmware_image.overload(compiler), firmware_image.overload(linker))
        self.assertNotEqual(firmware_image.overload("int f(int)"), firmware_image.overload("int f(int, int)"))
        self.assertNotEqual(firmware_image.overload("float f<float>(int)"), firmware_image.overload("double f<double>(int)"))


if __name__ == "__main__":
    BUILD = pathlib.Path(sys.argv.pop(1))
    unittest.main()
