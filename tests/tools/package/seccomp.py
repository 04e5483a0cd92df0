"""The system calls that a unit permits, enforced as systemd does it, by seccomp(2)."""
import ctypes
import re
import struct
import subprocess

UNISTD = "/usr/include/x86_64-linux-gnu/asm/unistd_64.h"
PR_SET_NO_NEW_PRIVS, PR_SET_SECCOMP, SECCOMP_MODE_FILTER = 38, 22, 2
ALLOW, KILL_PROCESS = 0x7FFF0000, 0x80000000
LOAD, EQUAL, RETURN = 0x20, 0x15, 0x06  # BPF: load a word, jump if equal, return a constant


def members(group, seen=None):
    """Names of the system calls of a group such as @system-service, groups in it included."""
    seen = set() if seen is None else seen
    listed = subprocess.run(["systemd-analyze", "syscall-filter", "--no-pager", group], capture_output=True, text=True, check=True).stdout
    names = set()
    for name in (line.strip() for line in listed.splitlines()):
        if name.startswith("@") and name != group and name not in seen:
            seen.add(name)
            names |= members(name, seen)
        elif re.fullmatch(r"[a-z_0-9]+", name):
            names.add(name)
    return names


def permitted(filters):
    """Of the values of SystemCallFilter=."""
    names = members("@default")
    for value in filters:
        calls = set()
        for each in value.lstrip("~").split():
            calls |= members(each) if each.startswith("@") else {each}
        names = names - calls if value.startswith("~") else names | calls
    return names | {"execve", "exit", "exit_group", "rt_sigreturn"}  # always, systemd.exec(5)


def numbers(names):
    with open(UNISTD, encoding="utf-8") as file:
        table = dict(re.findall(r"#define __NR_(\w+)\s+(\d+)", file.read()))
    return sorted(int(table[name]) for name in names if name in table)


def enforce(allowed):
    """Of this process and its children: any other system call ends the process with SIGSYS."""
    instructions = [(LOAD, 0, 0, 0)]  # seccomp_data.nr
    for number in allowed:
        instructions += [(EQUAL, 0, 1, number), (RETURN, 0, 0, ALLOW)]
    instructions.append((RETURN, 0, 0, KILL_PROCESS))
    program = b"".join(struct.pack("HBBI", *each) for each in instructions)
    code = ctypes.create_string_buffer(program, len(program))
    header = struct.pack("HxxxxxxP", len(instructions), ctypes.addressof(code))
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 or \
            libc.prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, ctypes.create_string_buffer(header, len(header)), 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl")
