"""One LoRa module: its serial port, its pins, its settings and its configuration protocol; the air is ``radio.py``.

The protocol is that of the LoRa611PRO and its sisters: AA FA and an instruction, no checksum. Facts and doubts: docs/LORA.md.
Bytes come and go at the serial rate; packets are cut by length and by an idle gap, so what one end writes is not what the other reads.
"""

from __future__ import annotations

import random
from collections import deque
from itertools import islice
from typing import Final

from mavlink_bridge.radio.air.airtime import PACKET_BYTES
from mavlink_bridge.radio.air.module_fields import changed

COMMAND: Final = b"\xaa\xfa"
_READ, _RESET, _WRITE, _MODEL = 0x01, 0x02, 0x03, 0xAA
CONFIG_BAUD: Final = 9600
_BAUDS: Final = (1200, 2400, 4800, 9600, 14400, 19200, 38400, 57600, 76800, 115200)

FACTORY_BLOCK: Final = (
    bytes((20, 3, 0, 7, 3, 2, 1, 1)) + b"\x11\x11\x11\x11" + b"\xbb\xbb" + bytes((0, 0, 0)) + bytes(16)
)
"""33 bytes: channel, band, air rate, power, serial rate, data bits, stop bits, parity, NET ID, NODE ID, mesh, role, encryption, key."""


LINE: Final = slice(4, 8)
"""Serial rate, data bits, stop bits and parity in the block."""
PARITY_NAMES: Final = {"N": "none", "O": "odd", "E": "even"}


def set_up(block: bytes, words: str) -> bytes:
    """The block with settings changed, NAME=VALUE each. Raises ModuleError."""
    for word in words.split():
        name, _, value = word.partition("=")
        block = changed(block, "key_file" if name == "key" else name, value, _hexadecimal)
    return block


def _hexadecimal(text: str) -> bytes:
    try:
        return bytes.fromhex(text)
    except ValueError:
        return b""


