"""What coverage-guided fuzzing calls: each reader of a stranger's bytes with fresh state, and what must hold afterwards.

An input is one blob. Where a checksum or an authentication tag would stop every mutation at the door, the blob says what
goes inside and the target puts the right seal around it (``records``). A target may refuse by the exception that its
contract names; any other one, or a broken promise (AssertionError), is a fault. ``tools.fuzz_guided`` drives them, the
test suite plays the kept corpus.
"""

from __future__ import annotations

import dataclasses
import math
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import config
from companion.app import App
from companion.build import build_app
from companion.core.board import ActuatorConfig, Arduino, wire as arduino_wire
from companion.core.nmea import NmeaConfig, NmeaReader
from companion.io.links.mem import MemLink
from companion.radio import load_radio
from companion.settings import load
from mavlink_bridge.language import requests as ask
from mavlink_bridge.language.figures import Circle
from mavlink_bridge.language.requests import ACCEPTED, PlanKind
from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.mavlink.endpoint import Endpoint
from mavlink_bridge.mavlink.persona import EndpointConfig
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import Codec
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.plans import PlanFileError, seed_json
from mavlink_bridge.radio.aboard import VesselRadio
from mavlink_bridge.radio.air import Ledger
from mavlink_bridge.radio.codec import info, plan as plan_codec, request as request_codec, state as state_codec
from mavlink_bridge.radio.codec.frames import Opener, Sealer
from mavlink_bridge.radio.codec.wire import Kind
from mavlink_bridge.radio.json_radio import JsonRadio
from mavlink_bridge.radio.session import Pairing, RadioDirection
from mavlink_bridge.radio.shore import ShoreTwin
from sitl.world import SimSettings
from tools.fuzzing.decoders import BOARD_LINES, KEY, SENTENCES, decoders, read_and_judge

STEP_US = 50_000
_TIME = 255
"""Record type that lets time pass."""
_RAW = 254
"""Record type whose content is sent as it is."""


@dataclass(frozen=True)
class Guided:
    """One target: inputs to start from, the call, and the exceptions by which it may refuse."""

    name: str
    seeds: Sequence[bytes]
    call: Callable[[bytes], object]
    refuses_by: tuple[type[Exception], ...] = ()

    def play(self, data: bytes) -> None:
        """Run one input. Raises only for a fault."""
        try:
            self.call(data)
        except self.refuses_by:
            return


def records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Read a blob as (type, content): one byte each for type and length; a last one may be cut."""
    at = 0
    while at + 2 <= len(data):
        yield data[at], data[at + 2 : at + 2 + data[at + 1]]
        at += 2 + data[at + 1]


def record(kind: int, body: bytes) -> bytes:
    return bytes((kind, len(body))) + body


@cache
def _vessel() -> tuple[App, Snapshot]:
    """A vessel to stand behind endpoints; nothing that a target does changes it."""
    settings = load(config.path("sim.toml"), ["radio.url=''"], SimSettings)
    app = build_app(settings, make_link=lambda name, url, **_: MemLink(name), reproducible=True)
    snapshot = app.tick(1_000_000)
    assert snapshot is not None
    return app, snapshot


def finite(value: Any) -> bool:
    """Whether every number in a request is one that arithmetic survives. Raw plan items may hold NaN."""
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, ask.PlanItem):
        return True
    if dataclasses.is_dataclass(value):
        return all(finite(getattr(value, each.name)) for each in dataclasses.fields(value))
    return all(map(finite, value)) if isinstance(value, tuple) else True


def _deframe(data: bytes) -> None:
    whole, single = Deframer(), Deframer()
    frames = whole.receive(data, 0)
    assert frames == [frame for byte in data for frame in single.receive(bytes((byte,)), 0)], "whole = byte by byte"
    assert all(frame.raw in data for frame in frames)


def _endpoint(data: bytes) -> None:
    """A station's messages with right checksums, in an order that coverage finds; the first byte chooses the face."""
    app, snapshot = _vessel()
    face: Any = ("ardurover", "generic")[data[0] & 1] if data else "generic"
    endpoint = Endpoint(EndpointConfig(persona=face), app.facade)
    station, answers, now_us = Codec(255, 190), Deframer(), 1_000_000
    accepted = sorted(endpoint._handlers)
    endpoint.tick(now_us, snapshot)
    for kind, body in records(data[1:]):
        if kind == _TIME:
            now_us += STEP_US * (1 + len(body))
            endpoint.tick(now_us, snapshot)
        elif kind == _RAW:
            endpoint.receive(body, now_us)
        else:
            endpoint.receive(station.seal(accepted[kind % len(accepted)], body or b"\0"), now_us)
        for request in endpoint.requests():
            assert finite(request.body), request
            if request.reply:
                endpoint.reply(request.id, ACCEPTED, now_us)
        for _ in range(100):
            sent = endpoint.take(now_us, 1200)
            answers.receive(sent, now_us)
            if not sent:
                break
    assert not answers.counters.skipped_bytes, "what is sent is whole frames"


