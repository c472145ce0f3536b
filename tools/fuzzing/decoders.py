"""Mutated inputs for every decoder that reads a stranger's bytes and is not reached through MAVLink: sentences, board lines, files, radio.

A decoder may refuse by the exception that its contract names; anything else is a fault. Seeded, so a run repeats.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from companion.core.board import ActuatorConfig, Arduino, wire as arduino_wire
from companion.core.nmea import NmeaConfig, NmeaReader
from mavlink_bridge.language.requests import PlanKind
from mavlink_bridge.mavlink.missions.plan_mapping import compile_items, load_plan
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from mavlink_bridge.plans import PlanFile, PlanFileError, read_plan, seed_json, write_plan
from mavlink_bridge.plans.files import write_wpl
from mavlink_bridge.radio.codec import info, plan as plan_codec, state as state_codec
from mavlink_bridge.radio.codec.frames import Opener, Sealer
from mavlink_bridge.radio.codec.json_stream import JsonStream
from mavlink_bridge.radio.codec.state_fields import RadioState
from mavlink_bridge.radio.codec.wire import Kind
from mavlink_bridge.radio.session import RadioDirection
from tools.lora_rig import acquainted
from tools.plan_items import plan_item

KEY = bytes(range(32))
TOKENS = (
    b"\x00",
    b"\xff",
    b"$",
    b"*",
    b",",
    b"\r\n",
    b"-",
    b"1e999",
    b"NaN",
    b"9" * 40,
    b'"',
    b"{",
    b"[",
    b"\xc3",
    b"\t",
)


@dataclass(frozen=True)
class Decoder:
    """One reader: inputs that are good, the call, and the exceptions by which it may refuse."""

    name: str
    seeds: Sequence[bytes]
    call: Callable[[bytes], object]
    refuses_by: tuple[type[Exception], ...] = ()


def decoders() -> list[Decoder]:
    """Fresh readers; streaming ones keep their state over the run, as they do at sea."""
    items = tuple(plan_item(16, (0.0, 1.0, 0.0, math.nan), at_e7=(411_850_000 + n, -87_060_000)) for n in range(4))
    plan = PlanFile(
        items,
        (plan_item(5003, (50.0, 0, 0, 0), at_e7=(411_850_000, -87_060_000), frame=0),),
        home_rad=(0.7, -0.1),
    )
    loiter = {"id": "a", "latitude": 41.1, "longitude": -8.7, "duration_s": 60, "loiter_type": "circular"}
    seed = json.dumps(loiter | {"speed_kn": 3, "radius_m": 20}).encode()
    reader, board, lines = NmeaReader(NmeaConfig()), Arduino(ActuatorConfig(), 0.5), JsonStream()
    ends = acquainted(key=KEY)
    shore = ends[RadioDirection.TO_VESSEL]
    assert shore.current is not None
    opener, sealer = Opener(ends[RadioDirection.TO_SHORE]), Sealer(shore)
    frames = [sealer.seal(kind, b"body", 0, shore.current) for kind in (Kind.KEY, Kind.DELTA, Kind.BATCH, Kind.STOP)]
    key = state_codec.encode_key(RadioState(lat_rad=0.7, lon_rad=-0.1))
    log = b"".join(
        tlog.pack(
            n,
            0,
            Codec(1, 1).encode(
                dialect.MAVLink_heartbeat_message(
                    type=11, autopilot=3, base_mode=0, custom_mode=0, system_status=4, mavlink_version=3
                )
            ),
        )
        for n in range(3)
    )
    board.opened(0)
    clock = iter(range(0, 10**15, 20_000))
    return [
        Decoder("nmea", SENTENCES, lambda data: reader.receive(data, next(clock))),
        Decoder("board", BOARD_LINES, lambda data: board.receive(data, next(clock))),
        Decoder("plan file", [write_plan(plan).encode(), write_wpl(plan).encode()], read_and_judge, (PlanFileError,)),
        Decoder("seed json", [seed, b"[" + seed + b"," + seed + b"]"], seed_json.parse, (seed_json.SeedJsonError,)),
        Decoder("json stream", [seed + b"\n"], lambda data: lines.receive(data, next(clock))),
        Decoder("tlog", [log], lambda data: list(tlog.iterate(data))),
        Decoder("radio frame", frames, lambda data: opener.receive(data, next(clock))),
        Decoder(
            "radio plan",
            [plan_codec.encode_plan(PlanKind.MISSION, items, None)],
            lambda data: plan_codec.decode_plan(data, None),
            (ValueError,),
        ),
        Decoder("radio state", [key], state_codec.decode_key, (ValueError,)),
        Decoder("radio info", [b"\x00" * 20, b"\x01" * 30], info.decode, (ValueError,)),
    ]


def read_and_judge(data: bytes) -> None:
    """What a plan file goes through before it sails."""
    plan = read_plan(data)
    compile_items(plan.mission)
    for kind in PlanKind:
        load_plan(kind, plan.items(kind))


def _sentence(body: str) -> bytes:
    check = 0
    for byte in body.encode():
        check ^= byte
    return f"${body}*{check:02X}\r\n".encode()


SENTENCES = [
    _sentence("GPZDA,102436.00,15,06,2026,00,00"),
    _sentence("GPGGA,102436.00,4111.1007,N,00842.3729,W,4,17,0.7,3.2,M,54.1,M,1.0,0000"),
    _sentence("GPRMC,102436.00,A,4111.1007,N,00842.3729,W,2.9,92.4,150626,,,R"),
    _sentence("GPVTG,92.4,T,,M,2.9,N,5.4,K,R"),
    _sentence("HEHDT,92.4,T") + _sentence("SDDPT,12.3,0.2,100"),
    _sentence("TIROT,1.5,A") + _sentence("SDDBT,40.3,f,12.3,M,6.7,F"),
]
BOARD_LINES = [
    arduino_wire.checked("#S,R,1,20,10,0,1500,1500,1500,1500,P,12100"),
    arduino_wire.checked("#B,1,1.0,UNO,P"),
    b"hello\n",
]


def mutate(rng: random.Random, seeds: Sequence[bytes]) -> bytes:
    """One of the seeds with a few things wrong, or two of them spliced."""
    data = bytearray(rng.choice(seeds))
    for _ in range(rng.randrange(1, 6)):
        at = rng.randrange(len(data) + 1)
        kind = rng.randrange(6)
        if kind == 0 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            data[at:at] = rng.choice(TOKENS)
        elif kind == 2:
            del data[at : at + rng.randrange(1, 12)]
        elif kind == 3:
            data[at:at] = data[at : at + rng.randrange(1, 40)]
        elif kind == 4:
            other = rng.choice(seeds)
            data[at:] = other[rng.randrange(len(other)) :]
        else:
            data[at:at] = rng.randbytes(rng.randrange(1, 6))
    return bytes(data)


def fuzz_decoders(rounds: int, seed: int) -> list[str]:
    """Run every decoder ``rounds`` times; return what went wrong, with the input."""
    rng = random.Random(seed)
    broken: list[str] = []
    for decoder in decoders():
        for _ in range(rounds):
            data = mutate(rng, decoder.seeds)
            try:
                decoder.call(data)
            except decoder.refuses_by:
                continue
            except Exception as error:  # the point of the exercise
                broken.append(f"{decoder.name}: {error!r} on {data[:200]!r}")
                if len(broken) >= 10:
                    return broken
    return broken
