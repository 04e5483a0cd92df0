"""Splits a source text into (kind, text) pieces: kind is code, comment or string."""
import re

CPP = re.compile(r"""
 (?P<comment>//[^\n]*|/\*.*?\*/)
|(?P<raw>R"(?P<d>[^()\\\s]{0,16})\(.*?\)(?P=d)")
|(?P<string>"(?:[^"\\\n]|\\.)*")
|(?P<char>'(?:[^'\\\n]|\\.){1,4}')
""", re.S | re.X)
HASH = re.compile(r"""
 (?P<comment>(?:(?<=\s)|^)\#[^\n]*)
|(?P<string>"(?:[^"\\\n]|\\.)*")
""", re.S | re.X | re.M)
JSON = re.compile(r'(?P<string>"(?:[^"\\\n]|\\.)*")')
LCM = re.compile(r"(?P<comment>//[^\n]*)")
# Template literals are whole strings, including their ${...}.
SCRIPT = re.compile(r"""
 (?P<comment>(?<![:"'`\w/])//[^\n]*|/\*.*?\*/|<!--.*?-->)
|(?P<string>"(?:[^"\\\n]|\\.)*"|(?<![A-Za-z0-9])'(?:[^'\\\n]|\\.)*'|`(?:[^`\\]|\\.)*`)
""", re.S | re.X)

LEXERS = {"cpp": CPP, "hpp": CPP, "in": CPP, "h": CPP, "ts": SCRIPT, "js": SCRIPT, "mjs": SCRIPT, "svelte": SCRIPT,
          "yaml": HASH, "cmake": HASH, "json": JSON, "lcm": LCM}


def lexer_of(path):
    return LEXERS.get(path.rsplit(".", 1)[-1])


def pieces(path, text):
    at = 0
    for match in lexer_of(path).finditer(text):
        if match.start() > at:
            yield "code", text[at:match.start()]
        yield "comment" if match.groupdict().get("comment") else "string", match.group(0)
        at = match.end()
    if at < len(text):
        yield "code", text[at:]