def _nmea(data: bytes) -> None:
    """Lines of text; one without a checksum gets the right one."""
    reader, single = NmeaReader(NmeaConfig()), NmeaReader(NmeaConfig())
    for number, line in enumerate(data.split(b"\n")):
        if line.startswith(b"$") and b"*" not in line:
            check = 0
            for byte in line[1:]:
                check ^= byte
            line = b"%b*%02X\r" % (line, check)
        line += b"\n"
        now_us = number * 20_000
        found = reader.receive(line, now_us)
        assert found == [item for byte in line for item in single.receive(bytes((byte,)), now_us)]
        assert all(map(finite, found)), found


def _board(data: bytes) -> None:
    """Lines of the actuator board; '#' without a checksum gets the right one."""
    board = Arduino(ActuatorConfig(), 0.5)
    board.opened(0)
    for number, line in enumerate(data.split(b"\n")):
        if line.startswith(b"#") and b"*" not in line:
            line = arduino_wire.checked(line.decode("latin-1")[:200]) if line.isascii() else line
        board.receive(line + b"\n", number * 20_000)
        assert finite(board.status), board.status
        assert all(1000 <= pulse <= 2000 for pulse in board.commanded_us or ())


def _radio_vessel(data: bytes) -> None:
    """Authentic frames of the compact link, in any order and with any content, at the vessel."""
    app, snapshot = _vessel()
    radio = VesselRadio(load_radio("o-10"), KEY, app.facade, random.Random(1), nonce=b"vessel")
    for now_us, frame in _sealed(data, RadioDirection.TO_VESSEL, radio.link.pairing):
        radio.receive(frame, now_us)
        for request in radio.requests():
            assert finite(request.body), request
            radio.reply(request.id, ACCEPTED, now_us)
        radio.tick(now_us, snapshot)
        assert len(radio.take(now_us, 1200)) < 64


def _radio_shore(data: bytes) -> None:
    """The same at the shore twin."""
    app, snapshot = _vessel()
    params, identity = app.facade.params, app.facade.identity
    twin = ShoreTwin(
        load_radio("o-10"), KEY, params, identity, neutral=snapshot.output, rng=random.Random(1), nonce=b"shore."
    )
    for number, (now_us, frame) in enumerate(_sealed(data, RadioDirection.TO_SHORE, twin.link.pairing)):
        twin.receive(frame, now_us)
        twin.tick(now_us, station_present=True)
        twin.snapshot(now_us, number)
        assert len(twin.take(now_us)) < 64


def _sealed(data: bytes, direction: RadioDirection, listener: Pairing) -> Iterator[tuple[int, bytes]]:
    """What the other end of a session would send: first the HELLOs, then whatever the data say."""
    now_us = 1_000_000
    speaker = Pairing(KEY, 1, direction, b"other.", load_radio("o-10"))
    sealer = Sealer(speaker)
    body, proven = listener.hello(now_us, please=True, proof=False)
    Opener(speaker).receive(Sealer(listener).hello(body, proven), now_us)
    yield now_us, sealer.hello(*speaker.hello(now_us, please=False, proof=True))
    session = speaker.rival
    assert session is not None
    for kind, content in records(data):
        now_us += 1_500_000
        yield now_us, content if kind == _RAW else sealer.seal(Kind(kind % 16), content[:54], now_us, session)


