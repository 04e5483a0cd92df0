#!/usr/bin/env python3
"""Writes the software bill of materials of the program to standard output, as SPDX 2.3 JSON.

It lists the Debian packages of the libraries that the program is linked with or loads, those whose headers were compiled into it, and the
packages of npm that the page was built with.

usage: sbom.py PROGRAM --version V --date D --build FOLDER --lock package-lock.json [--loads PACKAGE ...]
"""
import argparse
import base64
import hashlib
import json
import os
import re
import subprocess
import sys


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def linked_libraries(program):
    """(file name, path, whether the program itself names it) of each shared library."""
    direct = set(re.findall(r"^\s*NEEDED\s+(\S+)", output("objdump", "-p", program), re.M))
    return [(name, path, name in direct) for name, path in re.findall(r"^\s*(\S+) => (/\S+)", output("ldd", program), re.M)]


def compiled_headers(build):
    """Headers of the system that an object file of the program was compiled from."""
    headers, of_program = set(), False
    for line in output("ninja", "-C", build, "-t", "deps").splitlines():
        if not line.startswith(" "):
            of_program = not line.startswith("tests/")
        elif of_program and line.strip().startswith("/usr/"):
            headers.add(line.strip())
    return headers


def owners(paths):
    """The installed Debian package of each file."""
    both = {}  # dpkg knows a file by its path from before or after the merge of / and /usr
    for path in paths:
        real = os.path.realpath(path)
        for each in {path, real, real.removeprefix("/usr"), path.removeprefix("/usr")}:
            both[each] = path
    if not both:
        return {}
    found = subprocess.run(["dpkg-query", "-S", *both], capture_output=True, text=True, check=False).stdout
    owner = {}
    for line in found.splitlines():
        packages, _, path = line.rpartition(": ")
        if path in both and not line.startswith("diversion "):
            owner[both[path]] = packages.split(",")[0]
    missing = sorted(set(paths) - set(owner))
    if missing:
        sys.exit(f"sbom.py: {len(missing)} files belong to no Debian package, such as {missing[0]}: expected only packaged libraries")
    return owner


def identifier(kind, name):
    return f"SPDXRef-{kind}-" + re.sub(r"[^A-Za-z0-9.-]", "-", name)


def debian_package(name):
    fields = "${Package}\t${Version}\t${Architecture}\t${source:Package}\t${source:Version}\t${Homepage}"
    package, version, architecture, source, source_version, homepage = output("dpkg-query", "-W", "-f", fields, name).split("\t")
    entry = {
        "SPDXID": identifier("deb", package), "name": package, "versionInfo": version,
        "supplier": "Organization: Debian", "downloadLocation": "NOASSERTION", "filesAnalyzed": False,
        "licenseConcluded": "NOASSERTION", "licenseDeclared": "NOASSERTION", "copyrightText": "NOASSERTION",
        "sourceInfo": f"built from the Debian source package {source} {source_version}",
        "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                          "referenceLocator": f"pkg:deb/debian/{package}@{version}?arch={architecture}"}],
    }
    if homepage:
        entry["homepage"] = homepage
    return entry


def npm_package(path, entry):
    name = path.rpartition("node_modules/")[2]
    version = entry["version"]
    package = {
        "SPDXID": identifier("npm", f"{name}-{version}"), "name": name, "versionInfo": version,
        "downloadLocation": "NOASSERTION", "filesAnalyzed": False, "licenseConcluded": "NOASSERTION",
        "licenseDeclared": entry.get("license", "NOASSERTION"), "copyrightText": "NOASSERTION",
        "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                          "referenceLocator": f"pkg:npm/{name.replace('@', '%40')}@{version}"}],
    }
    algorithm, _, digest = entry.get("integrity", "").partition("-")
    if algorithm == "sha512":
        package["checksums"] = [{"algorithm": "SHA512", "checksumValue": base64.b64decode(digest).hex()}]
    return package


def bundled(page):
    """Names of the packages that the page's own sources import: these are in the built page, the others build it."""
    names = set()
    for folder, _, files in os.walk(os.path.join(page, "src")):
        for file in files:
            with open(os.path.join(folder, file), encoding="utf-8", errors="replace") as text:
                names.update(re.findall(r"""from ["']((?:@[\w.-]+/)?[\w-]+)""", text.read()))
    return names


class Document:
    def __init__(self, arguments):
        with open(arguments.program, "rb") as file:
            digest = hashlib.sha256(file.read()).hexdigest()
        self.root = identifier("Package", "parhelion")
        self.packages = {self.root: {
            "SPDXID": self.root, "name": "parhelion", "versionInfo": arguments.version, "downloadLocation": "NOASSERTION",
            "filesAnalyzed": False, "licenseConcluded": "NOASSERTION", "licenseDeclared": "BSD-3-Clause",
            "copyrightText": "2026, the Parhelion authors", "primaryPackagePurpose": "APPLICATION",
            "checksums": [{"algorithm": "SHA256", "checksumValue": digest}],
        }}
        self.relations = [("SPDXRef-DOCUMENT", "DESCRIBES", self.root)]
        self.head = {
            "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"parhelion-{arguments.version}",
            "documentNamespace": f"https://spdx.org/spdxdocs/parhelion-{arguments.version}-{digest[:32]}",
            "creationInfo": {"created": arguments.date, "creators": ["Tool: parhelion-sbom"]},
        }

    def add(self, package, relation):
        """`relation`: of the program to the package; the first that is added stays."""
        if package["SPDXID"] in self.packages:
            return
        self.packages[package["SPDXID"]] = package
        self.relations.append((self.root, relation, package["SPDXID"]) if not relation.endswith("_OF")
                              else (package["SPDXID"], relation, self.root))

    def text(self):
        relations = [{"spdxElementId": a, "relationshipType": kind, "relatedSpdxElement": b} for a, kind, b in self.relations]
        return json.dumps({**self.head, "packages": list(self.packages.values()), "relationships": relations}, indent=1)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    for name in ("version", "date", "build", "lock"):
        parser.add_argument(f"--{name}", required=True)
    parser.add_argument("--loads", nargs="*", default=[], help="packages of libraries that are loaded at run time")
    arguments = parser.parse_args()
    document = Document(arguments)
    libraries = linked_libraries(arguments.program)
    owner = owners([path for _, path, _ in libraries])
    for direct in (True, False):
        relation = "DYNAMIC_LINK" if direct else "DEPENDS_ON"
        for package in sorted({owner[path] for _, path, named in libraries if named == direct}):
            document.add(debian_package(package), relation)
    for package in arguments.loads:
        document.add(debian_package(package), "RUNTIME_DEPENDENCY_OF")
    for package in sorted(set(owners(compiled_headers(arguments.build)).values())):
        document.add(debian_package(package), "BUILD_DEPENDENCY_OF")
    with open(arguments.lock, encoding="utf-8") as file:
        locked = json.load(file)["packages"]
    in_page = bundled(os.path.dirname(arguments.lock))
    for path, entry in sorted(locked.items()):
        if path:
            package = npm_package(path, entry)
            document.add(package, "CONTAINS" if package["name"] in in_page else "BUILD_TOOL_OF")
    print(document.text())


if __name__ == "__main__":
    main()
