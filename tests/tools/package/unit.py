"""parhelion.service and its settings, as the tests of the package read them."""
import os
import shlex

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
PACKAGE = os.path.join(ROOT, "tools/package")
UNIT = os.path.join(PACKAGE, "parhelion.service")
SKIPPED = 77  # for ctest


def read_unit(path=UNIT):
    """Setting -> its values, in order."""
    settings = {}
    with open(path, encoding="utf-8") as file:
        for line in file:
            key, equals, value = line.strip().partition("=")
            if equals and not line.startswith("#"):
                settings.setdefault(key, []).append(value)
    return settings


def read_environment(path=os.path.join(PACKAGE, "parhelion.env")):
    with open(path, encoding="utf-8") as file:
        lines = [line.strip() for line in file]
    return dict(line.split("=", 1) for line in lines if line and not line.startswith("#"))


def command(settings, environment):
    """ExecStart with its variables replaced as systemd does: ${X} is one argument, $X its words."""
    arguments = []
    for token in shlex.split(settings["ExecStart"][0]):
        if token.startswith("${") and token.endswith("}"):
            arguments.append(environment[token[2:-1]])
        elif token.startswith("$"):
            arguments += environment[token[1:]].split()
        else:
            arguments.append(token)
    return arguments
