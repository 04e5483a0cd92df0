#!/usr/bin/env python3
"""Writes parhelion(1) to standard output, from the program's own help.

usage: man_page.py PROGRAM VERSION
"""
import os
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

from reference_pages.commands import help_of_all  # noqa: E402

HEAD = r""".TH PARHELION 1 "" "parhelion {version}" "User Commands"
.SH NAME
parhelion \- mixed\-reality server for training operators of mobile robots
.SH SYNOPSIS
.B parhelion
.I command
[\fIarguments\fR]
.SH DESCRIPTION
Parhelion puts virtual robots, people and obstacles into the laser scans, point clouds, depth images and video of a real robot, and grades
the operator who drives it. It speaks LCM.
.PP
Exit codes: 0 done, 1 failed, 2 usage.
.SH COMMANDS
"""
TAIL = r""".SH ENVIRONMENT
.TP
.B LCM_DEFAULT_URL
The network of the robots, where a command has no \-\-url.
.TP
.B PARHELION_SHARE
The folder of the shipped robots, scenarios and presets.
.TP
.B NOTIFY_SOCKET, WATCHDOG_USEC
Set by systemd for
.BR "parhelion serve" ,
see
.BR sd_notify (3).
.SH FILES
.TP
.I /etc/parhelion/parhelion.env
Settings of parhelion.service.
.TP
.I /var/lib/parhelion
Sessions, accounts, certificate and active emergency stops of parhelion.service.
.TP
.I /usr/share/parhelion
Shipped robots, scenarios and presets.
"""


def escape(text):
    text = text.replace("\\", r"\e").replace("-", r"\-")
    return r"\&" + text if text[:1] in (".", "'") else text


def command(words, text):
    purpose, _, usage = text.strip("\n").partition("\nUsage: ")
    lines = ("Usage: " + usage).rstrip().splitlines()
    return "\n".join([f".SS {escape(words)}", escape(" ".join(purpose.split())), ".PP", ".nf",
                      *map(escape, lines), ".fi", ""])


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    program, version = sys.argv[1:]
    sections = help_of_all(program)
    sys.stdout.write(HEAD.replace("{version}", version))
    for words, text in sections[1:]:
        sys.stdout.write(command(words, text))
    sys.stdout.write(TAIL)


if __name__ == "__main__":
    main()
