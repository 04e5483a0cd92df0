"""Splits the documents of the repository into prose, fences and headings."""
import os
import re

MODULES = ("fusion", "protocols", "render", "server", "tools")
LEFT_OUT = {"build", "node_modules", ".git"}


class Fence:
    def __init__(self, kind, line):
        self.kind, self.line, self.lines = kind, line, []  # line: of its first line of text, from 1

    def text(self):
        return "".join(f"{line}\n" for line in self.lines)


def anchor_of(heading):
    """The anchor that GitHub generates, without the number of a duplicate."""
    plain = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").replace("*", "")
    return re.sub(r"[^\w\- ]", "", plain.strip().lower()).replace(" ", "-")


class Document:
    """`path` is relative to the root; `prose` has a line for each of the file, empty within fences."""

    def __init__(self, root, path):
        self.root, self.path = root, path
        with open(os.path.join(root, path), encoding="utf-8") as file:
            self.lines = file.read().splitlines()
        self.prose, self.fences = [], []
        self.take_apart()

    def take_apart(self):
        fence, mark, indent = None, "", 0
        for number, line in enumerate(self.lines, 1):
            found = re.match(r"(\s*)(```+|~~~+)\s*(\w*)", line)
            if fence is None and found:
                indent, mark = len(found[1]), found[2]
                fence = Fence(found[3], number + 1)
            elif fence is not None and found and found[2].startswith(mark) and not found[3]:
                self.fences.append(fence)
                fence = None
            elif fence is not None:
                fence.lines.append(line[min(indent, len(line) - len(line.lstrip())):])
            else:
                self.prose.append(line)
                continue
            self.prose.append("")

    def anchors(self):
        anchors, seen = set(), {}
        for line in self.prose:
            found = re.match(r"#{1,6}\s+(.*?)\s*#*$", line)
            if found:
                name = anchor_of(found[1])
                count = seen.get(name, 0)
                seen[name] = count + 1
                anchors.add(f"{name}-{count}" if count else name)
            anchors.update(re.findall(r'<\w+[^>]*\s(?:id|name)="([^"]+)"', line))
        return anchors


def markdown_files(root, folder):
    for place, folders, files in os.walk(os.path.join(root, folder)):
        folders[:] = sorted(name for name in folders if name not in LEFT_OUT)
        for file in sorted(files):
            if file.endswith(".md"):
                yield os.path.relpath(os.path.join(place, file), root)


def read_documents(root):
    """README, CONTRIBUTING, CHANGELOG, all of docs/, and the READMEs of all folders."""
    paths = [name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")
             if os.path.exists(os.path.join(root, name))]
    paths += markdown_files(root, "docs")
    for folder in (*MODULES, "examples", "tests"):
        paths += [path for path in markdown_files(root, folder) if os.path.basename(path) == "README.md"]
    return [Document(root, path) for path in paths]
