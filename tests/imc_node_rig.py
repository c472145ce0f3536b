"""An IMC console for tests in virtual time: speaks our codec, and has every packet that it gets read by DUNE's own code too."""

from __future__ import annotations

import importlib

from mavlink_bridge import imc
from mavlink_bridge.imc import Discovery, Header, Message, Node, NodeConfig, Outgoing, Packet, Udp, encode

try:
    imcpy = importlib.import_module("imcpy")
except ImportError:
    imcpy = None

BOAT_ID = 0x2877
UTC_S = 1_790_000_000.0


def read_by_both(data: bytes) -> Packet:
    """The packet; DUNE's own code reads and writes the same bytes."""
    if imcpy is not None:
        assert imcpy.Packet.deserialize(data).serialize() == data
    return imc.decode(data)


class Part:
    """A part of the system that notes what it gets, and says what it is told to."""

    def __init__(self, label: str = "Plan Engine") -> None:
        self.label = label
        self.asked: list[tuple[Message, imc.Asker]] = []
        self.alive: list[imc.Asker] = []
        self.new: list[imc.Asker] = []
        self.out: list[Outgoing] = []
        self.answer: Message | None = None

    def receive(self, message, asker, now_us):
        self.asked.append((message, asker))
        if self.answer is not None:
            self.out.append(Outgoing(self.answer, asker, self.label))
        return True

    def heard(self, asker, now_us):
        self.alive.append(asker)

    def met(self, asker, now_us):
        self.new.append(asker)

    def take(self, now_us):
        out, self.out = self.out, []
        return out

    def entities(self):
        return (self.label,)


def make_node(*parts: Part, opening: bool = False) -> Node:
    node = Node(NodeConfig(imc_id=BOAT_ID, name="boat", uid=77), parts, opening=opening)
    node.utc_ahead_us = round(UTC_S * 1e6)
    node.udp = (Udp("10.77.0.2", 6002),)
    node.tcp = (Udp("10.77.0.2", 6002),)
    return node


class ConsoleRig:
    """A console at an address. ``ahead_s``: its clock before ours."""

    def __init__(
        self, node: Node, host: str = "10.77.0.1", imc_id: int = 0x4001, name: str = "ccu-a", ahead_s: float = 0.0
    ) -> None:
        self.node, self.host, self.imc_id, self.name, self.ahead_s = node, host, imc_id, name, ahead_s
        self.udp = Udp(host, 6001)
        self.finder = Udp(host, 30100)
        self.got: list[tuple[object, Packet]] = []
        self._count = 0

    def packet(self, message: Message, now_us: int, destination: int = BOAT_ID, *, big_endian: bool = False) -> bytes:
        self._count += 1
        utc_s = UTC_S + now_us * 1e-6 + self.ahead_s + self._count * 1e-6
        header = Header(self.imc_id, destination, utc_s, source_entity=3)
        return encode(Packet(header, message, big_endian))

    def say(
        self, message: Message, now_us: int, destination: int = BOAT_ID, place=None, *, big_endian: bool = False
    ) -> list[Packet]:
        """Send one packet; what the boat sends this console at once."""
        data = self.packet(message, now_us, destination, big_endian=big_endian)
        self.node.receive(data, place or self.udp, now_us)
        return self.take(now_us)

    def announce(self, now_us: int, services: str | None = None) -> list[Packet]:
        told = f"imc+udp://{self.host}:6001/;imc+tcp://{self.host}:6001/;" if services is None else services
        return self.say(imc.Announce(sys_name=self.name, services=told), now_us, 0, self.finder)

    def take(self, now_us: int) -> list[Packet]:
        """What is sent to this console's host, discovery included."""
        new = [
            (place, read_by_both(data))
            for place, data in self.node.take(now_us)
            if isinstance(place, Discovery) or place.host == self.host
        ]
        self.got += new
        return [packet for _, packet in new]


def kinds(packets: list[Packet]) -> list[type]:
    return [type(packet.message) for packet in packets]
