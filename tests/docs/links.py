"""Checks the targets of relative links, images and paths in code."""
import glob
import os
import re
import urllib.parse

from documents import Document

LINK = re.compile(r'\]\(\s*<?([^)\s>]*)>?(?:\s+"[^"]*")?\s*\)|^\s*\[[^\]]+\]:\s*(\S+)|\s(?:src|href)="([^"]*)"')
FOLDERS = "fusion|protocols|render|server|tests|tools|docs|examples"
PATH = re.compile(rf"\.?/?(?:(?:{FOLDERS})/[\w./*-]*|\./[\w./-]+)")
NEW_FILES = re.compile(r"<!-- new files?: (.*?) -->")


def link_problem(document, target):
    """The problem with a link target; empty: none."""
    path, _, anchor = target.partition("#")
    if path.startswith("/"):
        return "is not relative"
    place = os.path.normpath(os.path.join(os.path.dirname(document.path), urllib.parse.unquote(path))) if path \
        else document.path
    if place.startswith(".."):
        return "leads out of the repository"
    if not os.path.exists(os.path.join(document.root, place)):
        return "is not there"
    if anchor and place.endswith(".md"):
        other = document if place == document.path else Document(document.root, place)
        if anchor not in other.anchors():
            return f"has no heading '#{anchor}'"
    return ""


def check_links(document):
    for number, line in enumerate(document.prose, 1):
        text = re.sub(r"`[^`]*`", "", line)
        for found in LINK.finditer(text):
            target = next((part for part in found.groups() if part), "")
            if re.match(r"[a-z][a-z+.-]*:", target):
                continue
            problem = link_problem(document, target) if target else "is empty"
            if problem:
                yield f"{document.path}:{number}: link '{target}' {problem}"


def is_there(document, path):
    """Relative to the root or the document; `render/codec` means codec.cpp and codec.hpp."""
    places = [os.path.join(document.root, folder, path) for folder in ("", os.path.dirname(document.path))]
    return any(glob.glob(place) or glob.glob(f"{place}.*") for place in places)


def check_paths(document):
    """`tools/test --quick` names a file of the repository. Files that a reader is to create are listed in the
    document: <!-- new files: server/tick/thermometer.hpp server/tick/thermometer.cpp -->"""
    new = {name for line in document.prose for found in NEW_FILES.findall(line) for name in found.split()}
    for number, line in enumerate(document.prose, 1):
        for code in re.findall(r"`([^`]+)`", line):
            word = code.split()[0] if code.split() else ""
            path = re.sub(r":\d+$", "", word)
            if not PATH.fullmatch(path) or path in new or path.startswith("./build/"):
                continue
            if not is_there(document, path):
                yield f"{document.path}:{number}: `{path}` is not there"
