#!/usr/bin/env python3
"""Runs the clients of examples/ against a live server: one robot, one instructor and one reader in each language."""
import argparse
import os
import pathlib
import queue
import re
import subprocess
import sys
import tempfile
import threading
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PYTHON_CLIENTS = ROOT / "examples/clients/python"
TIMEOUT = 60  # s, for what takes well below one on an idle machine
programs = argparse.Namespace()  # where the built programs are


class Process:
    """A program in the background, and the lines that it prints."""

    def __init__(self, command, environment):
        self._process = subprocess.Popen(command, env=environment, text=True, stdout=subprocess.PIPE,
                                         stderr=subprocess.STDOUT)
        self._name = " ".join(pathlib.Path(part).name for part in command[:2])
        self._lines = queue.Queue()
        self._seen = []
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def wait_for(self, wanted):
        """The first line, of those not yet looked at, for which wanted(line) is true."""
        deadline = time.monotonic() + TIMEOUT
        while True:
            try:
                line = self._lines.get(timeout=max(0, deadline - time.monotonic()))
            except queue.Empty:
                raise AssertionError(f"{self._name}: no such line in {TIMEOUT} s: {self._seen[-20:]}") from None
            if line is None:
                raise AssertionError(f"{self._name} has ended: {self._seen[-20:]}")
            self._seen.append(line)
            if wanted(line):
                return line

    def terminate(self):
        """SIGTERM, and the exit code: negative where the signal ended it."""
        self._process.terminate()
        return self._ended()

    def kill(self):
        self._process.kill()
        self._ended()

    def output(self):
        while (line := self._lines.get(timeout=TIMEOUT)) is not None:
            self._seen.append(line)
        return "\n".join(self._seen)

    def _read(self):
        for line in self._process.stdout:
            self._lines.put(line.rstrip("\n"))
        self._lines.put(None)

    def _ended(self):
        code = self._process.wait(TIMEOUT)
        self._reader.join()
        self._process.stdout.close()
        return code


def cpp(client, *arguments):
    return [str(programs.clients / client), *arguments]


def python(client, *arguments):
    return [sys.executable, str(PYTHON_CLIENTS / f"{client}.py"), *arguments]


def shows(agent):
    """Whether a line of listen_mr_scan says that beams are replaced by this agent."""
    return lambda line: re.search(rf": [1-9]\d* of 720 beams replaced by .*\b{agent}\b", line)


def nothing_replaced(line):
    return ": 0 of 720 beams replaced" in line


class ClientsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        # As examples/README.md says.
        definitions = sorted(map(str, (ROOT / "protocols/lcm").glob("*.lcm")))
        subprocess.run(["lcm-gen", "--python", "--ppath", self.folder, *definitions], check=True)
        self.environment = dict(
            os.environ,
            LCM_DEFAULT_URL=f"udpm://239.255.76.67:{20000 + os.getpid() % 20000}?ttl=0",
            PYTHONPATH=str(self.folder),
            PYTHONDONTWRITEBYTECODE="1",
        )

    def start(self, command):
        process = Process(command, self.environment)
        self.addCleanup(process.kill)
        return process

    def run_client(self, command):
        return subprocess.run(command, env=self.environment, text=True, capture_output=True, timeout=TIMEOUT)

    def serve(self, session, *options):
        """A server that receives."""
        server = self.start([str(programs.parhelion), "serve", str(ROOT / "examples/clients/room.yaml"), "-o", session,
                             "--no-restart", "--state-folder", str(self.folder / "state"), *options])
        server.wait_for(lambda line: "serving" in line)
        return server

    def make_keys(self, name, *roles):
        """The path of a new sender's keys."""
        keys, server = self.folder / f"{name}.keys", self.folder / "server.keys"
        made = self.run_client([str(programs.parhelion), "key", "new", name, "--server", str(server), "-o", str(keys),
                                *(word for role in roles for word in ("--role", role))])
        self.assertEqual(made.returncode, 0, made.stderr)
        return str(keys)

    def place(self, command, expected_exit=0):
        ran = self.run_client(command)
        self.assertEqual(ran.returncode, expected_exit, ran.stdout + ran.stderr)
        return ran.stdout + ran.stderr

    def test_a_session_with_the_clients_of_both_languages(self):
        session = str(self.folder / "session.lcm")
        server = self.serve(session)
        listeners = [self.start(cpp("listen_mr_scan")), self.start(python("listen_mr_scan"))]

        robot = self.start(cpp("publish_scan"))
        for listener in listeners:
            listener.wait_for(nothing_replaced)
        self.place(python("place_agent", "box_1", "1.5", "0"))
        for listener in listeners:
            listener.wait_for(shows("box_1"))
        robot.terminate()

        robot = self.start(python("publish_scan"))
        self.place(cpp("place_agent", "box_2", "0", "1.5"))
        for listener in listeners:
            listener.wait_for(shows("box_2"))
        for client in [cpp, python]:
            self.assertIn("refused", self.place(client("place_agent", "box_2", "-2", "-2"), expected_exit=1))
        robot.terminate()

        self.assertEqual(server.terminate(), 0, server.output())
        self.check_log(session, robots=2)

    def test_a_session_with_authentication_obeys_clients_with_keys_and_no_others(self):
        robot_keys = self.make_keys("rover", "robot", "localization")
        instructor_keys = self.make_keys("bob", "instructor")
        server = self.serve(str(self.folder / "session.lcm"), "--keys", str(self.folder / "server.keys"))
        listener = self.start(cpp("listen_mr_scan"))
        for box, publisher, placer in [("box_1", cpp, python), ("box_2", python, cpp)]:
            self.environment["PARHELION_KEYS"] = robot_keys
            robot = self.start(publisher("publish_scan"))
            listener.wait_for(lambda line: "beams replaced" in line)
            # A robot may not place agents, and neither may a stranger.
            self.assertIn("no server answered", self.place(placer("place_agent", box, "1.5", "0"), expected_exit=1))
            del self.environment["PARHELION_KEYS"]
            self.assertIn("no server answered", self.place(placer("place_agent", box, "1.5", "0"), expected_exit=1))
            self.environment["PARHELION_KEYS"] = instructor_keys
            self.place(placer("place_agent", box, "1.5" if box == "box_1" else "0", "0" if box == "box_1" else "1.5"))
            listener.wait_for(shows(box))
            robot.terminate()
        code, output = server.terminate(), server.output()
        self.assertEqual(code, 0, output)
        self.assertIn("a message on MR_SPAWN was not signed", output)

    def check_log(self, session, robots):
        read = [self.run_client(client("read_session_log", session)) for client in (cpp, python)]
        for each in read:
            self.assertEqual(each.returncode, 0, each.stderr)
        self.assertEqual(read[0].stdout, read[1].stdout)
        text = read[0].stdout
        messages = {channel: int(count) for count, channel in re.findall(r"^ *(\d+)  (\S+)$", text, re.MULTILINE)}
        self.assertEqual(messages["MR_SESSION"], 1, text)
        self.assertGreater(messages["SCAN"], 0, text)
        self.assertEqual(messages["MR_SCAN"], messages["SCAN"], text)
        self.assertEqual(messages["MR_SCAN_INFO"], messages["SCAN"], text)
        # A robot may be ended after a pose and before its scan.
        self.assertIn(messages["POSE_COV"] - messages["SCAN"], range(robots + 1), text)
        self.assertRegex(text, r"\n[1-9]\d* of \d+ scans live, [1-9]\d* beams replaced\n$")

        # A third reader of the same log.
        validated = self.run_client([str(programs.parhelion), "validate", session])
        self.assertEqual(validated.returncode, 0, validated.stdout + validated.stderr)
        counted = re.findall(r"^  (\S+) +(\d+)  \w+$", validated.stdout, re.MULTILINE)
        self.assertEqual({channel: int(count) for channel, count in counted}, messages, validated.stdout)

    def test_without_a_server_an_agent_is_not_placed(self):
        for client in [cpp, python]:
            self.assertIn("no server answered", self.place(client("place_agent", "box_1", "1.5", "0"), expected_exit=1))

    def test_what_is_no_log_is_not_read(self):
        for client in [cpp, python]:
            ran = self.run_client(client("read_session_log", str(self.folder / "none.lcm")))
            self.assertEqual(ran.returncode, 1, ran.stdout + ran.stderr)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--parhelion", type=pathlib.Path, required=True)
    parser.add_argument("--clients", type=pathlib.Path, required=True, help="folder of the C++ clients")
    programs, rest = parser.parse_known_args()
    unittest.main(argv=sys.argv[:1] + rest)
