#!/usr/bin/env python3
"""Checks the bill of materials of a release against SPDX 2.3 and against the files.

  bill_test.py RELEASE           a folder of toolchain/release
  bill_test.py --build BUILD     makes a bill for the program of a build folder; also checks that wrong bills are found

Licence expressions are parsed by the npm package spdx-expression-parse; without npm this part is left out, with a message.
"""
import copy
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

TOOLCHAIN = pathlib.Path(__file__).resolve().parent.parent.parent / "toolchain"
RELATIONS = {"DESCRIBES", "GENERATED_FROM", "CONTAINS", "STATIC_LINK", "DYNAMIC_LINK", "DEPENDS_ON", "BUILD_TOOL_OF"}
PARSE = "const parse = require(process.argv[1]); for (const text of process.argv.slice(2)) try { parse(text) } catch { console.log(text) }"


def wrong_expressions(texts):
    done = subprocess.run([TOOLCHAIN / "npm-packages", "release"], capture_output=True, text=True)
    if done.returncode != 0:
        print(f"bill_test: licence expressions are not parsed: {done.stderr.strip()}")
        return []
    module = f"{done.stdout.strip()}/node_modules/spdx-expression-parse"
    return subprocess.run(["node", "-e", PARSE, module, *texts], check=True, capture_output=True, text=True).stdout.splitlines()


def faults_of_form(bill):
    packages, relationships = bill["packages"], bill["relationships"]
    known = {package["SPDXID"] for package in packages} | {"SPDXRef-DOCUMENT"}
    texts = {licence["licenseId"] for licence in bill["hasExtractedLicensingInfos"]}
    if (bill["spdxVersion"], bill["dataLicense"], bill["SPDXID"]) != ("SPDX-2.3", "CC0-1.0", "SPDXRef-DOCUMENT"):
        yield "head of the document"
    if not re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", bill["creationInfo"]["created"]) or not bill["creationInfo"]["creators"]:
        yield "creationInfo"
    if not re.fullmatch(r"https://\S+[0-9a-f]{40}", bill["documentNamespace"]):
        yield "documentNamespace"
    if len(known) != len(packages) + 1:
        yield "an SPDXID is used twice"
    for package in packages:
        name = package["SPDXID"]
        if not re.fullmatch(r"SPDXRef-[A-Za-z0-9.-]+", name):
            yield f"{name}: not an SPDXID"
        if not package.get("name") or not package.get("versionInfo") or not package.get("downloadLocation"):
            yield f"{name}: no name, version or download location"
        if not re.fullmatch(r"[\w.+-]+( (AND|OR|WITH) [\w.+-]+)*", package["licenseDeclared"]):
            yield f"{name}: licence {package['licenseDeclared']}"
        for licence in re.findall(r"LicenseRef-[A-Za-z0-9.-]+", package["licenseDeclared"]):
            if licence not in texts:
                yield f"{name}: no text of {licence}"
        for reference in package.get("externalRefs", []):
            if not re.fullmatch(r"pkg:(deb/debian|npm)/[^@\s]+@[^?\s]+(\?\S+)?", reference["referenceLocator"]):
                yield f"{name}: {reference['referenceLocator']}"
    for licence in bill["hasExtractedLicensingInfos"]:
        if len(licence["extractedText"]) < 100:
            yield f"{licence['licenseId']}: no text"
    for relation in relationships:
        if relation["relationshipType"] not in RELATIONS or {relation["spdxElementId"], relation["relatedSpdxElement"]} - known:
            yield f"relationship {relation}"
    for name in known - {end for relation in relationships for end in (relation["spdxElementId"], relation["relatedSpdxElement"])}:
        yield f"{name}: without a relationship"
    described = {relation["relatedSpdxElement"] for relation in relationships if relation["relationshipType"] == "DESCRIBES"}
    for package in packages:
        if "packageFileName" in package and package["SPDXID"] not in described:
            yield f"{package['SPDXID']}: a file that the document does not describe"
    for text in wrong_expressions(sorted({package["licenseDeclared"] for package in packages})):
        yield f"licence expression {text}"


def faults_of_files(bill, release):
    listed = {package["packageFileName"]: package["checksums"][0] for package in bill["packages"] if "packageFileName" in package}
    files = {path.name for path in release.iterdir() if path.name != "SHA256SUMS" and not path.name.endswith(".spdx.json")}
    for name in files ^ set(listed):
        yield f"{name}: in the folder or in the bill, not in both"
    for name in files & set(listed):
        if listed[name] != {"algorithm": "SHA256", "checksumValue": hashlib.sha256((release / name).read_bytes()).hexdigest()}:
            yield f"{name}: checksum"


