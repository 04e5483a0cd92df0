"""Checks that `parhelion validate` accepts every complete YAML file in a document.

A fence is complete unless its first line begins with `# fragment`. A first line that is a comment with a file's name
alone (`# lab.yaml`, `<!-- cart.urdf -->`) gives it that name: other fences of the same document refer to it so.
"""
import os
import re
import subprocess
import tempfile

NAME = re.compile(r"(?:#|//|<!--)\s*(?:file:\s*)?([\w.-]+\.\w+)\s*(?:-->)?")
NOT_OURS = "none of its keys belongs to"


def name_of(fence):
    found = NAME.fullmatch(fence.lines[0].strip()) if fence.lines else None
    return found[1] if found else None


def is_complete(fence):
    return bool(fence.lines) and not fence.lines[0].strip().startswith("# fragment")


def mirror(root, folder, place):
    """Links the files beside the document, so that its relative paths have the same targets as in the repository."""
    inner = next((part for part in folder.split("/") if part), None)
    for name in os.listdir(root):
        if name != inner:
            os.symlink(os.path.join(root, name), os.path.join(place, name))
    if inner is None:
        return place
    os.makedirs(os.path.join(place, inner))
    return mirror(os.path.join(root, inner), folder.partition("/")[2], os.path.join(place, inner))


def check_yaml(document, program):
    complete = [fence for fence in document.fences if fence.kind in ("yaml", "yml") and is_complete(fence)]
    if not complete:
        return
    with tempfile.TemporaryDirectory() as place:
        folder = mirror(document.root, os.path.dirname(document.path), place)
        paths = {}
        for number, fence in enumerate(document.fences):
            name = name_of(fence) or (f"fence_{number}.yaml" if fence in complete else None)
            if name is None:
                continue
            path = os.path.join(folder, name)
            if os.path.islink(path):
                os.unlink(path)
            with open(path, "w", encoding="utf-8") as file:
                file.write(fence.text())
            paths[fence] = path
        for fence in complete:
            ran = subprocess.run([program, "validate", paths[fence]], capture_output=True, text=True, timeout=120,
                                 check=False)
            if ran.returncode == 0 or NOT_OURS in ran.stderr:
                continue
            for line in ran.stderr.strip().splitlines():
                yield f"{document.path}:{fence.line}: {line.replace(folder + '/', '')}"
