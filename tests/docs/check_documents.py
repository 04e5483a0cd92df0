#!/usr/bin/env python3
"""Checks what the documents say against the repository and the built program: links, commands, YAML, diffs, references."""
import argparse
import os
import subprocess
import sys

from commands import CommandChecker
from diff_fences import Sources, check_diffs
from documents import read_documents
from limits import check_diagram, check_lengths
from links import check_links, check_paths
from yaml_fences import check_yaml

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def check_references(root, program, folder=None):
    words = [os.path.join(root, "tools/reference"), "--check", "--program", program]
    ran = subprocess.run(words + (["--folder", folder] if folder else []), capture_output=True, text=True, check=False)
    if ran.returncode != 0:
        yield ran.stderr.strip() or f"tools/reference --check: exit {ran.returncode}"


def check_documents(root, program):
    documents = read_documents(root)
    commands = CommandChecker(root, program)
    sources = Sources(root)
    for document in documents:
        yield from check_links(document)
        yield from check_paths(document)
        yield from commands.check(document)
        yield from check_yaml(document, program)
        yield from check_diffs(document, sources)
    yield from check_lengths(documents)
    yield from check_diagram(root)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", required=True, help="the built parhelion")
    parser.add_argument("--root", default=ROOT)
    arguments = parser.parse_args()
    program = os.path.abspath(arguments.program)
    problems = [*check_documents(arguments.root, program), *check_references(arguments.root, program)]
    for problem in problems:
        print(problem, file=sys.stderr)
    print(f"documents: {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
