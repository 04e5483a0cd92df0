"""Checks that the old lines of each diff in a document stand in the repository, so that a reader finds them.

The old lines of a fence stand in a row in one file. A line that begins with `...` is the end of a longer one.
"""
import os

FOLDERS = ("fusion", "protocols", "render", "server", "tools", "tests")
LEFT_OUT = {"dist", "node_modules", "build"}
SUFFIXES = (".cpp", ".hpp", ".json", ".lcm", ".svelte", ".ts", ".txt", ".py", ".yaml")
LONGER = "... "


class Sources:
    """The lines of the repository's source files, read when first asked for."""

    def __init__(self, root):
        self.root, self.files = root, None

    def read(self):
        self.files = []
        for folder in FOLDERS:
            for place, folders, names in os.walk(os.path.join(self.root, folder)):
                folders[:] = [name for name in folders if name not in LEFT_OUT]
                for name in names:
                    if not name.endswith(SUFFIXES):
                        continue
                    with open(os.path.join(place, name), encoding="utf-8", errors="replace") as file:
                        self.files.append("\n" + file.read())

    def have(self, lines):
        if self.files is None:
            self.read()
        text = ("" if lines[0].startswith(LONGER) else "\n") + "\n".join(lines).removeprefix(LONGER) + "\n"
        return any(text in file for file in self.files)


def check_diffs(document, sources):
    for fence in document.fences:
        if fence.kind != "diff":
            continue
        old = [line[1:].removeprefix(" " if line[1:].startswith(" " + LONGER) else "")
               for line in fence.lines if line and line[0] != "+"]
        if old and not sources.have(old):
            yield f"{document.path}:{fence.line}: the lines that this diff changes are in no source file"
