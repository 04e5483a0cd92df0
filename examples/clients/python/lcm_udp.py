"""LCM over UDP multicast, and LCM event logs, with nothing but the standard library.

Debian has no LCM package for Python. This module speaks the same bytes as liblcm (its file lcm_udpm.c):

    short message   "LC02", uint32 number, channel, 0, payload
    fragment        "LC03", uint32 number, uint32 payload size, uint32 offset of this part,
                    uint16 index, uint16 count; then in fragment 0 channel, 0; then this part of the payload

All numbers are big-endian. Payloads are encoded and decoded by the classes that `lcm-gen --python` makes.
"""
import collections
import os
import re
import socket
import struct
import time
from urllib.parse import parse_qs, urlparse

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"  # ttl=0: this machine only

_SHORT = struct.Struct(">4sI")
_FRAGMENT = struct.Struct(">4sIIIHH")
_SHORT_MAX = 65499  # bytes of channel, 0 and payload in a short message
_FRAGMENT_MAX = 65487  # the same in a fragment
_UNFINISHED_MAX = 16  # messages of which fragments are kept; the oldest goes first
_RECEIVE_BUFFER = 4 << 20  # bytes that are asked of the kernel, which gives net.core.rmem_max at most

_EVENT = struct.Struct(">IqqII")
_EVENT_SYNC = 0xEDA1DA01

Event = collections.namedtuple("Event", "number timestamp channel payload")  # timestamp: us since the epoch


class Lcm:
    """Publishes on, and receives from, one multicast group."""

    def __init__(self, channels=(), url=None):
        """`channels`: which to receive, each a name or a regular expression.

        `url`: by default the environment's LCM_DEFAULT_URL, else DEFAULT_URL.
        """
        parts = urlparse(url or os.environ.get("LCM_DEFAULT_URL") or DEFAULT_URL)
        if parts.scheme != "udpm" or not parts.hostname or not parts.port:
            raise ValueError(f"{parts.geturl()}: expected udpm://GROUP:PORT?ttl=N")
        ttl = int(parse_qs(parts.query).get("ttl", ["0"])[0])
        self._group = (parts.hostname, parts.port)
        self._wanted = [re.compile(channel) for channel in channels]
        self._number = 0
        self._unfinished = collections.OrderedDict()  # (sender, number): _Parts

        self._sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, ttl)
        self._receiver = self._open_receiver() if self._wanted else None

    def publish(self, channel, payload):
        """Sends `payload`, the bytes that encode() of a message gives."""
        body = channel.encode() + b"\0" + payload
        if len(body) <= _SHORT_MAX:
            self._sender.sendto(_SHORT.pack(b"LC02", self._number) + body, self._group)
        else:
            self._send_fragments(body, len(payload))
        self._number = (self._number + 1) & 0xFFFFFFFF

    def receive(self, timeout=None):
        """Waits for the next message on the wanted channels: (channel, payload), or None after `timeout` s."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            self._receiver.settimeout(None if deadline is None else max(0, deadline - time.monotonic()))
            try:
                datagram, sender = self._receiver.recvfrom(65536)
            except (TimeoutError, BlockingIOError):
                return None
            message = self._message(datagram, sender)
            if message and any(wanted.fullmatch(message[0]) for wanted in self._wanted):
                return message

    def close(self):
        self._sender.close()
        if self._receiver:
            self._receiver.close()

    def _open_receiver(self):
        receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
        receiver.bind(self._group)
        membership = struct.pack("=4sI", socket.inet_aton(self._group[0]), socket.INADDR_ANY)
        receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        return receiver

    def _send_fragments(self, body, payload_size):
        count = (len(body) + _FRAGMENT_MAX - 1) // _FRAGMENT_MAX
        head = len(body) - payload_size  # channel and 0, which only fragment 0 has
        for index in range(count):
            start = index * _FRAGMENT_MAX
            offset = max(0, start - head)
            header = _FRAGMENT.pack(b"LC03", self._number, payload_size, offset, index, count)
            self._sender.sendto(header + body[start : start + _FRAGMENT_MAX], self._group)

    def _message(self, datagram, sender):
        """What is complete with this datagram: (channel, payload), or None."""
        if datagram[:4] == b"LC02":
            channel, found, payload = datagram[_SHORT.size :].partition(b"\0")
            return (channel.decode(), payload) if found else None
        if datagram[:4] == b"LC03" and len(datagram) > _FRAGMENT.size:
            return self._add_fragment(datagram, sender)
        return None

    def _add_fragment(self, datagram, sender):
        _, number, size, offset, index, count = _FRAGMENT.unpack_from(datagram)
        part = datagram[_FRAGMENT.size :]
        message = self._unfinished.setdefault((sender, number), _Parts(size))
        if index == 0:
            channel, _, part = part.partition(b"\0")
            message.channel = channel.decode()
        message.payload[offset : offset + len(part)] = part
        message.indices.add(index)
        if len(message.indices) < count:
            if len(self._unfinished) > _UNFINISHED_MAX:
                self._unfinished.popitem(last=False)
            return None
        del self._unfinished[(sender, number)]
        return message.channel, bytes(message.payload)


class _Parts:
    """The fragments of one message that have come so far."""

    def __init__(self, size):
        self.channel = ""
        self.payload = bytearray(size)
        self.indices = set()


def read_log(path):
    """Yields the events of an LCM log, each an Event."""
    with open(path, "rb") as log:
        while header := log.read(_EVENT.size):
            if len(header) < _EVENT.size:
                raise ValueError(f"{path}: ends within an event")
            sync, number, timestamp, channel_size, payload_size = _EVENT.unpack(header)
            if sync != _EVENT_SYNC:
                raise ValueError(f"{path}: byte {log.tell() - _EVENT.size}: no event begins here")
            channel = log.read(channel_size).decode()
            payload = log.read(payload_size)
            if len(payload) < payload_size:
                raise ValueError(f"{path}: ends within an event")
            yield Event(number, timestamp, channel, payload)
