"""messages.md: LCM types, channels and kinds of events, from the comments of their sources."""
import os
import re

from .markdown import ROOT, SourceError, cell, page, read, sentence, slug, table

MEMBER = re.compile(r"(?P<type>[\w.]+)\s+(?P<name>\w+)(?P<dimensions>(?:\[\w+\])*)\s*;(?:\s*//\s*(?P<text>.*))?")
CONSTANT = re.compile(r"const\s+(?P<type>\w+)\s+(?P<name>\w+)\s*=\s*(?P<value>[^;,]+);(?:\s*//\s*(?P<text>.*))?")
CHANNEL = re.compile(r"(?P<types>\w+(?: or \w+)*), (?P<direction>in|out|in or out): (?P<text>.+)")


def read_type(name):
    """One .lcm file: its purpose, constants and members, each with its comment."""
    path = f"protocols/lcm/{name}.lcm"
    lines = [line.strip() for line in read(path).splitlines()]
    start = next((i for i, line in enumerate(lines) if line.startswith("struct ")), len(lines))
    text = " ".join(line[2:].strip() for line in lines[:start] if line.startswith("//"))
    members, constants, last = [], [], None
    for line in lines[start + 1:]:
        found = CONSTANT.fullmatch(line) or MEMBER.fullmatch(line)
        if found:
            last = {key: value or "" for key, value in found.groupdict().items()}
            (constants if "value" in last else members).append(last)
        elif line.startswith("//") and last:
            last["text"] = f"{last['text']} {line[2:].strip()}".strip()
        elif line not in ("", "{", "}"):
            raise SourceError(f"{path}: cannot read '{line}': expected one member or constant a line, and its comment")
    for each in [*members, *constants]:
        if not each["text"]:
            raise SourceError(f"{path}: '{each['name']}' has no comment that says what it means, with unit and frame")
    if not text:
        raise SourceError(f"{path}: no comment above says what the message is for")
    return {"text": text, "members": members, "constants": constants}


def read_channels():
    """Name, types, direction and meaning of each channel, from the comments of channels.hpp."""
    path, channels, comment = "protocols/channels.hpp", [], []
    for line in read(path).splitlines():
        if line.startswith("///"):
            comment.append(line[3:].strip())
            continue
        constant = re.search(r'= "([^"]+)"', line)
        if constant:
            comment = [f"{constant[1]}: {' '.join(comment)}"]
        # Channels without a constant: those of each agent, such as "MR_AGENT_<name>_SCAN: planar_lidar_t,
        # out: ..."
        for entry in re.split(r" (?=[A-Z_]+<\w+>[A-Z_]*: )", " ".join(comment)) if comment else []:
            name, _, rest = entry.partition(": ")
            found = CHANNEL.fullmatch(rest)
            if not found:
                raise SourceError(f"{path}: {name}: expected a comment above it such as "
                                  "'/// planar_lidar_t, in: scans of the robot's laser.'")
            channels.append({"name": name, **found.groupdict(), "types": found["types"].split(" or ")})
        comment = []
    return channels


def event_kinds():
    """Number, name and meaning of the kinds of events."""
    path = "protocols/event.hpp"
    body = re.search(r"enum class EventKind[^{]*\{(.*?)\n\};", read(path), re.DOTALL)
    if not body:
        raise SourceError(f"{path}: there is no 'enum class EventKind'")
    kinds, above = [], ""
    for line in map(str.strip, body[1].splitlines()):
        found = re.fullmatch(r"(\w+)(?: = (\d+))?,?(?:\s*///<\s*(.*))?", line)
        if found:
            number = int(found[2]) if found[2] else kinds[-1][0] + 1 if kinds else 0
            kinds.append([number, found[1], f"{above} {found[3] or ''}".strip()])
            above = ""
        elif line.startswith("///<") and kinds:
            kinds[-1][2] = f"{kinds[-1][2]} {line[4:].strip()}".strip()
        elif line.startswith("///"):
            above = f"{above} {line[3:].strip()}".strip()
        elif line:
            raise SourceError(f"{path}: cannot read '{line}': expected one kind of event a line")
    return [[f"`{number}`", f"`{name}`", cell(text)] for number, name, text in kinds]


def member_row(member, types):
    kind = member["type"]
    shown = f"[`{kind}`](#{slug(kind)})" if kind in types else f"`{kind}`"
    return [f"`{member['name']}{member['dimensions']}`", shown, cell(member["text"])]


def type_section(name, types, channels):
    described = types[name]
    carried = [f"`{each['name']}` ({each['direction']})" for each in channels if name in each["types"]]
    holders = [f"[`{other}`](#{slug(other)})" for other in types
               if any(member["type"] == name for member in types[other]["members"])]
    if not carried and not holders:
        raise SourceError(f"protocols/lcm/{name}.lcm: no channel of protocols/channels.hpp carries it")
    where = [f"Channels: {', '.join(carried)}."] if carried else []
    where += [f"Part of {', '.join(holders)}."] if holders else []
    blocks = [f"## {name}\n", cell(described["text"]) + "\n", " ".join(where) + "\n"]
    if described["constants"]:
        blocks.append(table(["constant", "value", "meaning"],
                            [[f"`{each['name']}`", f"`{each['value'].strip()}`", cell(each["text"])]
                             for each in described["constants"]]))
    blocks.append(table(["member", "type", "meaning"], [member_row(each, types) for each in described["members"]]))
    return "\n".join(blocks)


def text():
    names = sorted(file[:-4] for file in os.listdir(os.path.join(ROOT, "protocols/lcm")) if file.endswith(".lcm"))
    types = {name: read_type(name) for name in names}
    channels = read_channels()
    rows = []
    for each in channels:
        for name in each["types"]:
            if name not in types:
                raise SourceError(f"protocols/channels.hpp: {each['name']}: there is no type {name}")
        carried = " or ".join(f"[`{name}`](#{slug(name)})" for name in each["types"])
        rows.append([f"`{each['name']}`", each["direction"], carried, cell(sentence(each["text"]))])
    intro = ("LCM types of package `parhelion`, and the channels that carry them. Directions are the server's: it "
             "receives what is *in* and publishes what is *out*; *in or out*: out where the robot is simulated. A "
             "scenario can rename every channel.\n")
    return page("Messages", "protocols/lcm/*.lcm, protocols/channels.hpp and protocols/event.hpp", intro,
                "## Channels\n", table(["channel", "direction", "type", "meaning"], rows),
                *(type_section(name, types, channels) for name in names), "## Kinds of events\n",
                "Subject, object, value and text of an [`event_t`](#event_t) by its kind.\n",
                table(["number", "kind", "meaning"], event_kinds()))
