#!/usr/bin/env python3
"""Publishes the data that a robot sends to the server: its pose (POSE_COV) and the scans of its laser (SCAN).

    publish_scan.py        until it is stopped with ^C

The robot is at rest in the middle of a square room. For a real robot, replace the generated pose and ranges by those
of your localization and laser driver. A robot that moves also publishes its wheel odometry on
ODOMETRY (pose2D_t), 20 times a second or more.
"""
import math
import time

from lcm_udp import Lcm
from parhelion import planar_lidar_t, pose_cov_t

# The laser of examples/robot/turtlebot4_lite.yaml, in the order of its driver: counter-clockwise.
BEAMS = 720
ANGLE_MIN = math.radians(-179)  # rad, of the first beam of a message
ANGLE_INCREMENT = math.radians(359 / (BEAMS - 1))
SCAN_PERIOD = 0.13  # s

WALL_DISTANCE = 3  # m, from the laser to each of the four walls


def localize(utime):
    """`utime` is the instant for which the pose holds. A localization uses the stamp of the scan that it matched."""
    pose = pose_cov_t()
    pose.utime = utime
    pose.pos = [0, 0, 0]
    pose.orientation = [1, 0, 0, 0]  # w, x, y, z: at the map's origin, facing along its x axis
    for i in range(3):
        pose.covariance[7 * i] = 1e-4  # m^2: 1 cm
    for i in range(3, 6):
        pose.covariance[7 * i] = 1e-6  # rad^2: 1 mrad
    pose.map_id = ""  # id of the map as in the model's file; any without a model
    pose.state = 1  # tracking
    pose.causal = True  # computed from nothing newer than utime
    return pose


def measure(utime):
    """`utime` is the instant of one beam: the first, the middle or the last, according to `stamp_beam` in the robot
    description. Its `beam_interval` says which end of a message is measured first."""
    scan = planar_lidar_t()
    scan.utime = utime
    scan.rad0 = ANGLE_MIN
    scan.radstep = ANGLE_INCREMENT
    for i in range(BEAMS):
        angle = ANGLE_MIN + i * ANGLE_INCREMENT
        scan.ranges.append(WALL_DISTANCE / max(abs(math.cos(angle)), abs(math.sin(angle))))
    scan.nranges = len(scan.ranges)
    return scan


def main():
    lcm = Lcm()
    due = time.monotonic()
    while True:
        now = int(time.time() * 1e6)
        lcm.publish("POSE_COV", localize(now).encode())
        lcm.publish("SCAN", measure(now).encode())
        due += SCAN_PERIOD
        time.sleep(max(0, due - time.monotonic()))


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
