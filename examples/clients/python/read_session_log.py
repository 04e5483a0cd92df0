#!/usr/bin/env python3
"""Reads a session log: what ran, how long, how many messages on each channel, how many beams were replaced.

    read_session_log.py SESSION.lcm

A session log is an LCM event log. The timestamp of an event is the server's: the arrival of an input, or the simulation
time of an output. The utime inside a message is the sender's, and often earlier.
"""
import collections
import sys

from lcm_udp import read_log
from parhelion import scan_info_t, session_t


def main():
    if len(sys.argv) != 2:
        print("usage: read_session_log.py SESSION.lcm", file=sys.stderr)
        return 2
    version = ""
    times = []  # us, of all events
    messages = collections.Counter()  # by channel
    live_scans = beams_replaced = 0
    for event in read_log(sys.argv[1]):
        times.append(event.timestamp)
        messages[event.channel] += 1
        if event.channel == "MR_SESSION":  # the first event
            version = session_t.decode(event.payload).version
        if event.channel == "MR_SCAN_INFO":
            info = scan_info_t.decode(event.payload)
            live_scans += info.live
            beams_replaced += sum(agent >= 0 for agent in info.beam_agent)

    print(f"session of {version}, {(times[-1] - times[0]) * 1e-6 if times else 0:.3f} s")
    for channel, count in sorted(messages.items()):
        print(f"{count:8d}  {channel}")
    print(f"{live_scans} of {messages['MR_SCAN_INFO']} scans live, {beams_replaced} beams replaced")
    return 0


if __name__ == "__main__":
    sys.exit(main())
