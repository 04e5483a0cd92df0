#!/usr/bin/env python3
"""Runs ExecStart of parhelion.service as the unit does: as a user of its own without capabilities, with the unit's system calls only, on a
read-only system. The server must get ready, feed the watchdog, write its session log and stop.

usage: sandbox_test.py PROGRAM
"""
import ctypes
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True

import seccomp  # noqa: E402
from unit import ROOT, SKIPPED, command, read_environment, read_unit  # noqa: E402

USER = 64999  # any without rights here
CLONE_NEWNS, MS_RDONLY, MS_REMOUNT, MS_BIND, MS_REC, MS_PRIVATE = 0x20000, 1, 32, 4096, 16384, 1 << 18
TIMEOUT = 30  # seconds


def mount(what, where, flags):
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mount(what.encode() if what else None, where.encode(), None, flags, None) != 0:
        raise OSError(ctypes.get_errno(), f"mount {where}")


def protect_system(state):
    """ProtectSystem=strict with StateDirectory=, of this process and its children."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(CLONE_NEWNS) != 0:
        raise OSError(ctypes.get_errno(), "unshare")
    mount(None, "/", MS_REC | MS_PRIVATE)
    mount(state, state, MS_BIND)
    mount(None, "/", MS_REMOUNT | MS_BIND | MS_RDONLY)
    os.chdir(os.path.join(state, "sessions"))


def drop_privileges():
    os.setgroups([])
    os.setgid(USER)
    os.setuid(USER)  # drops all capabilities, since none is ambient


class Manager:
    def __init__(self, folder):
        self.path = os.path.join(folder, "notify")
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(self.path)
        os.chmod(self.path, 0o666)

    def expect(self, text):
        """A server that dies again and again sends other messages for ever."""
        deadline = time.monotonic() + TIMEOUT
        message = ""
        while not message.startswith(text):
            self.socket.settimeout(max(deadline - time.monotonic(), 0.001))
            message = self.socket.recv(4096).decode()


def run(program, folder):
    settings, environment = read_unit(), read_environment()
    state = os.path.join(folder, "state")
    os.makedirs(os.path.join(state, "sessions"), mode=0o700)
    for path in (state, os.path.join(state, "sessions")):
        os.chown(path, USER, USER)
    environment["PARHELION_SCENARIO"] = os.path.join(ROOT, os.path.relpath(environment["PARHELION_SCENARIO"], "/usr/share/parhelion"))
    environment["PARHELION_OPTIONS"] = "--http 127.0.0.1:0"
    environment["LCM_DEFAULT_URL"] = environment["LCM_DEFAULT_URL"].replace(":7667", f":{20000 + os.getpid() % 20000}")
    arguments = [each.replace("/var/lib/parhelion", state) for each in command(settings, environment)]
    manager = Manager(folder)
    environment |= {"PATH": "/usr/bin:/bin", "NOTIFY_SOCKET": manager.path, "WATCHDOG_USEC": "1000000"}
    allowed = seccomp.numbers(seccomp.permitted(settings["SystemCallFilter"]))

    def enter():
        protect_system(state)
        os.umask(int(settings["UMask"][0], 8))
        drop_privileges()
        seccomp.enforce(allowed)

    with open(os.path.join(folder, "log"), "w+", encoding="utf-8") as log:
        server = subprocess.Popen([program, *arguments[1:]], env=environment, stderr=log, preexec_fn=enter)
        try:
            for text in ("READY=1", "WATCHDOG=1", "WATCHDOG=1"):
                manager.expect(text)
            server.send_signal(signal.SIGTERM)
            manager.expect("STOPPING=1")
            status = server.wait(TIMEOUT)
        except (TimeoutError, subprocess.TimeoutExpired):
            status = "timeout"
        finally:
            if server.poll() is None:
                server.kill()
        log.seek(0)
        text = log.read()
    sessions = os.listdir(os.path.join(state, "sessions"))
    if status != 0 or not any(name.endswith(".lcm") for name in sessions):
        print(f"{' '.join(arguments)}: exit status {status}, session logs {sessions}; expected 0 and one log\n{text}")
        return 1
    return 0


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    if os.geteuid() != 0 or not shutil.which("systemd-analyze") or not os.path.exists(seccomp.UNISTD):
        print("SKIPPED: wants root, systemd-analyze and the kernel's headers for x86-64")
        return SKIPPED
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        return run(os.path.abspath(sys.argv[1]), folder)


if __name__ == "__main__":
    sys.exit(main())
