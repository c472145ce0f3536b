"""Strangers on a signed link, on real sockets: they lock nobody out, and see that a vessel is there and nothing else.

Time is virtual. The stranger of a test does what a red team did to the first release; the operators are pymavlink's own signing.
"""

from __future__ import annotations

import contextlib
import os
import socket
import time
from collections.abc import Callable, Iterator

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as library

from companion.io.links.link import Link
from companion.io.links.places import RESERVED
from companion.io.links.table import open_link
from companion.ports import GroundPort
from companion.strangers import Strangers
from mavlink_bridge.language.messages import Severity
from mavlink_bridge.mavlink.endpoint.endpoint import Endpoint
from mavlink_bridge.mavlink.persona.config import EndpointConfig
from mavlink_bridge.mavlink.wire.codec import decode
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.mavlink.wire.signing import SigningState
from tests.fake_vessel import TICK_US, FakeVessel

KEY = bytes(range(32))
HEARTBEAT_BYTES = 34
NEW_OPERATOR_WITHIN_S = 3.0


class Vessel:
    """A vessel with one signed link."""

    def __init__(self, url: str) -> None:
        self.vessel = FakeVessel()
        self.told: list[str] = []
        self.link: Link = open_link("gcs", url)
        config = EndpointConfig(link_class="signed")
        state = SigningState(key=KEY)
        strangers = Strangers(self.say)

        def converse(channel: int, peer: str) -> Endpoint:
            return Endpoint(config, self.vessel, signing=state, link_id=2)

        self.port = GroundPort(self.link, "endpoint", converse, strangers.doorstep(config, state, 2))

    def say(self, severity: Severity, text: str) -> None:
        self.told.append(text)

    @property
    def address(self) -> tuple[str, int]:
        return "127.0.0.1", self.link.port  # type: ignore[attr-defined]

    def run(self, seconds: float, each_tick: Callable[[], None] = lambda: None) -> None:
        for _ in range(round(seconds * 1e6 / TICK_US)):
            each_tick()
            self.vessel.now_us += TICK_US
            self.port.read(self.vessel.now_us)
            for talk, request in self.port.requests():
                talk.reply(request.id, self.vessel.handle(request), self.vessel.now_us)
            self.port.tell(self.vessel.now_us, self.vessel.snapshot())

    def close(self) -> None:
        self.port.link.close()


