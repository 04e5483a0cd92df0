"""commands.md: the help of all commands, from the program itself."""
import os
import re
import subprocess

from .markdown import SourceError, cell, page, sentence, slug, table

EXAMPLE = re.compile(r"(?:[A-Z][A-Za-z ]*:)?\s*((?:parhelion|source) .*?)(?:\s{3,}\((.*)\))?")


def help_of_all(program):
    """The words of each command and its help, as the program prints them."""
    clean = {key: value for key, value in os.environ.items() if key in ("PATH", "LD_LIBRARY_PATH")}
    done = subprocess.run([program, "help", "--all"], capture_output=True, text=True, env=clean, check=False)
    if done.returncode != 0:
        raise SourceError(f"{program} help --all: exit status {done.returncode}: {done.stderr.strip()}")
    parts = re.split(r"^== (.+) ==\n", done.stdout, flags=re.MULTILINE)
    if len(parts) < 3:
        raise SourceError(f"{program} help --all: found no line such as '== parhelion serve =='")
    return list(zip(parts[1::2], parts[2::2]))


def fence(kind, lines):
    return f"```{kind}\n" + "\n".join(lines) + "\n```\n"


def footer(text):
    """The text below the options: example commands, tables with two spaces before them, sentences."""
    blocks = []  # kind of fence, or "", and lines
    for line in text.strip("\n").splitlines():
        example = EXAMPLE.fullmatch(line)
        if re.fullmatch(r"Examples?:", line):
            continue
        if example:
            kind, line = "sh", example[1] + (f"  # {example[2]}" if example[2] else "")
        else:
            kind = "text" if line.startswith("  ") else ""
        if not blocks or blocks[-1][0] != kind or not line:
            blocks.append((kind, []))
        if line:
            blocks[-1][1].append(line)
    return [fence(kind, lines) if kind else cell(" ".join(lines)) + "\n" for kind, lines in blocks if lines]


def command_section(words, text):
    found = re.fullmatch(r"(.*?)\n(Usage: .*?)(?:\n\n(Examples?:.*))?", text.strip("\n"), re.DOTALL)
    if not found:
        raise SourceError(f"{words} --help: expected a description, 'Usage:' and the options, and then 'Example:'")
    return "\n".join([f"## {words}\n", cell(sentence(" ".join(found[1].split()))) + ".\n",
                      fence("text", found[2].rstrip().splitlines()), *footer(found[3] or "")])


def text(program):
    sections = help_of_all(program)
    rows = [[f"[`{words}`](#{slug(words)})", cell(sentence(" ".join(help_text.partition("\nUsage:")[0].split())))]
            for words, help_text in sections[1:]]
    intro = ("`parhelion help COMMAND` prints what is here of each command. Exit codes: 0 done, 1 failed, 2 usage.\n")
    return page("Commands", "the program's own help", intro, table(["command", "what it does"], rows),
                *(command_section(*section) for section in sections))
