"""Pages of the YAML files: the keys of a schema, with type, unit, range, default and meaning."""
import json
import os
import re

from .markdown import ROOT, SourceError, cell, page, read, sentence, slug, table

NAMES = {"string": "text", "integer": "whole number", "number": "number", "boolean": "true or false"}


def read_units():
    """Units that the program accepts, by quantity; the first is that of bounds."""
    text = read("protocols/yaml/quantity.cpp")
    lists = {name: re.findall(r'\{"([^"]+)"', body)
             for name, body in re.findall(r"constexpr Unit (\w+)\[\] = \{(.*?)\};", text)}
    return {quantity: lists[name] for quantity, name in re.findall(r'\{"(\w+)", (\w+)\}', text) if name in lists}


def read_schemas():
    folder = "protocols/yaml"
    return {file: json.loads(read(f"{folder}/{file}")) for file in os.listdir(os.path.join(ROOT, folder))
            if file.endswith(".schema.json")}


def count(schema):
    """Allowed number of items of a list."""
    least, most = schema.get("minItems", 0), schema.get("maxItems")
    if most is None:
        return f"{least} items or more" if least > 1 else "not empty" if least else ""
    return f"{least} to {most} items" if least else f"at most {most} items"


def bounds(schema, unit):
    """Minimum and maximum as text."""
    unit = f" {unit}" if unit else ""
    if "minimum" in schema and "maximum" in schema:
        return f"{schema['minimum']:.10g} to {schema['maximum']:.10g}{unit}"
    words = {"minimum": "at least", "exclusiveMinimum": "above", "maximum": "at most", "exclusiveMaximum": "below"}
    given = [f"{word} {schema[key]:.10g}" for key, word in words.items() if key in schema]
    return ", ".join(given) + unit if given else ""


