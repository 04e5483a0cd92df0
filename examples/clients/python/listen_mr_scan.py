#!/usr/bin/env python3
"""Prints one line for each MR_SCAN: how many beams hit a virtual agent, and the nearest of these returns.

    listen_mr_scan.py      until it is stopped with ^C

MR_SCAN is SCAN with the virtual agents in it: the same beams with the same utime. The MR_SCAN_INFO with that utime
follows it and gives for each beam the agent that it hits.
"""
import math

from lcm_udp import Lcm
from parhelion import planar_lidar_t, scan_info_t


def text_of(scan, info):
    if not info.live:
        # The pose is too uncertain for injection: MR_SCAN equals SCAN.
        return f"{scan.utime}: unchanged: {info.reason}"
    virtual = [i for i, agent in enumerate(info.beam_agent) if agent >= 0]
    text = f"{scan.utime}: {len(virtual)} of {scan.nranges} beams replaced"
    if virtual:
        nearest = min(virtual, key=lambda i: scan.ranges[i])
        # Counter-clockwise from the laser's own x axis, which need not be the robot's.
        angle = math.degrees(scan.rad0 + nearest * scan.radstep)
        text += f" by {', '.join(info.agents)}, nearest {scan.ranges[nearest]:.2f} m at {angle:.0f} deg"
    return text


def main():
    lcm = Lcm(["MR_SCAN", "MR_SCAN_INFO"])
    scan = planar_lidar_t()
    while True:
        channel, payload = lcm.receive()
        if channel == "MR_SCAN":
            scan = planar_lidar_t.decode(payload)
            continue
        info = scan_info_t.decode(payload)
        if info.utime == scan.utime:  # else one of the two was lost
            print(text_of(scan, info), flush=True)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
