"""Frames that a stranger might send: every message the vessel accepts with the values that break programs, and damaged bytes.

Everything comes from one seeded generator, so a run can be repeated. Source of the kinds: firmware-reliability §B.8.
"""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable, Sequence
from typing import Any, Final

from mavlink_bridge.mavlink.commands.table import MEANINGS
from mavlink_bridge.mavlink.missions.plan_rules import NOTED
from mavlink_bridge.mavlink.wire.cmd import Cmd
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from mavlink_bridge.mavlink.wire.framing import checksum
from mavlink_bridge.mavlink.wire.signing import Signer, SigningState

FLOATS: Final = (
    *(0.0, -0.0, 1.0, -1.0, 2.0, 0.5, 21196.0, 1e-45, 1e-38, 1e10, -1e10, 1e38, -1e38, 3.4e38),
    *(math.nan, math.inf, -math.inf, 65_536.0, 2**31, 255.0, 90.0, 180.0, 359.9, 1500.0),
)
_BITS: Final = {"uint8_t": 8, "uint16_t": 16, "uint32_t": 32, "uint64_t": 64}
_SIGNED: Final = {"int8_t": 8, "int16_t": 16, "int32_t": 32, "int64_t": 64}
PLAN_COMMANDS: Final = (*(int(command) for command in Cmd), *sorted(NOTED), 22, 21, 0, 65_535)
COMMANDS: Final = (*sorted(MEANINGS), 512, 511, 520, 410, 400, 176, 300, 245, 246, 0, 65_535)
TERMINATE: Final = 185
LATITUDE, LONGITUDE = 411_850_123, -87_062_154