class SchemaPage:
    """One page: the keys of a schema, a section for each map of keys."""

    def __init__(self, file, others):
        self.file, self.others = file, others  # others: title and page of the schemas that have pages of their own
        self.units, self.schemas = read_units(), read_schemas()
        self.sections, self.parts, self.waiting = [], set(), []

    def target(self, reference):
        file, _, pointer = reference.partition("#")
        schema = self.schemas[file]
        for step in filter(None, pointer.split("/")):
            schema = schema[step]
        return self.resolve(schema)

    def resolve(self, schema):
        """The schema of "$ref", with its keywords overridden by those beside it."""
        if "$ref" not in schema:
            return schema
        return {**self.target(schema["$ref"]), **{key: value for key, value in schema.items() if key != "$ref"}}

    def link(self, schema, path):
        """Link to the description of a map's keys; adds the description if it is missing."""
        reference = schema.get("$ref")
        if reference is None:
            self.section(path, schema, path)
            return f"[keys](#{slug(path)})"
        if reference in self.others:
            title, name = self.others[reference]
            return f"[{title.lower()}]({name})"
        file, _, pointer = reference.partition("#")
        if file == self.file and pointer.startswith("/properties/"):  # a section that exists anyway
            path = pointer.replace("/properties/", ".").replace("/items", "[]").lstrip(".")
            return f"[keys](#{slug(path)})"
        name = (pointer or file.split(".")[0]).split("/")[-1].replace("_", " ")
        if reference not in self.parts:
            self.parts.add(reference)
            self.waiting.append((name, self.target(reference)))
        return f"[{name}](#{slug(f'Type: {name}')})"

    def kind(self, schema, path):
        """Type, units and range of a value."""
        whole = self.resolve(schema)
        if whole["type"] == "any":  # read with condition.schema.json
            return f"[condition](#{slug('Type: condition')})", "", ""
        if whole["type"] == "array":
            return self.list_kind(whole, schema, path)
        if whole["type"] == "object":
            others = whole.get("additionalProperties")
            if not isinstance(others, dict):
                return self.link(schema, path), "", ""
            shown, unit, limits = self.kind(others, f"{path}.NAME")
            return f"{shown}, by name", unit, limits
        if "unit" in whole:
            units = self.units[whole["unit"]]
            shown = " or ".join([whole["unit"].replace("_", " "), *(f"`{word}`" for word in whole.get("words", []))])
            return shown, ", ".join(f"`{unit}`" for unit in units), bounds(whole, units[0])
        if "enum" in whole:
            return "one of", "", ", ".join(f"`{word}`" for word in whole["enum"])
        return "base64, `!!binary`" if "binary" in whole else NAMES[whole["type"]], "", bounds(whole, "")

    def list_kind(self, whole, schema, path):
        items = whole["items"]
        if "$ref" in schema and "properties" in items:  # a list of maps that is described once
            return f"list of {self.link(schema, path)}", "", count(whole)
        shown, unit, limits = self.kind(items, f"{path}[]")
        plural = shown if shown.startswith(("[", "list")) else f"{shown}s"
        if self.resolve(items)["type"] == "array":
            return f"list of points, each {shown}", unit, ", ".join(filter(None, [count(whole), limits]))
        if whole.get("minItems") == whole.get("maxItems") is not None:
            return f"{whole['maxItems']} {plural}", unit, limits
        return f"list of {plural}", unit, ", ".join(filter(None, [count(whole), limits]))

    def row(self, key, schema, path, required):
        whole = self.resolve(schema)
        if not whole.get("description"):
            raise SourceError(f"protocols/yaml/{self.file}: '{path}' has no description")
        kind, unit, limits = self.kind(schema, path)
        default = "required" if required else ""
        if "default" in whole:
            value = whole["default"]
            value = f"[{', '.join(map(str, value))}]" if isinstance(value, list) else value
            default = f"`{str(value).lower() if isinstance(value, bool) else value}`"
        return [f"`{key}`", kind, unit, limits, default, cell(sentence(whole["description"]))]

    def section(self, title, schema, path):
        """The section of a map, followed by those of the maps in it."""
        whole = self.resolve(schema)
        text = whole.get("description", "")
        if "items" in whole:
            whole = self.resolve(whole["items"])
            text = whole.get("description", text)
        place = len(self.sections)
        self.sections.append("")
        rows = [self.row(key, value, f"{path}.{key}".lstrip("."), key in whole.get("required", []))
                for key, value in whole["properties"].items()]
        self.sections[place] = "\n".join(
            [f"## {title}\n", *([cell(sentence(text)) + ".\n"] if text else []),
             table(["key", "type", "unit", "range", "default", "meaning"], rows)])

    def text(self, title):
        schema = self.schemas[self.file]
        self.section("Keys", {**schema, "description": ""}, "")
        if self.file == "scenario.schema.json":
            self.waiting.append(("condition", self.schemas["condition.schema.json"]))
        for name, part in self.waiting:  # grows during the loop
            self.section(f"Type: {name}", part, name)
        units = ("A value with a unit is written with it, such as `0.5 m`; ranges are in the first of the units that "
                 "are listed. A key that is not required may be left out: then its default holds, or what the meaning "
                 "says after *none*.\n")
        return page(title, f"protocols/yaml/{self.file} and the schemas it refers to",
                    cell(schema["description"]) + "\n", units, *self.sections)


PAGES = {
    "scenario.md": ("Scenario", "scenario.schema.json"),
    "robot-description.md": ("Robot description", "robot.schema.json"),
    "robot-model.md": ("Robot model", "robot_model.schema.json"),
    "model.md": ("Semantic model", "model.schema.json"),
    "course.md": ("Course", "course.schema.json"),
    "joystick.md": ("Joystick mapping", "joystick.schema.json"),
    "keys.md": ("Keys", "keys.schema.json"),
}


def pages():
    others = {schema: (title, name) for name, (title, schema) in PAGES.items()}
    return {name: SchemaPage(schema, others).text(title) for name, (title, schema) in PAGES.items()}
