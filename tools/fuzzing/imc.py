"""Hostile IMC packets against the whole bridge: its node, its parts and its MAVLink side, with the promises checked as it goes.

Promises: nothing raises; what is sent is whole IMC packets and whole MAVLink frames; no message that was not asked for goes to the
vehicle while every packet is a stranger's (read-only), and memory grows by less than 5 MB. A million packets take some minutes.
"""

from __future__ import annotations

import gc
import random
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from companion.imc.desk import Desk, DeskConfig
from companion.imc.logbook import LogBook
from companion.imc.picture import ImcPicture
from companion.imc.state_out import StateOut
from mavlink_bridge import imc
from mavlink_bridge.crc import arc
from mavlink_bridge.imc import Node, NodeConfig, Place, Tcp, Udp
from mavlink_bridge.mavlink.client import VehicleClient
from mavlink_bridge.mavlink.wire.framing import Deframer

CAPTURED: Final = Path(__file__).resolve().parents[2] / "tests" / "data" / "imc" / "captured.txt"
BOAT: Final = 0x2877
GROWTH_LIMIT_KB: Final = 5_000
WARM: Final = 20_000
"""Packets after which memory is measured for the first time."""
_HEADER: Final = struct.Struct("<HHHdHBHB")
_STEP_US: Final = 5_000


@dataclass(slots=True)
class Outcome:
    """What a run found."""

    packets: int = 0
    understood: int = 0
    answered: int = 0
    to_vehicle: int = 0
    growth_kb: int = 0
    broken: list[str] = field(default_factory=list)


class Target:
    """The bridge without its sockets."""

    def __init__(self, *, read_only: bool) -> None:
        self.node = Node(NodeConfig(BOAT, "boat", uid=1))
        self.node.utc_ahead_us = 1_790_000_000_000_000
        self.client = VehicleClient()
        picture, book = ImcPicture(), LogBook(self.node.utc_s)
        self.desk = Desk(DeskConfig(read_only=read_only), self.client, utc_s=self.node.utc_s)
        state = StateOut(
            picture, self.desk.view, self.node.utc_s, skews=self.node.skews, rudder_full_rad=0.5, state_hz=2.0
        )
        for part in (self.desk, book, state):
            self.node.add(part)
        self.frames = Deframer()
        self.open: list[Tcp] = []

    def play(self, data: bytes, source: Place, now_us: int) -> tuple[int, int]:
        """One piece of bytes; how many packets were answered, and how many frames went to the vehicle. Raises for a fault."""
        self.node.receive(data, source, now_us)
        sent = self.node.take(now_us)
        for _, packet in sent:
            imc.decode(packet)
        out = self.client.take(now_us)
        frames = self.frames.receive(out, now_us)
        assert self.frames.counters.skipped_bytes == 0, "half a frame for the vehicle"
        self.node.drain_texts()
        self.desk.drain_texts()
        return len(sent), len(frames)


class PacketMaker:
    """Packets of the real programs, bent: fields, lengths, ids, times, byte order, pieces, and plain noise."""

    def __init__(self, seed: int) -> None:
        self._chance = random.Random(seed)
        lines = CAPTURED.read_text(encoding="utf-8").splitlines()[1:]
        self._real = [bytes.fromhex(line.rpartition(": ")[2]) for line in lines]

    def piece(self) -> bytes:
        """The next bytes that a stranger sends."""
        chance = self._chance
        kind = chance.random()
        if kind < 0.05:
            return chance.randbytes(chance.choice((1, 20, 60, 2000)))
        if kind < 0.1:
            return bytes.fromhex(chance.choice(("54fe", "fe54"))) * chance.randrange(1, 400)
        packet = self._sealed(self._bent(bytearray(chance.choice(self._real))))
        if kind < 0.2:
            return packet[: chance.randrange(len(packet))]
        return packet + self._sealed(bytearray(chance.choice(self._real))) if kind < 0.3 else packet

    def _bent(self, packet: bytearray) -> bytearray:
        chance = self._chance
        for _ in range(chance.choice((0, 0, 1, 1, 2, 5))):
            place = chance.randrange(20, max(21, len(packet) - 2))
            choice = chance.randrange(4)
            if choice == 0 and place < len(packet) - 2:
                packet[place] = chance.randrange(256)
            elif choice == 1:
                packet[place : place + 2] = chance.choice((b"\xff\xff", b"\x00\x00", b"\x01\x00", b"\x00\x80"))
            elif choice == 2:
                del packet[place : place + chance.randrange(1, 9)]
            else:
                packet[place:place] = chance.randbytes(chance.randrange(1, 9))
        return packet

    def _sealed(self, packet: bytearray) -> bytes:
        """Put a head and a checksum on that hold, addressed to the boat mostly, so that the fields behind them are read."""
        chance = self._chance
        body = bytes(packet[20:-2])
        number = int.from_bytes(packet[2:4], "little")
        number = chance.choice((number, number, number, number, chance.randrange(0x10000)))
        destination = chance.choice((BOAT, BOAT, BOAT, 0xFFFF, 0xFFF0, 0, 0x0803))
        utc_s = chance.choice((1_790_000_000.0 + chance.random() * 100, 0.0, float("nan"), float("inf"), -1e300, 1e18))
        source = chance.choice((0x4001, 0x4001, 0x4002, chance.randrange(0x10000)))
        head = _HEADER.pack(0xFE54, number, len(body), utc_s, source, 3, destination, 0xFF)
        return head + body + arc(head + body).to_bytes(2, "little")

    def source(self) -> Place:
        """Where it comes from: two consoles, connections that come and go, and everybody."""
        chance = self._chance
        host = chance.choice(
            ("10.0.0.1", "10.0.0.1", "10.0.0.2", f"10.1.{chance.randrange(256)}.{chance.randrange(256)}")
        )
        port = chance.choice((6001, 6001, 30100, chance.randrange(1, 65536)))
        return Udp(host, port) if chance.random() < 0.8 else Tcp(host, 50_000 + chance.randrange(40))


def fuzz_imc(packets: int, seed: int, *, read_only: bool = True) -> Outcome:
    """Play so many pieces."""
    maker, target, outcome = PacketMaker(seed), Target(read_only=read_only), Outcome()
    base_kb = 0
    for number in range(packets):
        data, source, now_us = maker.piece(), maker.source(), number * _STEP_US
        try:
            answered, frames = target.play(data, source, now_us)
        except Exception as error:
            outcome.broken.append(f"{type(error).__name__}: {error}: {data.hex()[:400]}")
            target = Target(read_only=read_only)
            continue
        outcome.answered += answered
        outcome.to_vehicle += frames
        if number == min(WARM, packets // 2):
            base_kb = _kept_kb()
        if number % 997 == 0 and isinstance(source, Tcp):
            target.node.closed(source)
    outcome.packets, outcome.understood = packets, target.node.counters.packets
    outcome.growth_kb = _kept_kb() - base_kb
    if read_only and outcome.to_vehicle:
        outcome.broken.append(f"{outcome.to_vehicle} frames for the vehicle, read-only")
    return outcome


def _kept_kb() -> int:
    """What the process holds."""
    gc.collect()
    with Path("/proc/self/statm").open(encoding="ascii") as file:
        return int(file.read().split()[1]) * 4
