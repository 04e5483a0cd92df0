"""Checks that every command in a document exists in the program or the repository."""
import os
import re
import shlex
import subprocess

FOLDERS = ("fusion", "protocols", "render", "server", "tests", "tools", "docs", "examples")
BEFORE_A_COMMAND = {"sudo", "time", "exec", "nohup", "env", "if", "while", "then", "do", "else", "!"}
PUNCTUATION = set("();<>|&")


def logical_lines(fence):
    """Number and text of lines; joins lines that end in a backslash, skips here-documents."""
    number, text, end = None, "", ""
    for offset, line in enumerate(fence.lines):
        if end:
            end = "" if line.strip() == end else end
            continue
        number = fence.line + offset if number is None else number
        if line.endswith("\\"):
            text += line[:-1] + " "
            continue
        text += re.sub(r"^\$ ", "", line)
        found = re.search(r"<<-?\s*['\"]?(\w+)", text)
        end = found[1] if found else ""
        yield number, text
        number, text = None, ""


def split_commands(text):
    """The commands of a shell line, each as its words, without redirections and assignments."""
    lexer = shlex.shlex(text, posix=True, punctuation_chars="();<>|&")
    lexer.whitespace_split = True
    words, commands, skip = [], [], False
    for token in lexer:
        if set(token) <= PUNCTUATION:
            redirects = "<" in token or ">" in token
            skip = redirects and not token.endswith("(")
            if skip and words and words[-1].isdigit():
                words.pop()
            if not skip:
                commands.append(words)
                words = []
        elif skip:
            skip = False
        else:
            words.append(token)
    commands.append(words)
    for command in commands:
        while command and (command[0] in BEFORE_A_COMMAND or re.match(r"\w+=", command[0])):
            command = command[1:]
        if command:
            yield command


def is_program(word):
    return word == "parhelion" or word.endswith("/tools/parhelion")


def runs_at_once(words, root):
    """True if it ends within seconds and needs only files of the repository."""
    if words[0] in ("help", "--version", "doctor", "completion") or words[-1] in ("--help", "-h"):
        return True
    files = [word for word in words[1:] if not word.startswith("-")]
    return words[0] == "validate" and all(os.path.exists(os.path.join(root, file)) for file in files)


class CommandChecker:
    def __init__(self, root, program):
        self.root, self.program, self.known = root, program, {}

    def run(self, words):
        return subprocess.run([self.program, *words], cwd=self.root, capture_output=True, text=True, timeout=120,
                              stdin=subprocess.DEVNULL, check=False)

    def program_problem(self, words):
        parsed = self.run(["--parse-only", *words])
        if parsed.returncode != 0:
            return parsed.stderr.strip().splitlines()[0] if parsed.stderr.strip() else f"exit {parsed.returncode}"
        if not words or not runs_at_once(words, self.root):
            return ""
        ran = self.run(words)
        # The result of doctor depends on the machine.
        allowed = (0, 1) if words[0] == "doctor" else (0,)
        return "" if ran.returncode in allowed else f"exit {ran.returncode}: {(ran.stderr or ran.stdout).strip()}"

    def path_problem(self, words, written):
        """Checks a script, or files of the repository among the arguments. `written`: files of earlier commands."""
        for place, word in enumerate(words):
            name = word.removeprefix("./")
            is_script = place == 0 and word.startswith("./")
            if name in written or name.startswith("build/") or re.search(r"[$*<{]", word):
                continue
            if not is_script and not (name.split("/")[0] in FOLDERS and "/" in name):
                continue
            path = os.path.join(self.root, word)
            if not os.path.exists(path):
                return f"{word} is not there"
            if place == 0 and not os.access(path, os.X_OK):
                return f"{word} is not a program"
        return ""

    def problem(self, words, written):
        written.update(word for before, word in zip(words, words[1:]) if before in ("-o", "--output"))
        wrong = self.path_problem(words, written)
        if wrong or not is_program(words[0]):
            return wrong
        key = tuple(words[1:])
        if key not in self.known:
            self.known[key] = self.program_problem(words[1:])
        return self.known[key]

    def check(self, document):
        written = set()
        for fence in document.fences:
            if fence.kind in ("sh", "bash", "shell", "console", ""):
                yield from self.check_fence(document, fence, written)

    def check_fence(self, document, fence, written):
        for number, text in logical_lines(fence):
            try:
                commands = list(split_commands(text)) if fence.kind else []
            except ValueError as error:
                yield f"{document.path}:{number}: cannot read '{text}': {error}"
                continue
            if not fence.kind and re.match(r"\s*(\$ )?(\./build/\S*/)?parhelion\s", text):
                yield f"{document.path}:{number}: a command stands in a fence without a language: write ```sh"
            for words in commands:
                problem = self.problem(words, written)
                if problem:
                    yield f"{document.path}:{number}: {' '.join(words)}: {problem}"
