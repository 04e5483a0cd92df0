"""Signs messages for a server with authentication (docs/security.md). Needs libsodium."""
import ctypes
import ctypes.util
import re
import struct
import time
from base64 import b64decode
from hashlib import blake2b
from os import urandom

_sodium = ctypes.CDLL(ctypes.util.find_library("sodium") or "libsodium.so.23")
_sodium.sodium_init()


def _authenticate(message, nonce, key):
    """The tag of XChaCha20-Poly1305 for a message that is not encrypted."""
    tag = ctypes.create_string_buffer(16)
    _sodium.crypto_aead_xchacha20poly1305_ietf_encrypt_detached(
        ctypes.create_string_buffer(1), tag, None, None, ctypes.c_ulonglong(0),
        message, ctypes.c_ulonglong(len(message)), None, nonce, key)
    return tag.raw


class Signer:
    """The sender of a file that `parhelion key new` wrote. One for each run of a program."""

    def __init__(self, keys):
        with open(keys, encoding="utf-8") as file:
            own = dict(re.findall(r'^(name|secret): "?([^"\n]+)"?$', file.read(), re.MULTILINE))
        self._secret = b64decode(own["secret"])
        # BLAKE2b-128, of which the first 8 bytes are sent.
        self._sender = blake2b(own["name"].encode(), digest_size=16).digest()[:8]
        self._run = urandom(16)
        self._counter = 0

    def sign(self, channel, payload):
        """`payload` with the trailer of its signature."""
        self._counter += 1
        nonce = self._run + struct.pack(">Q", self._counter)
        signed = payload + self._sender + nonce + struct.pack(">q", int(time.time() * 1e6))
        key = blake2b(channel.encode(), digest_size=32, key=self._secret).digest()
        return signed + _authenticate(signed, nonce, key) + b"PHS1"
