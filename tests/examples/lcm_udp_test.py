#!/usr/bin/env python3
"""examples/clients/python/lcm_udp.py against liblcm: what one sends, the other must receive, whatever its size."""
import os
import pathlib
import random
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples/clients/python"))
import lcm_udp  # noqa: E402

URL = f"udpm://239.255.76.67:{20000 + os.getpid() % 20000}?ttl=0"
TIMEOUT = 60  # s
# Around the largest short message, around one and two whole fragments, and a picture.
SHORT_MAX, FRAGMENT_MAX = 65499 - len("CAMERA\0"), 65487 - len("CAMERA\0")
SIZES = [0, 1, SHORT_MAX, SHORT_MAX + 1, FRAGMENT_MAX, 2 * FRAGMENT_MAX, 2 * FRAGMENT_MAX + 9, 150_000]


def payload_of(size):
    return random.Random(size).randbytes(size)


def read_whole_events(path):
    """The events of a log that is still being written."""
    try:
        for event in lcm_udp.read_log(path):
            yield event
    except (FileNotFoundError, ValueError):
        pass


class LcmUdpTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.log = pathlib.Path(folder.name) / "events.lcm"

    def start(self, *command):
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)

    def open(self, channels=()):
        lcm = lcm_udp.Lcm(channels, url=URL)
        self.addCleanup(lcm.close)
        return lcm

    def write_log(self, events):
        with open(self.log, "wb") as log:
            for number, (channel, payload) in enumerate(events):
                log.write(struct.pack(">IqqII", 0xEDA1DA01, number, 1_000_000, len(channel), len(payload)))
                log.write(channel.encode() + payload)

    def test_liblcm_receives_what_we_publish(self):
        self.start("lcm-logger", "--quiet", f"--lcm-url={URL}", "--channel=CAMERA", "--flush-interval=1", self.log)
        lcm = self.open()
        deadline = time.monotonic() + TIMEOUT
        for size in SIZES:
            wanted = payload_of(size)
            while not any(event.payload == wanted for event in read_whole_events(self.log)):
                self.assertLess(time.monotonic(), deadline, f"{size} bytes were not received")
                lcm.publish("CAMERA", wanted)
                time.sleep(0.02)  # between two attempts: UDP may lose one

    def test_we_receive_what_liblcm_publishes(self):
        lcm = self.open(["CAM.*"])
        for size in SIZES:
            self.write_log([("OTHER", b"not wanted"), ("CAMERA", payload_of(size))])
            received = None
            deadline = time.monotonic() + TIMEOUT
            while received is None and time.monotonic() < deadline:
                subprocess.run(["lcm-logplayer", f"--lcm-url={URL}", self.log], check=True, capture_output=True)
                received = lcm.receive(timeout=0.2)
            self.assertEqual(received, ("CAMERA", payload_of(size)), f"{size} bytes")
            while lcm.receive(timeout=0) is not None:
                pass

    def test_datagrams_of_a_stranger_end_nothing_and_take_no_memory(self):
        lcm = self.open(["CAM.*"])
        stranger = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(stranger.close)
        group = ("239.255.76.67", int(URL.split(":")[2].split("?")[0]))

        def fragment(number, size, offset, index, count, part):
            return struct.pack(">4sIIIHH", b"LC03", number, size, offset, index, count) + part

        for datagram in [
            b"", b"LC02", b"LC03" * 6, b"LC02" + b"\0" * 4 + b"CAM\xff\0x",
            fragment(1, 4_000_000_000, 0, 0, 2, b"CAM\0x"), fragment(2, 60_000, 0, 0, 1, b"CAM\0" + b"x" * 8),
            fragment(3, 10, 4_294_967_290, 1, 2, b"x" * 8), fragment(4, 4, 0, 0, 0, b"CAM\0abcd"),
            fragment(5, 8, 0, 0, 2, b"CAM\0abcd"), fragment(5, 8, 2, 1, 2, b"efgh"),
        ]:
            stranger.sendto(datagram, group)
        stranger.sendto(b"LC02" + b"\0" * 4 + b"CAM_END\0y", group)
        received = []
        while not received or received[-1][0] != "CAM_END":
            received.append(lcm.receive(timeout=5))
            self.assertIsNotNone(received[-1])
        self.assertEqual([payload for _, payload in received], [b"x", b"y"])

    def test_a_log_that_ends_within_an_event_is_refused(self):
        self.write_log([("SCAN", b"1234"), ("SCAN", b"5678")])
        whole = self.log.read_bytes()
        self.assertEqual([event.payload for event in lcm_udp.read_log(self.log)], [b"1234", b"5678"])
        self.assertEqual([event.number for event in lcm_udp.read_log(self.log)], [0, 1])
        for size in [len(whole) - 1, len(whole) - 6, len(whole) - 30]:
            self.log.write_bytes(whole[:size])
            with self.assertRaises(ValueError):
                list(lcm_udp.read_log(self.log))
        self.log.write_bytes(b"no log " * 10)
        with self.assertRaises(ValueError):
            list(lcm_udp.read_log(self.log))


if __name__ == "__main__":
    unittest.main()