def names_in(bill, relation, kind):
    """Names of packages that files whose name ends with `kind` have in a relation."""
    name_of = {package["SPDXID"]: package["name"] for package in bill["packages"]}
    return {name_of[entry["relatedSpdxElement"]] for entry in bill["relationships"]
            if entry["relationshipType"] == relation and name_of.get(entry["spdxElementId"], "").endswith(kind)}


EXPECTED = (("STATIC_LINK", ".deb", {"libeigen3-dev", "libceres-dev", "libcli11-dev", "nlohmann-json3-dev", "libtomlplusplus-dev", "libgcc-12-dev"}),
            ("DYNAMIC_LINK", ".deb", {"libfmt9", "libusb-1.0-0", "libunicorn2"}), ("CONTAINS", ".deb", {"three", "uplot"}),
            ("CONTAINS", ".whl", {"libfmt9"}), ("DEPENDS_ON", ".whl", {"python3-numpy"}), ("STATIC_LINK", ".whl", {"pybind11-dev"}),
            ("STATIC_LINK", "nucleo-g474re.bin", {"libnewlib-arm-none-eabi", "gcc-arm-none-eabi"}))


def check_release(release):
    (path,) = release.glob("*.spdx.json")
    bill = json.loads(path.read_text())
    faults = [*faults_of_form(bill), *faults_of_files(bill, release)]
    for relation, kind, names in EXPECTED:
        faults += [f"{kind}: no {relation} {name}" for name in sorted(names - names_in(bill, relation, kind))]
    faults += [f"the wheel has {name}" for name in names_in(bill, "STATIC_LINK", ".whl") & {"libceres-dev"}]
    print(*faults, f"bill_test: {len(bill['packages'])} packages, {len(bill['relationships'])} relationships, {len(faults)} faults", sep="\n")
    return not faults


def make_bill(build, folder):
    release, lists = folder / "release", folder / "lists"
    release.mkdir()
    lists.mkdir()
    (release / "tricoil-0.1.0.tar.gz").write_text("sources")
    (release / "program.deb").write_text("program")
    (lists / "program.deb").write_text(subprocess.run([TOOLCHAIN / "linked-packages", build, "bin/tricoil"], check=True, capture_output=True, text=True).stdout)
    done = subprocess.run([TOOLCHAIN / "bill-of-materials", release, lists, "0.1.0", "0" * 40], check=True, capture_output=True, text=True,
                          env={**os.environ, "SOURCE_DATE_EPOCH": "1700000000"})
    return release, json.loads(done.stdout)


def check_build(build):
    with tempfile.TemporaryDirectory() as name:
        release, bill = make_bill(build, pathlib.Path(name))
        faults = [*faults_of_form(bill), *faults_of_files(bill, release)]
        for relation, names in (("STATIC_LINK", {"libeigen3-dev", "libcli11-dev", "libgcc-12-dev"}), ("DYNAMIC_LINK", {"libfmt9", "libstdc++6"})):
            faults += [f"no {relation} {name}" for name in sorted(names - names_in(bill, relation, ".deb"))]
        for n, spoil in enumerate((lambda b: b["packages"].pop(), lambda b: b["hasExtractedLicensingInfos"].clear(), lambda b: b["relationships"].pop(0),
                      lambda b: b["packages"][0].update(licenseDeclared="Apache 2"), lambda b: b["packages"][0]["checksums"][0].update(checksumValue="0"))):
            spoiled = copy.deepcopy(bill)
            spoil(spoiled)
            if not [*faults_of_form(spoiled), *faults_of_files(spoiled, release)]:
                faults.append(f"wrong bill {n} was not found")
    print(*faults, f"bill_test: {len(bill['packages'])} packages, {len(faults)} faults", sep="\n")
    return not faults


def main():
    if len(sys.argv) == 3 and sys.argv[1] == "--build":
        return check_build(pathlib.Path(sys.argv[2]))
    if len(sys.argv) != 2:
        sys.exit("usage: bill_test.py RELEASE, or bill_test.py --build BUILD")
    return check_release(pathlib.Path(sys.argv[1]))


sys.exit(0 if main() else 1)