class FrameMaker:
    """Makes one frame after the other. ``messages``: names of the messages to build."""

    def __init__(self, seed: int, messages: Sequence[str], param_names: Sequence[str] = ()) -> None:
        self.rng = random.Random(seed)
        by_name = {message.msgname: message for message in dialect.mavlink_map.values()}
        self.messages = [by_name[name] for name in messages]
        self.may_terminate = False
        """Whether to send the command after which nothing works until restart."""
        self.params = [name.encode() for name in param_names] or [b"X"]
        senders = [(255, 190), (245, 190), (255, 230), (254, 1), (1, 1), (1, 191), (0, 0), (51, 68)]
        self._codecs = [Codec(*sender) for sender in senders]
        state = SigningState(b"\x42" * 32, 10**12)
        self._codecs.append(Codec(255, 190, signer=Signer(state, 7)))
        self._whole: tuple[Callable[[], bytes], ...] = (self.message,) * 12 + (self.transfer,) * 2 + (self.order,)
        self._damaged = (self.flipped, self.cut, self.stretched, self.old, self.unknown, self.noise, self.renamed)

    def next(self) -> bytes:
        """Bytes of one frame, whole three times out of four."""
        kind = self.rng.random()
        if kind < 0.75:
            return self.rng.choice(self._whole)()
        return self.rng.choice(self._damaged)()

    def message(self) -> bytes:
        """A whole frame of a known message with values from the edges."""
        message_class = self.rng.choice(self.messages)
        codec = self.rng.choice(self._codecs)
        values = [
            self._value(message_class, name, kind)
            for name, kind in zip(message_class.fieldnames, message_class.fieldtypes, strict=True)
        ]
        try:
            return codec.encode(message_class(*values))
        except (struct.error, OverflowError):
            return self.noise()

    def transfer(self) -> bytes:
        """A piece of a mission transfer that fits the one before often enough to get on."""
        rng, codec = self.rng, self._codecs[0]
        kind = rng.choice((0, 0, 0, 1, 2))
        number = rng.randrange(4)
        if rng.random() < 0.3:
            return codec.encode(dialect.MAVLink_mission_count_message(1, 1, rng.choice((1, 2, 3, 4)), kind))
        command = rng.choice((16, 17, 18, 19, 177, 178)) if kind == 0 else rng.choice((5001, 5003, 5100))
        position = (LATITUDE + rng.randrange(-9_999, 9_999), LONGITUDE + rng.randrange(-9_999, 9_999))
        item = dialect.MAVLink_mission_item_int_message(
            *(1, 1, number, rng.choice((0, 3)), command, 0, 1),
            *(rng.choice((0.0, 1.0, 5.0)), 0.0, rng.choice((0.0, 20.0, -20.0)), 0.0),
            *(*position, 0.0, kind),
        )
        return codec.encode(item)

    def order(self) -> bytes:
        """What an operator would send, so that the hostile frames meet an armed vessel under way too."""
        rng = self.rng
        codec = self._codecs[0]
        kind = rng.randrange(4)
        if kind == 0:
            return codec.encode(
                dialect.MAVLink_heartbeat_message(
                    type=6, autopilot=8, base_mode=0, custom_mode=0, system_status=4, mavlink_version=3
                )
            )
        if kind == 1:
            return codec.encode(
                dialect.MAVLink_manual_control_message(
                    target=1, x=rng.randrange(-1000, 1001), y=0, z=500, r=0, buttons=0
                )
            )
        command, first, second = rng.choice(
            ((400, 1.0, 21196.0), (400, 1.0, 0.0), (176, 1.0, 0.0), (176, 1.0, 10.0), (176, 1.0, 15.0), (300, 0.0, 0.0))
        )
        return codec.encode(
            dialect.MAVLink_command_long_message(
                target_system=1,
                target_component=1,
                command=command,
                confirmation=0,
                param1=first,
                param2=second,
                param3=0,
                param4=0,
                param5=0,
                param6=0,
                param7=0,
            )
        )

    def flipped(self) -> bytes:
        """A frame with some bits turned, its checksum mended half of the time."""
        raw = bytearray(self.message())
        for _ in range(self.rng.randrange(1, 6)):
            raw[self.rng.randrange(len(raw))] ^= 1 << self.rng.randrange(8)
        return self._mended(raw) if self.rng.random() < 0.5 else bytes(raw)

    def cut(self) -> bytes:
        raw = self.message()
        return raw[: self.rng.randrange(len(raw))]

    def stretched(self) -> bytes:
        """A payload longer than its message, with a right checksum."""
        message_class = self.rng.choice(self.messages)
        body = self.rng.randbytes(min(255, message_class.unpacker.size + self.rng.randrange(1, 60)))
        return self._codecs[0].seal(message_class.id, body)

    def old(self) -> bytes:
        """MAVLink 1 with random contents and a right checksum."""
        message_class = self.rng.choice([each for each in self.messages if each.id < 256] or self.messages[:1])
        body = self.rng.randbytes(self.rng.randrange(256))
        covered = bytes((len(body), self.rng.randrange(256), 255, 190, message_class.id & 0xFF)) + body
        return b"\xfe" + covered + checksum(covered, message_class.id & 0xFF).to_bytes(2, "little")

    def unknown(self) -> bytes:
        body = self.rng.randbytes(self.rng.randrange(40))
        return b"\xfd" + bytes((len(body), 0, 0, 1, 255, 190)) + self.rng.randbytes(3) + body + self.rng.randbytes(2)

    def noise(self) -> bytes:
        return self.rng.randbytes(self.rng.randrange(1, 300))

    def renamed(self) -> bytes:
        """A payload of one message under the id of another."""
        first, second = self.rng.choice(self.messages), self.rng.choice(self.messages)
        return self._codecs[0].seal(first.id, self.rng.randbytes(min(255, second.unpacker.size)))

    def _mended(self, raw: bytearray) -> bytes:
        message_id = int.from_bytes(raw[7:10], "little")
        end = 10 + raw[1]
        if message_id in dialect.mavlink_map and end + 2 <= len(raw):
            raw[end : end + 2] = checksum(bytes(raw[1:end]), message_id).to_bytes(2, "little")
        return bytes(raw)

    def _value(self, message_class: Any, name: str, kind: str) -> Any:
        length = message_class.array_lengths[message_class.ordered_fieldnames.index(name)]
        if kind == "char":
            return self._text(name, length)
        if length:
            return [self._number(name, kind) for _ in range(length)]
        return self._number(name, kind)

    def _text(self, name: str, length: int) -> bytes:
        rng = self.rng
        if name == "param_id" and rng.random() < 0.8:
            return rng.choice(self.params)[:length]
        return rng.choice((b"", b"\xff" * length, rng.randbytes(length), b"../../etc/passwd"[:length], b"A" * length))

    def _number(self, name: str, kind: str) -> float | int:
        rng = self.rng
        if kind in ("float", "double"):
            return rng.choice(FLOATS) if rng.random() < 0.7 else rng.uniform(-400.0, 400.0)
        if name in ("target_system", "target") and rng.random() < 0.9:
            return rng.choice((0, 1))
        if name == "target_component" and rng.random() < 0.9:
            return rng.choice((0, 1))
        if name == "mission_type" and rng.random() < 0.9:
            return rng.choice((0, 1, 2, 255))
        if name == "command" and rng.random() < 0.9:
            command = rng.choice(COMMANDS + PLAN_COMMANDS)
            return command if command != TERMINATE or self.may_terminate else 0
        if name in ("x", "lat_int", "y", "lon_int") and kind == "int32_t" and rng.random() < 0.5:
            return (LATITUDE if name in ("x", "lat_int") else LONGITUDE) + rng.randrange(-50_000, 50_000)
        return self._edge(kind)

    def _edge(self, kind: str) -> int:
        rng = self.rng
        if kind in _BITS:
            top = (1 << _BITS[kind]) - 1
            return rng.choice((0, 1, 2, 3, 4, top, top - 1, top >> 1, rng.randrange(top + 1), rng.randrange(16)))
        half = 1 << (_SIGNED[kind] - 1)
        return rng.choice((0, 1, -1, half - 1, -half, rng.randrange(-half, half), rng.randrange(-8, 9)))
