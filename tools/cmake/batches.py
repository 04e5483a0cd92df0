#!/usr/bin/env python3
"""Groups sources that can be compiled together: batches.py SIZE FILE...

Sources of one target that are compiled as one share their unnamed namespace. So no file may come together with
one that mentions a name of its unnamed namespace, a static function or a macro of its own, or includes a header of
the project that declares such a name: the program would not compile, or would call another function than each file alone. Prints lines "number=file": the batch of each file.
"""
import functools
import os
import re
import sys

_ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
_INCLUDE = re.compile(r'^#include "([^"]+)"', re.M)
# Comments, and texts.
_NOISE = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)+\'', re.S)
_DIRECTIVE = re.compile(r'^[ \t]*#(?:[^\n\\]|\\.)*', re.M | re.S)
_MACRO = re.compile(r'^[ \t]*#\s*define\s+(\w+)', re.M)
_WORD = re.compile(r'[A-Za-z_]\w*')
_NAMESPACE = re.compile(r'(?:inline\s+)?namespace\b\s*([\w:]*)$')
_ALIAS = re.compile(r'(?:using|namespace)\s+(\w+)\s*=\s*(.*)', re.S)
_TYPE = re.compile(r'(?:struct|class|union|enum(?:\s+class|\s+struct)?)\s+(?:\[\[\w+\]\]\s*)?(\w+)\s*(?:final\s*)?(?::|$)')
_TEMPLATE = re.compile(r'template\s*<(?:[^<>]|<(?:[^<>]|<[^<>]*>)*>)*>\s*')
_NOT_A_NAME = re.compile(r'(?:using|namespace|extern|static_assert|friend|namespace)\b|.*\boperator\b', re.S)


def _declarators(declaration):
    """The names of the function or the variables that a declaration declares."""
    depth, start, parts = 0, 0, []
    for at, letter in enumerate(declaration):
        depth += (letter in '<([') - (letter in '>)]')
        if letter == ',' and depth == 0:
            parts.append(declaration[start:at])
            start = at + 1
    for part in parts + [declaration[start:]]:
        # Template arguments of the type come before the name.
        plain = re.sub(r'<[^<>()]*>', ' ', re.sub(r'<[^<>()]*>', ' ', re.sub(r'<[^<>()]*>', ' ', part)))
        words = _WORD.findall(re.split(r'[=(\[]', plain, maxsplit=1)[0])
        if words:
            yield words[-1]


def _names(declaration):
    """(name, text that an equal definition must have, or None) of what a declaration at namespace scope declares."""
    declaration = _TEMPLATE.sub('', declaration.strip())
    alias = _ALIAS.match(declaration)
    if alias:
        return [(alias[1], ' '.join(alias[2].split()))]
    kind = _TYPE.match(declaration)
    if kind:
        return [(kind[1], None)]
    return [] if _NOT_A_NAME.match(declaration) else [(name, None) for name in _declarators(declaration)]


def _declarations(source):
    """(declaration, whether its namespace is unnamed) of each at namespace scope."""
    scopes, declaration = [], ''  # of each open brace: the namespace's name, '' if it has none; None: no namespace
    for piece in re.split(r'([{};])', _DIRECTIVE.sub('', source)):
        if piece not in ('{', '}', ';'):
            declaration = piece
            continue
        at_namespace_scope = None not in scopes
        namespace = _NAMESPACE.match(declaration.strip()) if at_namespace_scope and piece == '{' else None
        if at_namespace_scope and piece != '}' and not namespace:
            yield declaration, '' in scopes
        if piece == '{':
            scopes.append(namespace[1] if namespace else None)
        elif piece == '}' and scopes:
            scopes.pop()
        declaration = ''


def read(source):
    """(private names with the text that an equal one must have, or None; all words) of a file's text."""
    source = _NOISE.sub(' ', source)
    private = {name: None for name in _MACRO.findall(source)}
    for declaration, unnamed in _declarations(source):
        if unnamed or declaration.lstrip().startswith('static ') or _ALIAS.match(declaration.strip()):
            private.update(_names(declaration))
    return private, set(_WORD.findall(source))


def _hides(private, other):
    other_private, words = other
    return any(name in words and (text is None or other_private.get(name) != text)
               for name, text in private.items())


def batches(files, size):
    """The files (name, what read() gave) in lists of at most `size`; files next to each other stay together."""
    lists = []
    for name, file in files:
        for batch in lists:
            if len(batch) < size and not any(
                    _hides(file[0], other) or _hides(other[0], file) for _, other in batch):
                batch.append((name, file))
                break
        else:
            lists.append([(name, file)])
    return [[name for name, _ in batch] for batch in lists]


def _text(path):
    with open(path, encoding='utf-8') as file:
        return file.read()


@functools.cache
def _names_of_headers(path):
    """What the project's headers that a file includes, directly or not, declare at namespace scope."""
    names = set()
    for header in _INCLUDE.findall(_text(path)):
        header = os.path.join(_ROOT, header)
        if os.path.exists(header):
            for declaration, _ in _declarations(_NOISE.sub(' ', _text(header))):
                names.update(name for name, _ in _names(declaration))
            names |= _names_of_headers(header)
    return names


def main(size, names):
    files = []
    for name in names:
        private, words = read(_text(name))
        files.append((name, (private, words | _names_of_headers(name))))
    for number, batch in enumerate(batches(files, size)):
        for name in batch:
            print(f'{number}={name}')


if __name__ == '__main__':
    if len(sys.argv) < 3:
        sys.exit(__doc__.splitlines()[0])
    main(int(sys.argv[1]), sys.argv[2:])