@pytest.fixture(autouse=True)
def signing_needs_version_2(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAVLINK20", "1")


@pytest.fixture(params=["udp-listen", "tcp-listen"])
def vessel(request: pytest.FixtureRequest) -> Iterator[Vessel]:
    found = Vessel(f"{request.param}://127.0.0.1:0")
    yield found
    found.close()


@pytest.fixture
def udp() -> Iterator[Vessel]:
    found = Vessel("udp-listen://127.0.0.1:0")
    yield found
    found.close()


@pytest.fixture
def tcp() -> Iterator[Vessel]:
    found = Vessel("tcp-listen://127.0.0.1:0")
    yield found
    found.close()


class Stranger:
    """A socket that counts what comes."""

    def __init__(self, vessel: Vessel, host: str = "127.0.0.1") -> None:
        kind = socket.SOCK_DGRAM if vessel.link.datagrams else socket.SOCK_STREAM
        self.sock = socket.socket(socket.AF_INET, kind)
        self.sock.bind((host, 0))
        self.sock.setblocking(False)
        self.sock.connect_ex(vessel.address)
        self.sent = self.came = 0
        self.names: list[str] = []
        self._deframer = Deframer()

    def send(self, data: bytes) -> None:
        with contextlib.suppress(OSError):
            self.sent += self.sock.send(data)

    def read(self) -> None:
        with contextlib.suppress(OSError):
            while data := self.sock.recv(65536):
                self.came += len(data)
                for frame in self._deframer.receive(data, 0):
                    message = decode(frame)
                    self.names.append(message.get_type() if message else "?")

    def close(self) -> None:
        self.sock.close()


class Operator:
    """pymavlink with the key, as MAVProxy has it."""

    def __init__(self, vessel: Vessel) -> None:
        self.vessel = vessel
        scheme = "udpout" if vessel.link.datagrams else "tcp"
        self.connection = mavutil.mavlink_connection(
            f"{scheme}:127.0.0.1:{vessel.address[1]}", source_system=255, dialect="all"
        )
        self.connection.setup_signing(KEY, sign_outgoing=True)
        self.seen: dict[str, int] = {}
        self._next_us = 0

    def tick(self) -> None:
        if self.vessel.vessel.now_us >= self._next_us:
            self._next_us = self.vessel.vessel.now_us + 1_000_000
            self.connection.mav.heartbeat_send(6, 8, 0, 0, 4)
        while (message := self.connection.recv_msg()) is not None:
            self.seen[message.get_type()] = self.seen.get(message.get_type(), 0) + 1

    def close(self) -> None:
        self.connection.close()


def gets_in(vessel: Vessel, beside: Callable[[], None] = lambda: None) -> Operator:
    operator = Operator(vessel)

    def tick() -> None:
        beside()
        operator.tick()

    vessel.run(NEW_OPERATOR_WITHIN_S, tick)
    operator.tick()
    assert operator.seen.get("GLOBAL_POSITION_INT", 0) > 0, operator.seen
    return operator


def test_sixteen_senders_of_a_byte_each_two_seconds_lock_nobody_out(vessel: Vessel) -> None:
    inside = gets_in(vessel)
    strangers = [Stranger(vessel) for _ in range(16)]
    due = [0]

    def knock() -> None:
        if vessel.vessel.now_us >= due[0]:
            due[0] = vessel.vessel.now_us + 2_000_000
            for stranger in strangers:
                stranger.send(b"x")

    def tick() -> None:
        knock()
        inside.tick()

    vessel.run(10.0, tick)
    newcomer = gets_in(vessel, tick)
    before = inside.seen["HEARTBEAT"]
    vessel.run(20.0, tick)
    assert inside.seen["HEARTBEAT"] >= before + 19, "an operator who was there is never dropped"
    for each in (inside, newcomer, *strangers):
        each.close()


def test_twenty_silent_connections_lock_nobody_out(tcp: Vessel) -> None:
    inside = gets_in(tcp)
    strangers = [Stranger(tcp) for _ in range(20)]
    tcp.run(2.0, inside.tick)
    assert len(tcp.port.strangers) <= 16 - RESERVED
    newcomer = gets_in(tcp, inside.tick)
    for stranger in strangers:
        stranger.read()
        assert set(stranger.names) <= {"HEARTBEAT"}
    before = inside.seen["HEARTBEAT"]
    tcp.run(5.0, inside.tick)
    assert inside.seen["HEARTBEAT"] >= before + 4
    for each in (inside, newcomer, *strangers):
        each.close()


def test_connections_made_anew_without_end_from_another_host_lock_nobody_out(tcp: Vessel) -> None:
    strangers: list[Stranger] = []

    def storm() -> None:
        while len(strangers) > 30:
            strangers.pop(0).close()
        strangers.append(Stranger(tcp, "127.0.0.9"))

    tcp.run(2.0, storm)
    operator = gets_in(tcp, storm)
    for each in (operator, *strangers):
        each.close()


def test_senders_from_made_up_ports_lock_nobody_out(udp: Vessel) -> None:
    """2 000 datagrams a second, each from another port."""

    def storm() -> None:
        for _ in range(100):
            stranger = Stranger(udp)
            stranger.send(os.urandom(40))
            stranger.close()

    udp.run(0.5, storm)
    operator = gets_in(udp, lambda: storm() if udp.vessel.now_us % 200_000 == 0 else None)
    operator.close()


def test_one_byte_draws_no_more_than_a_byte(udp: Vessel) -> None:
    stranger = Stranger(udp)
    stranger.send(b"x")
    udp.run(60.0, stranger.read)
    assert stranger.came <= stranger.sent
    stranger.close()


@pytest.mark.parametrize(
    "speech",
    [b"x", b"\xfd" * 50, "heartbeat", "forged", "recorded"],
    ids=["a byte", "markers", "heartbeat", "forged", "recorded"],
)
def test_a_sender_who_proves_nothing_gets_a_byte_for_a_byte_and_heartbeats_only(
    udp: Vessel, speech: bytes | str
) -> None:
    data = speech if isinstance(speech, bytes) else speeches()[speech]
    if speech == "recorded":
        genuine = gets_in(udp)
        data = speeches()["recorded"]
        genuine.connection.write(data)
        udp.run(0.5, genuine.tick)  # heard once from its owner: from now on it is a copy
        genuine.close()
    stranger = Stranger(udp)

    def tick() -> None:
        stranger.send(data)
        stranger.read()
        assert stranger.came <= stranger.sent

    udp.run(30.0, tick)
    assert set(stranger.names) <= {"HEARTBEAT"}
    assert stranger.came <= 31 * HEARTBEAT_BYTES
    assert len(udp.told) == 0 if isinstance(speech, bytes) else len(udp.told) == 1
    assert not udp.port.requests()
    stranger.close()


def speeches() -> dict[str, bytes]:
    """What a stranger may send, by kind."""
    message = library.MAVLink_command_long_message(1, 1, 400, 0, 1, 21196, 0, 0, 0, 0, 0)
    found = {"heartbeat": library.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(library.MAVLink(None, 255, 190))}
    for kind, key in (("forged", bytes(32)), ("recorded", KEY)):
        mav = library.MAVLink(None, 255, 190)
        mav.signing.secret_key, mav.signing.sign_outgoing = key, True
        mav.signing.timestamp = int((time.time() - 1_420_070_400) * 1e5)
        found[kind] = message.pack(mav)
    return found


def test_clients_that_wait_for_a_heartbeat_get_one_a_second_and_nothing_else(tcp: Vessel) -> None:
    stranger = Stranger(tcp)

    def tick() -> None:
        stranger.send(speeches()["heartbeat"])
        stranger.read()

    tcp.run(30.0, tick)
    assert set(stranger.names) == {"HEARTBEAT"}
    assert 29 <= len(stranger.names) <= 31
    stranger.close()


def test_the_peer_of_the_configuration_hears_heartbeats_before_it_speaks_and_no_position_until_it_signs() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
        station.bind(("127.0.0.1", 0))
        station.setblocking(False)
        vessel = Vessel(f"udp://127.0.0.1:{station.getsockname()[1]}")
        deframer, names = Deframer(), []

        def read() -> None:
            with contextlib.suppress(OSError):
                while True:
                    data, address = station.recvfrom(65536)
                    names.extend(decode(frame).get_type() for frame in deframer.receive(data, 0))
                    if speaks:
                        station.sendto(speeches()["recorded"], address)
                        speaks.clear()

        speaks: list[bool] = []
        vessel.run(9.9, read)
        assert names == ["HEARTBEAT"] * len(names)
        assert 9 <= len(names) <= 10
        speaks.append(True)
        vessel.run(3.0, read)
        assert "GLOBAL_POSITION_INT" in names
        assert "COMMAND_ACK" in names, "the first frame is the proof, and is obeyed"
        vessel.close()


def test_a_frame_in_pieces_proves_too(tcp: Vessel) -> None:
    stranger = Stranger(tcp)
    data = b"noise" + speeches()["heartbeat"] + speeches()["recorded"]

    def tick() -> None:
        nonlocal data
        stranger.send(data[:7])
        data = data[7:]
        stranger.read()

    tcp.run(2.0, tick)
    assert "COMMAND_ACK" in stranger.names
    assert isinstance(next(iter(tcp.port.conversations.values())), Endpoint)
    stranger.close()
