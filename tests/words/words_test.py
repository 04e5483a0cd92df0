#!/usr/bin/env python3
"""Holds identifiers, visible strings, names of events, comments and documents to the field's words: those of word_list.txt
are not used."""
import os
import re
import subprocess
import sys

from source_text import lexer_of, pieces

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
IDENTIFIER = re.compile(r"[A-Za-z_]\w*")
YAML_KEY = re.compile(r"(?:^\s*(?:- )?\{?|[{,])\s*([a-z_]\w*):", re.M)
STRING_FILES = ("strings.en.ts", "review/page/text.js")


class Rule:
    def __init__(self, line, number):
        fields = line.split("\t")
        if len(fields) < 3:
            sys.exit(f"word_list.txt:{number}: expected scope, expression, right word and perhaps exceptions")
        self.scope, self.right = fields[0], fields[2]
        self.expression = re.compile(fields[1])
        exception = re.split(r"\s+#", fields[3])[0] if len(fields) > 3 else ""
        self.exception = re.compile(exception) if exception else None
        self.places = []

    def see(self, text, path, line):
        if not self.expression.search(text):
            return
        if self.exception and (self.exception.search(text) or self.exception.search(f"{path}: {text}")):
            return
        self.places.append(f"{path}:{line}: {text[:80]}")


def read_rules(path):
    with open(path, encoding="utf-8") as file:
        return [Rule(line.rstrip("\n"), number) for number, line in enumerate(file, 1)
                if line.strip() and not line.startswith("#")]


def pieces_to_see(path, text):
    """(scope, text, line) of each identifier, each visible string and each line of comment of a file."""
    yield "identifiers", os.path.basename(path).split(".")[0], 0
    line = 1
    for kind, piece in pieces(path, text):
        if kind == "code" and path.endswith(".yaml"):
            for key in YAML_KEY.finditer(piece):
                yield "identifiers", key.group(1), line + piece.count("\n", 0, key.start())
        elif kind == "code":
            for match in IDENTIFIER.finditer(piece):
                yield "identifiers", match.group(0), line + piece.count("\n", 0, match.start())
        elif kind == "string" and not path.startswith("tests/"):
            inner = piece[1:-1]
            if IDENTIFIER.fullmatch(inner):
                yield "identifiers", inner, line
            if " " in inner or path.endswith(STRING_FILES):
                yield "strings", inner, line
        elif kind == "comment":
            for at, part in enumerate(piece.split("\n")):
                yield "prose", part.strip(), line + at
        line += piece.count("\n")


def listed_files(root):
    return subprocess.run(["git", "ls-files"], cwd=root, capture_output=True, text=True, check=True).stdout.split("\n")


def files(root):
    for path in listed_files(root):
        generated = "web/dist/" in path or "package-lock" in path or path.endswith(".md")
        if path and not generated and lexer_of(path) and os.path.exists(os.path.join(root, path)):
            yield path


def documents(root):
    for path in listed_files(root):
        if path.startswith("docs/") and path.endswith(".md") and os.path.exists(os.path.join(root, path)):
            yield path


def look(root, rules):
    def see_all(path, found):
        for scope, word, line in found:
            for rule in rules:
                if rule.scope == scope:
                    rule.see(word, path, line)

    def text_of(path):
        with open(os.path.join(root, path), encoding="utf-8", errors="replace") as file:
            return file.read()

    for path in files(root):
        see_all(path, pieces_to_see(path, text_of(path)))
    for path in documents(root):
        see_all(path, (("prose", line, number) for number, line in enumerate(text_of(path).split("\n"), 1)))


def event_names_that_differ(root):
    """One event, one name: the page's text of an event is the log's name in words. The report writes the log's name."""
    def read(path):
        with open(os.path.join(root, path), encoding="utf-8") as file:
            return file.read()
    enum = re.search(r"enum class EventKind[^{]*\{(.*?)\};", read("protocols/event.hpp"), re.S).group(1)
    log = re.findall(r"^\s*(\w+)", re.sub(r"//[^\n]*", "", enum).replace(",", "\n"), re.M)
    table = re.search(r"eventKinds: \{(.*?)\}", read("server/station/web/src/strings.en.ts"), re.S).group(1)
    page = dict(re.findall(r'(\w+): "([^"]*)"', table))
    if len(log) < 50 or len(page) < 30 or 'kind.replaceAll("_", " ")' not in read("server/review/page/text.js"):
        sys.exit("words_test.py: the names of events are no longer where this test reads them")
    for kind, text in page.items():
        if kind not in log:
            yield f"strings.en.ts has {kind}, which is no event of the log"
        elif re.sub(r"\W+", "_", text.lower()) != kind:
            yield f"the log's {kind} is '{text}' on the page"


def self_test():
    rule = Rule("identifiers\t^crew$\tthread pool", 1)
    for scope, word, line in pieces_to_see("server/a.cpp", 'int crew;  // crew\nauto s = "the crew sails";\n'):
        if scope == rule.scope:
            rule.see(word, "server/a.cpp", line)
    assert rule.places == ["server/a.cpp:1: crew"], rule.places
    assert ("prose", "// crew", 1) in pieces_to_see("server/a.cpp", "int crew;  // crew\n")


def main():
    self_test()
    rules = read_rules(os.path.join(HERE, "word_list.txt"))
    look(ROOT, rules)
    wrong = [f"{place}: the field's word: {rule.right}" for rule in rules for place in rule.places]
    wrong += event_names_that_differ(ROOT)
    print("\n".join(wrong) or f"none of the words of {len(rules)} rules is left")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
