"""Checks the lengths of the documents, and the modules in the architecture diagram."""
import os
import xml.etree.ElementTree

from documents import MODULES

README_WORDS = 600
MODULE_README_LINES = 25
DIAGRAM = "docs/architecture.svg"
MODULE_LIST = "tests/architecture/modules.txt"


def check_lengths(documents):
    for document in documents:
        words = sum(len(line.split()) for line in document.lines)
        if document.path == "README.md" and words > README_WORDS:
            yield f"README.md: {words} words, at most {README_WORDS}"
        of_module = document.path.split("/")[0] in MODULES or document.path == "tests/README.md"
        if of_module and len(document.lines) > MODULE_README_LINES:
            yield f"{document.path}: {len(document.lines)} lines, at most {MODULE_README_LINES}"


def read_modules(root):
    with open(os.path.join(root, MODULE_LIST), encoding="utf-8") as file:
        lines = [line.partition("#")[0].partition("<-")[0].strip() for line in file]
    return [line for line in lines if line]


def check_diagram(root):
    """Compares <text class="module"> of the diagram with the modules of the dependency test."""
    for path in (DIAGRAM, MODULE_LIST):
        if not os.path.exists(os.path.join(root, path)):
            yield f"{path} is not there"
            return
    modules = read_modules(root)
    try:
        tree = xml.etree.ElementTree.parse(os.path.join(root, DIAGRAM))
    except xml.etree.ElementTree.ParseError as error:
        yield f"{DIAGRAM}: {error}"
        return
    shown = ["".join(element.itertext()).strip() for element in tree.iter()
             if element.tag.split("}")[-1] == "text" and "module" in element.get("class", "").split()]
    for module in modules:
        if shown.count(module) != 1:
            yield f"{DIAGRAM}: shows module '{module}' {shown.count(module)} times, expected once"
    for module in sorted(set(shown) - set(modules)):
        yield f"{DIAGRAM}: shows module '{module}', which is not in {MODULE_LIST}"