class RadioModule:
    """The half of a module that a host sees. ``air`` code takes packets out and puts received ones in."""

    def __init__(
        self, name: str, rng: random.Random, *, gap_us: int, buffer_bytes: int, split: bool, model: str
    ) -> None:
        self.name = name
        self.model = model
        self.block = FACTORY_BLOCK
        self.set_low = False
        """True: configuration mode."""
        self.cs_low = False
        """True: asleep."""
        self.host_line: bytes | None = None
        """How the host's port is set, as the block's bytes 4 to 7 say it; None: there is no serial line that could differ."""
        self.busy_until_us = 0
        """End of what is being transmitted."""
        self.overflow_bytes = 0
        self._rng = rng
        self._gap_us = gap_us
        self._buffer_bytes = buffer_bytes
        self._split = split
        self.for_air: deque[int] = deque()
        """Bytes from the host that are not on the air yet."""
        self._for_air_us: deque[int] = deque()
        self.for_host: deque[int] = deque()
        """Bytes on the serial line to the host."""
        self._for_host_us: deque[int] = deque()
        self._trigger_us: int | None = None
        """What makes the waiting bytes a packet, when it is known: they have not changed since."""
        self._command = bytearray()
        self._command_us = 0

    @property
    def byte_us(self) -> int:
        """Time of one byte, 10 bits, on the serial line."""
        index = self.block[4]
        baud = CONFIG_BAUD if self.set_low else _BAUDS[index if index < len(_BAUDS) else 3]
        return 10_000_000 // baud

    @property
    def is_busy(self) -> bool:
        """Whether bytes wait on either side."""
        return bool(self.for_air or self.for_host)

    def hears(self, other: RadioModule) -> bool:
        """Same channel, band, air rate, NET ID and key, another NODE ID, both in work mode."""
        same = self.block[0:3] == other.block[0:3] and self.block[8:12] == other.block[8:12]
        same = same and self._cipher == other._cipher
        return same and self.block[12:14] != other.block[12:14] and not (self.set_low or self.cs_low)

    def attach(self, host_line: bytes, words: str) -> None:
        """Hang it on a host whose port is set so; the module is too, but for what ``words`` say (``set_up``)."""
        self.host_line = host_line
        self.block = set_up(self.block[: LINE.start] + host_line + self.block[LINE.stop :], words)

    @property
    def _cipher(self) -> bytes:
        """The key that is in use; empty: none."""
        return self.block[17:33] if self.block[16] else b""

    def _on_line(self, data: bytes) -> bytes:
        """What the other side of the serial line reads: other bytes where the two are set differently."""
        if self.set_low or self.host_line in (None, self.block[LINE]):
            return data
        return bytes(byte ^ self._rng.randrange(1, 256) for byte in data)

    def from_host(self, data: bytes, now_us: int) -> None:
        """The host writes. What does not fit the buffer is lost, as there is no flow control."""
        if self.cs_low:
            return
        if self.set_low:
            self._configure(data, now_us)
            return
        fits = self._on_line(data)[: max(self._buffer_bytes - len(self.for_air), 0)]
        self.overflow_bytes += len(data) - len(fits)
        self.for_air.extend(fits)
        self._put(self._for_air_us, now_us, len(fits))
        self._trigger_us = None

    def to_host(self, data: bytes, at_us: int) -> None:
        """Put bytes on the serial line to the host, the first one complete a byte time after ``at_us``."""
        self.for_host.extend(self._on_line(data))
        self._put(self._for_host_us, at_us, len(data))

    def _put(self, times_us: deque[int], at_us: int, count: int) -> None:
        """Each byte is complete a byte time after the one before it."""
        byte_us = self.byte_us
        if times_us and times_us[-1] > at_us:
            at_us = times_us[-1]
        times_us.extend(range(at_us + byte_us, at_us + byte_us * count + 1, byte_us))

    def read(self, now_us: int) -> bytes:
        """What has come out of the serial line by now; with ``split`` a random part of it, the rest at the next read."""
        if not self._for_host_us or self._for_host_us[0] > now_us:
            return b""
        count = _count(self._for_host_us, now_us)
        if count > 1 and self._split:
            count = self._rng.randint(1, count)
        return _take(self.for_host, self._for_host_us, count)

    def next_start_us(self) -> int | None:
        """When the next packet goes on the air, None when nothing waits."""
        if not self._for_air_us or self.set_low or self.cs_low:
            return None
        if self._trigger_us is None:
            self._trigger_us = self._trigger(self._for_air_us)
        return max(self._trigger_us, self.busy_until_us)

    def _trigger(self, times: deque[int]) -> int:
        previous_us = times[0]
        for count, at_us in enumerate(islice(times, PACKET_BYTES), 1):
            if at_us - previous_us > self._gap_us:
                break
            previous_us = at_us
            if count == PACKET_BYTES:
                return at_us
        return previous_us + self._gap_us

    def take_packet(self, start_us: int) -> bytes:
        """Remove the bytes that go out in the packet that starts now."""
        self._trigger_us = None
        count = min(_count(self._for_air_us, start_us), PACKET_BYTES)
        return _take(self.for_air, self._for_air_us, count)

    # ---- configuration mode -------------------------------------------------------------------------------------

    def _configure(self, data: bytes, now_us: int) -> None:
        if now_us - self._command_us > 200_000:
            self._command.clear()
        self._command_us = now_us
        self._command += data
        while (reply := self._answer()) is not None:
            if reply:
                self.to_host(reply + b"\r\n", now_us)

    def _answer(self) -> bytes | None:
        """Consume one command; its answer, empty for noise, None when more bytes must come."""
        command = self._command
        start = command.find(COMMAND)
        if start < 0:
            del command[: max(len(command) - 1, 0)]
            return None
        del command[:start]
        if len(command) < 3:
            return None
        instruction = command[2]
        if instruction == _WRITE:
            return self._write_block()
        del command[:3]
        if instruction == _MODEL:
            return self.model.encode()
        if instruction == _READ:
            return self.block
        if instruction == _RESET:
            self.block = FACTORY_BLOCK + self.block[len(FACTORY_BLOCK) :]
            return b"OK"
        return b"ERROR"

    def _write_block(self) -> bytes | None:
        length = len(self.block)
        if len(self._command) < 3 + length:
            return None
        block = bytes(self._command[3 : 3 + length])
        del self._command[: 3 + length]
        if block[3] > 7 or block[4] >= len(_BAUDS):
            return b"ERROR"
        self.block = block
        return b"OK"


def _count(times_us: deque[int], until_us: int) -> int:
    """How many of these times, which rise, have come."""
    if not times_us or times_us[-1] <= until_us:
        return len(times_us)
    return sum(1 for at_us in times_us if at_us <= until_us)


def _take(values: deque[int], times_us: deque[int], count: int) -> bytes:
    """Remove the first bytes with their times."""
    if count == len(values):
        taken = bytes(values)
        values.clear()
        times_us.clear()
        return taken
    for _ in range(count):
        times_us.popleft()
    return bytes([values.popleft() for _ in range(count)])
