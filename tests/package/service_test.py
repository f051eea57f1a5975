#!/usr/bin/env python3
"""Scripts of the Debian package, the service's unit, its example configuration, and the USB identifier of a build.

  service_test.py TRICOIL
"""
import os
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import time
import unittest

TREE = pathlib.Path(__file__).resolve().parents[2]
PACKAGE = TREE / "toolchain/package"
SYSTEM = TREE / "board/linux/system"


class Scripts(unittest.TestCase):
    """With stand-ins for the programs of systemd, in a folder as the root of the system (DPKG_ROOT)."""

    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.root = pathlib.Path(place.name)
        self.calls = self.root / "calls"
        for folder in ("bin", "run/systemd/system", "etc/systemd/system/multi-user.target.wants", "usr/share/doc/tricoil/examples"):
            (self.root / folder).mkdir(parents=True)
        (self.root / "usr/share/doc/tricoil/examples/board.toml").write_bytes((SYSTEM / "board.toml").read_bytes())
        for name in ("deb-systemd-invoke", "systemctl", "systemd-sysusers", "udevadm"):
            stand_in = self.root / "bin" / name
            stand_in.write_text(f'#!/bin/sh\necho "{name} $*" >>"{self.calls}"\n', encoding="utf-8")
            stand_in.chmod(0o755)

    def run_script(self, name, *arguments):
        environment = {"PATH": f"{self.root}/bin:{os.environ['PATH']}", "DPKG_ROOT": str(self.root)}
        subprocess.run(["/bin/sh", PACKAGE / name, *arguments], env=environment, check=True)
        calls = self.calls.read_text(encoding="utf-8") if self.calls.exists() else ""
        self.calls.unlink(missing_ok=True)
        return [line.split(" ", 1)[1] for line in calls.splitlines() if line.startswith(("systemctl ", "deb-systemd-invoke "))]

    def test_an_installation_reads_the_unit_and_starts_nothing(self):
        self.assertEqual(self.run_script("postinst", "configure", ""), ["daemon-reload"])
        self.assertTrue((self.root / "etc/tricoil/board.toml").exists())

    def test_an_upgrade_restarts_a_running_service(self):
        self.assertEqual(self.run_script("prerm", "upgrade", "0.2"), [])
        self.assertEqual(self.run_script("postinst", "configure", "0.1"), ["daemon-reload", "try-restart tricoil.service"])

    def test_a_removal_stops_the_service_before_its_program_goes(self):
        self.assertEqual(self.run_script("prerm", "remove"), ["stop tricoil.service"])
        self.assertEqual(self.run_script("postrm", "remove"), ["daemon-reload"])

    def test_a_purge_leaves_nothing_of_the_package(self):
        self.run_script("postinst", "configure", "")
        wanted = self.root / "etc/systemd/system/multi-user.target.wants/tricoil.service"
        wanted.symlink_to("/lib/systemd/system/tricoil.service")
        self.run_script("postrm", "purge")
        self.assertFalse(wanted.is_symlink() or (self.root / "etc/tricoil").exists())

    def test_without_systemd_no_script_calls_it(self):
        (self.root / "run/systemd/system").rmdir()
        for script, word in (("postinst", "configure"), ("prerm", "remove"), ("postrm", "purge")):
            self.assertEqual(self.run_script(script, word, "0.1"), [])

    def test_the_package_has_them_all(self):
        text = (PACKAGE / "debian.cmake").read_text(encoding="utf-8")
        for script in ("postinst", "prerm", "postrm"):
            self.assertIn(f"${{CMAKE_CURRENT_SOURCE_DIR}}/{script}", text)
            self.assertTrue(os.access(PACKAGE / script, os.X_OK))


