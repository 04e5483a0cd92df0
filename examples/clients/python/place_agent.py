#!/usr/bin/env python3
"""Places a virtual box in front of a robot, and prints the server's reply.

    place_agent.py NAME X Y      m, in the map

The server replies on MR_EVENTS. It refuses a place on the robot or inside its stopping distance, and a name that is
taken; the reply gives the reason, and where there is room.
"""
import random
import sys
import time

from lcm_udp import Lcm
from parhelion import agent_spawn_t, event_t

# event_t.kind
COMMAND_ACCEPTED = 0
COMMAND_REFUSED = 1

ANSWER_TIMEOUT = 2  # s


def spawn_box(name, x, y):
    """`utime` is when the command was sent, on this machine's clock. `request` is any number: the reply carries it."""
    command = agent_spawn_t()
    command.utime = int(time.time() * 1e6)
    command.request = random.getrandbits(62)
    command.name = name
    command.kind = 0  # box
    command.x = x
    command.y = y
    command.size = [0.4, 0.4, 0.6]
    command.behaviour.kind = 0  # stay
    return command


def wait_for_answer(lcm, request):
    """The event that replies to `request`, or None where none arrives in time."""
    deadline = time.monotonic() + ANSWER_TIMEOUT
    while message := lcm.receive(deadline - time.monotonic()):
        event = event_t.decode(message[1])
        if event.request == request and event.kind in (COMMAND_ACCEPTED, COMMAND_REFUSED):
            return event
    return None


def main():
    if len(sys.argv) != 4:
        print("usage: place_agent.py NAME X Y", file=sys.stderr)
        return 2
    lcm = Lcm(["MR_EVENTS"])
    command = spawn_box(sys.argv[1], float(sys.argv[2]), float(sys.argv[3]))
    lcm.publish("MR_SPAWN", command.encode())
    answer = wait_for_answer(lcm, command.request)
    if answer is None:
        print("place_agent: no server answered; is `parhelion serve` running?", file=sys.stderr)
        return 1
    if answer.kind == COMMAND_REFUSED:
        print(f"place_agent: refused: {answer.text}", file=sys.stderr)
        return 1
    print(f"{command.name} is placed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
