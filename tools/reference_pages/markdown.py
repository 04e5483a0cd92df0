"""Common code of the pages of docs/reference: reading sources, tables, headings."""
import os
import re

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


class SourceError(Exception):
    """Something is missing in a source; the message contains its place."""


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


def slug(heading):
    """The anchor that GitHub gives a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def cell(text):
    """Escapes text for a table."""
    parts = re.split(r"(`[^`]*`)", str(text))
    for i in range(0, len(parts), 2):
        parts[i] = re.sub(r"([\\*<])", r"\\\1", parts[i])
    return "".join(parts).replace("|", "\\|")


def sentence(text):
    """A sentence for a table: capital at the start, no full stop at the end."""
    return (text[:1].upper() + text[1:]).rstrip(".")


def table(head, rows):
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def page(title, sources, *blocks):
    note = f"<!-- Written by tools/reference from {sources}. Do not edit: change those, and run it. -->\n"
    return "\n".join([f"# {title}\n", note, *blocks])
