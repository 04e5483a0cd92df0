#!/usr/bin/env python3
"""The bill of materials beside a package is consistent, and has every library that the package depends on.

usage: sbom_test.py BILL.spdx.json PACKAGE.deb
"""
import json
import re
import subprocess
import sys


def faults(bill, depends):
    identifiers = [package["SPDXID"] for package in bill["packages"]]
    names = {package["name"] for package in bill["packages"]}
    known = {"SPDXRef-DOCUMENT", *identifiers}
    if bill["spdxVersion"] != "SPDX-2.3" or len(bill["packages"]) < 2:
        yield f"{bill['spdxVersion']} with {len(bill['packages'])} packages: expected SPDX-2.3 with the libraries of the program"
    for identifier in sorted({each for each in identifiers if identifiers.count(each) > 1}):
        yield f"{identifier}: twice, expected once"
    for package in bill["packages"]:
        if not re.fullmatch(r"SPDXRef-[A-Za-z0-9.-]+", package["SPDXID"]) or not package.get("versionInfo"):
            yield f"{package['SPDXID']}: malformed, or without a version"
    related = set()
    for relation in bill["relationships"]:
        ends = {relation["spdxElementId"], relation["relatedSpdxElement"]}
        related |= ends
        for end in ends - known:
            yield f"{relation['relationshipType']} names {end}, which is not listed"
    for identifier in sorted(known - related):
        yield f"{identifier}: nothing says what it has to do with the program"
    for name in (each.split()[0] for each in depends.split(", ")):
        if name.startswith("lib") and name not in names:
            yield f"{name}: the package depends on it, and it is not listed"


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        bill = json.load(file)
    depends = subprocess.run(["dpkg-deb", "-f", sys.argv[2], "Depends"], capture_output=True, text=True, check=True).stdout
    found = list(faults(bill, depends.strip()))
    print("\n".join(found) or f"bill of materials: {len(bill['packages'])} packages")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