class Service(unittest.TestCase):
    program = ""

    def setUp(self):
        self.unit = (SYSTEM / "tricoil.service").read_text(encoding="utf-8")
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.place = pathlib.Path(place.name)

    def command(self, configuration):
        """The command of the unit, with this configuration and free ports."""
        words = re.search(r"^ExecStart=\S+ (.*)$", self.unit, re.M)[1].split()
        replace = {"/etc/tricoil/board.toml": configuration, "18944": "0", "8080": "0", "/run/tricoil/controls": str(self.place / "controls"),
                   "/var/lib/tricoil": str(self.place)}
        return [self.program, *(replace.get(word, word) for word in words)]

    def test_a_wrong_configuration_is_not_tried_again(self):
        wrong = self.place / "board.toml"
        wrong.write_text('device = "can:can0"\nspeed = 3\n', encoding="utf-8")
        done = subprocess.run(self.command(str(wrong)), capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertRegex(self.unit, r"(?m)^RestartPreventExitStatus=2$")

    def test_the_example_starts(self):
        notices = self.place / "notify"

        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
            manager.bind(str(notices))
            manager.settimeout(60)
            with subprocess.Popen(self.command(str(SYSTEM / "board.toml")), env={**os.environ, "NOTIFY_SOCKET": str(notices)},
                                  stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as program:
                self.assertEqual(manager.recv(100), b"READY=1", program.poll())
                time.sleep(1)
                self.assertIsNone(program.poll())
                program.terminate()
                program.communicate()


class UsbIdentifier(unittest.TestCase):
    def build_with(self, identifier):
        """Rules and compile definitions of a build with this identifier."""
        with tempfile.TemporaryDirectory() as folder:
            script = pathlib.Path(folder) / "use.cmake"
            script.write_text(f"macro(add_compile_definitions)\nfile(WRITE {folder}/definitions \"${{ARGV}}\")\nendmacro()\n"
                              f"include({TREE}/toolchain/cmake/UsbIdentifier.cmake)\n"
                              f"tricoil_usb_rules({SYSTEM}/70-tricoil.rules {folder}/rules)\n", encoding="utf-8")
            done = subprocess.run(["cmake", "-D", f"TRICOIL_USB_ID={identifier}", "-P", script], capture_output=True, text=True, check=False)
            if done.returncode != 0:
                return done.stderr, None
            definitions = pathlib.Path(folder) / "definitions"
            return (pathlib.Path(folder) / "rules").read_text(encoding="utf-8"), definitions.read_text(encoding="utf-8") if definitions.exists() else ""

    def test_rules_and_image_have_the_identifier_of_the_build(self):
        self.assertEqual(self.build_with("1209:0001"), ((SYSTEM / "70-tricoil.rules").read_text(encoding="utf-8"), ""))
        rules, definitions = self.build_with("1D50:6018")
        self.assertIn('ATTR{idVendor}=="1d50", ATTR{idProduct}=="6018"', rules)
        self.assertEqual(definitions, "TRICOIL_USB_VENDOR=0x1d50;TRICOIL_USB_PRODUCT=0x6018")
        check = ('#include "drivers/stm32g4/usb/descriptors.hpp"\n'
                 "using tricoil::stm32g4::usb::kDevice;\n"
                 "static_assert(kDevice[8] == 0x50 && kDevice[9] == 0x1d && kDevice[10] == 0x18 && kDevice[11] == 0x60);\n")
        subprocess.run(["c++", "-std=c++20", "-fsyntax-only", f"-I{TREE}", *(f"-D{word}" for word in definitions.split(";")), "-x", "c++", "-"],
                       input=check, text=True, check=True)

    def test_other_forms_are_refused(self):
        for identifier in ("1209", "1209:1", "12090:0001", "1209:000g"):
            self.assertIn("must be VENDOR:PRODUCT", " ".join(self.build_with(identifier)[0].split()))

    def test_it_is_said_to_be_for_tests(self):
        for page in (SYSTEM / "70-tricoil.rules", SYSTEM / "board.toml", TREE / "drivers/stm32g4/README.md"):
            self.assertRegex(page.read_text(encoding="utf-8"), r"1209:0001[^\n]*test", page)


if __name__ == "__main__":
    Service.program = os.path.abspath(sys.argv[1])
    unittest.main(argv=sys.argv[:1] + sys.argv[2:], verbosity=2)