def _json_radio(data: bytes) -> None:
    _, snapshot = _vessel()
    profile = load_radio("o-10")
    radio = JsonRadio(profile, "usv", Ledger(profile.hour_us))
    for number, piece in enumerate(data.split(b"\xff")):
        now_us = 1_000_000 + number * 500_000
        radio.receive(piece, now_us)
        for request in radio.requests():
            assert finite(request.body), request
            radio.reply(request.id, ACCEPTED, now_us)
        radio.tick(now_us, snapshot)
        radio.take(now_us, 1200)


def _state(data: bytes) -> None:
    """A key state, then what a delta makes of it."""
    key = state_codec.decode_key(data[:16])
    state_codec.decode_delta(key, data[16:])


def _request(data: bytes) -> None:
    names = request_codec.name_codes(info_names())
    assert finite(request_codec.decode_request(data, names.get))


@cache
def info_names() -> tuple[str, ...]:
    app, _ = _vessel()
    return tuple(entry.param.name for entry in app.facade.params.entries)


def targets() -> list[Guided]:
    """All targets."""
    plain = {decoder.name: decoder for decoder in decoders()}
    heartbeat = Codec(255, 190).seal(0, bytes((0, 0, 0, 0, 6, 8, 0, 4, 3)))
    lines = b"\n".join(SENTENCES)
    orders = [
        record(Kind.ORDER, bytes((1,)) + request_codec.encode_request(body))
        for body in (ask.Arm(True), ask.Reposition(0.7, -0.1, 2.0), ask.Orbit(0.7, -0.1, Circle(20.0)))
    ]
    return [
        Guided("deframer", [heartbeat, b"\xfe\x00" + heartbeat * 2, b"\xfd" * 20], _deframe),
        Guided(
            "endpoint",
            [b"\0" + b"".join(record(n, bytes(30)) for n in range(40)), b"\1" + record(_RAW, heartbeat)],
            _endpoint,
        ),
        Guided("nmea", [lines, lines.replace(b"*", b"\n")], _nmea),
        Guided(
            "board", [b"\n".join(BOARD_LINES), b"#S,R,1,20,10,0,1500,1500,1500,1500,P,12100\n#B,1,1.0,UNO,P"], _board
        ),
        Guided("plan-file", plain["plan file"].seeds, read_and_judge, (PlanFileError,)),
        Guided("seed-json", plain["seed json"].seeds, seed_json.parse, (seed_json.SeedJsonError,)),
        Guided("json-radio", [*plain["seed json"].seeds, b'{"command":"stop"}\n\xff{"a":[1,{"b":2}]}\n'], _json_radio),
        Guided("tlog", plain["tlog"].seeds, lambda data: list(tlog.iterate(data))),
        Guided("radio-vessel", [b"".join(record(n, bytes(12)) for n in range(14)), *orders], _radio_vessel),
        Guided("radio-shore", [b"".join(record(n, bytes(22)) for n in range(14))], _radio_shore),
        Guided("radio-plan", plain["radio plan"].seeds, _plans, (plan_codec.PlanCodecError,)),
        Guided("radio-state", plain["radio state"].seeds, _state, (ValueError,)),
        Guided("radio-info", plain["radio info"].seeds, info.decode, (ValueError,)),
        Guided("radio-request", [order[3:] for order in orders], _request, (request_codec.RequestCodecError,)),
    ]


def _plans(data: bytes) -> None:
    kind, items = plan_codec.decode_plan(data, None)[:2]
    assert kind in PlanKind
    assert all(isinstance(item, ask.PlanItem) for item in items)
