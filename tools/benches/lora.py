"""The LoRa table of the benchmark suite: sizes, seconds and airtime on the simulated air (PHY A, module header 0), in virtual time."""

from __future__ import annotations

import itertools
import math
import random
import struct
from typing import Any, Final

from mavlink_bridge.language.requests import (
    Arm,
    LoadPlan,
    Origin,
    PlanItem,
    PlanKind,
    Reply,
    RequestBody,
    Result,
    SetParameter,
)
from mavlink_bridge.mavlink.commands.table import Context
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from mavlink_bridge.mavlink.missions.plan_rules import PlanError
from mavlink_bridge.mavlink.wire.codec import dialect, payload
from mavlink_bridge.radio.air.ledger import HOUR_US
from mavlink_bridge.radio.codec.command import decode_command, encode_command, trimmed
from mavlink_bridge.radio.codec.frames import Opener, Sealer
from mavlink_bridge.radio.codec.plan import check_of, decode_plan, encode_plan
from mavlink_bridge.radio.codec.wire import TAG_BYTES, Kind
from mavlink_bridge.radio.orders import meaning_of
from mavlink_bridge.radio.patience import ANSWER_BYTES
from mavlink_bridge.radio.session import RadioDirection
from sitl.radio import RadioConfig
from tools.lora_rig import Rig, acquainted, profile
from tools.plan_items import plan_item

Row = dict[str, Any]
HOLDS: Final = {"<=": lambda value, bar: value <= bar, "=": lambda value, bar: value == bar}
NAN: Final = float("nan")


def row(name: str, value: float, unit: str, bar: str) -> Row:
    """One line of the table; ``bar`` is '<= 5' or '= 0'."""
    sign, _, limit = bar.partition(" ")
    return {"name": name, "value": round(value, 3), "unit": unit, "bar": bar, "holds": HOLDS[sign](value, float(limit))}


# ---- plans ----------------------------------------------------------------------------------------------------------


def loiter_items(frame: int = 3) -> tuple[PlanItem, ...]:
    """Speed and a timed loiter, as MAVSDK and QGroundControl send them."""
    return (
        plan_item(178, (1.0, 1.5, -1.0, 0.0), frame=2),
        plan_item(19, (600.0, 0.0, 40.0, 0.0), at_e7=(411_812_345, -86_987_654), frame=frame),
    )


def survey_items(count: int, seed: int = 1) -> tuple[PlanItem, ...]:
    """A survey in lanes of 150 m, 20 m apart, turned by 23 degrees, each point off by up to 0.5 m."""
    rng = random.Random(seed)
    turn = math.radians(23.0)
    items = []
    for index in range(count):
        lane, side = index // 2, (index + index // 2) % 2
        along, across = 150.0 * side + rng.uniform(-0.5, 0.5), 20.0 * lane + rng.uniform(-0.5, 0.5)
        east = along * math.cos(turn) - across * math.sin(turn)
        north = along * math.sin(turn) + across * math.cos(turn)
        x = int((41.1812345 + north / 111_132.0) * 1e7)
        y = int((-8.6987654 + east / 83_800.0) * 1e7)
        items.append(plan_item(16, (0.0, 3.0, 0.0, NAN), at_e7=(x, y)))
    return tuple(items)


def compiled(items: tuple[PlanItem, ...]) -> LoadPlan:
    load = load_plan(PlanKind.MISSION, items)
    if isinstance(load, PlanError):
        raise ValueError(load.reason)
    return load


# ---- measurements ---------------------------------------------------------------------------------------------------


def settled(name: str = "o-10", loss: float = 0.0, seed: int = 0, burst_s: float = 0.0, phase_us: int = 0) -> Rig:
    """A link that has found itself on a clean air, which then becomes as lossy as asked."""
    rig = Rig(profile(name), RadioConfig(), seed)
    rig.settle()
    rig.run(phase_us * 1e-6)
    rig.pair.air.configure(RadioConfig(loss=loss, burst_s=burst_s))
    return rig


def upload(items: tuple[PlanItem, ...], loss: float, seed: int) -> tuple[float, int, bool]:
    """Seconds until the vessel's word, bytes of both ends for it, and whether it was yes."""
    rig = settled(loss=loss, seed=seed, phase_us=(seed * 617_000) % 5_000_000)
    since_us, before = rig.now_us, rig.twin.link.voice.bytes_out
    seconds, reply = rig.ask(compiled(items))
    answers = ANSWER_BYTES if loss == 0.0 else 0
    assert list(rig.sent(since_us)) or loss > 0.0
    return seconds, rig.twin.link.voice.bytes_out - before + answers, reply.result is Result.ACCEPTED


def mean_upload_s(items: tuple[PlanItem, ...], loss: float, runs: int) -> float:
    """Mean over many uploads, ten on each air; one that was given up counts with all its time."""
    total = 0.0
    rig = settled()
    for index in range(runs):
        if index % 10 == 0:
            rig = settled(loss=loss, seed=index)
        rig.run(4.0 + (index * 0.617) % 5.0)
        seconds, reply = rig.ask(compiled(items))
        total += seconds if reply.result is Result.ACCEPTED else max(seconds, rig.profile.link.upload_s)
    return total / runs


def disarm() -> tuple[RequestBody, Origin]:
    """What QGroundControl sends to disarm, and what it asks."""
    message = dialect.MAVLink_command_long_message(
        target_system=1,
        target_component=1,
        command=400,
        confirmation=0,
        param1=0,
        param2=0,
        param3=0,
        param4=0,
        param5=0,
        param6=0,
        param7=0,
    )
    return Arm(False), Origin(message.get_msgId(), payload(message), (255, 190), home_item=True)


def stop_s(body: RequestBody, origin: Origin, phases: int, spread_us: int) -> float:
    """Worst time from the order until the vessel is neutral, over phases spread between two states."""
    worst = 0.0
    rig = settled()
    for index in range(phases):
        if index % 50 == 0:
            rig = settled(seed=index)
        rig.run(6.0 + spread_us * 1e-6 * index / phases)
        start_us = rig.now_us
        rig.vessel.under_way_again()
        rig.ask(body, origin=origin)
        assert rig.vessel.neutral_us is not None
        worst = max(worst, (rig.vessel.neutral_us - start_us) * 1e-6)
    return worst


def stop_bytes() -> int:
    rig = settled()
    since_us = rig.now_us
    body, origin = disarm()
    rig.ask(body, origin=origin)
    return max(size for origin, size in rig.sent(since_us) if origin == "shore")


def state_rows() -> list[Row]:
    """Sizes and intervals of states over two simulated hours."""
    rig = Rig(profile("o-10"))
    rig.run(7200.0)
    frames = [item for item in rig.pair.air.log if item.origin == "vessel" and item.start_us > 3_600_000_000]
    sizes = {kind: max((len(item.data) for item in frames if item.data[0] >> 4 == kind), default=0) for kind in Kind}
    states = sorted(item.end_us for item in frames if item.data[0] >> 4 in (Kind.KEY, Kind.DELTA))
    gaps = [(later - earlier) * 1e-6 for earlier, later in itertools.pairwise(states)]
    thrifty = Rig(profile("n-0.1"), step_us=50_000)
    thrifty.run(4 * 3600.0)
    batches = [item for item in thrifty.pair.air.log if item.origin == "vessel" and item.data[0] >> 4 == Kind.BATCH]
    span_s = (batches[-1].end_us - batches[0].end_us) * 1e-6
    per_sample_s = span_s / (14 * (len(batches) - 1))
    return [
        row("LoRa state, difference", sizes[Kind.DELTA], "bytes", "<= 11"),
        row("LoRa state, key", sizes[Kind.KEY], "bytes", "<= 23"),
        row("LoRa state, batch of 14", max(len(item.data) for item in batches), "bytes", "<= 62"),
        row("LoRa state interval inside 10 %", sum(gaps) / len(gaps), "s", "<= 5"),
        row("LoRa state interval inside 0.1 %, per sample", per_sample_s, "s", "<= 130"),
        row("LoRa worst hour of the vessel, 10 %", rig.pair.air.worst_hour_us("vessel") * 1e-6, "s", "<= 360"),
        row("LoRa worst hour of the vessel, 0.1 %", thrifty.pair.air.worst_hour_us("vessel") * 1e-6, "s", "<= 3.6"),
    ]


def idle_bytes() -> int:
    """What the shore sends in an hour with a station present, beside beacons, once the ends know each other."""
    rig = settled()
    since_us = rig.now_us
    rig.run(3600.0)
    shore = [item for item in rig.pair.air.log if item.origin == "shore" and item.start_us >= since_us]
    return sum(len(item.data) for item in shore if item.data[0] >> 4 != Kind.BEACON)


def soak(name: str, loss: float, hours: float, seed: int) -> dict[str, int]:
    """Commands and uploads at random over a lossy, bursty air; what must never happen is counted."""
    rig = Rig(profile(name), RadioConfig(loss=loss, burst_s=8.0 if loss else 0.0), seed, step_us=50_000)
    rng = random.Random(seed)
    asked: dict[object, RequestBody] = {}
    end_us = round(hours * HOUR_US)
    mean_s = 120.0 if name == "o-10" else 900.0
    next_us, number = 5_000_000, 0
    while rig.now_us < end_us:
        rig.step()
        if rig.now_us >= next_us:
            next_us += round(rng.expovariate(1.0 / mean_s) * 1e6)
            number += 1
            body, origin = _something(rng, number)
            asked[number] = body
            rig.twin.submit(number, body, rig.now_us, origin)
    rig.run(120.0)
    return _judge(rig, asked)


def _something(rng: random.Random, number: int) -> tuple[RequestBody, Origin | None]:
    """A plan, a parameter or a command that no other one of the run equals, so that executions can be counted."""
    x, y = 411_812_345 + number * 7, -86_987_654 + rng.randrange(1000)
    choice = rng.random()
    if choice < 0.4:
        return compiled((plan_item(19, (float(100 + number % 500), 0.0, 40.0, 0.0), at_e7=(x, y)),)), None
    if choice < 0.7:
        return SetParameter("LOIT_RADIUS", float(number)), None
    message = dialect.MAVLink_command_int_message(
        target_system=1,
        target_component=1,
        frame=6,
        command=192,
        current=0,
        autocontinue=0,
        param1=1.5,
        param2=1.0,
        param3=0.0,
        param4=NAN,
        x=x,
        y=y,
        z=NAN,
    )
    origin = Origin(message.get_msgId(), payload(message), (245, 190), home_item=True)
    meant = meaning_of(origin, Context(True, 0, 0, None), (1, 1))
    assert not isinstance(meant, Reply)
    return meant, origin


def _judge(rig: Rig, asked: dict[object, RequestBody]) -> dict[str, int]:
    done = [body for _, body in rig.vessel.executed]
    twice = sum(1 for index, body in enumerate(done) if body in done[:index])
    accepted = {owner for _, owner, reply in rig.replies if reply.result is Result.ACCEPTED}
    false = sum(1 for owner in accepted if asked[owner] not in done)
    limit_us = rig.profile.hour_us or HOUR_US
    over = sum(rig.pair.air.worst_hour_us(origin) > limit_us for origin in ("vessel", "shore"))
    return {"violations": over, "false": false, "twice": twice, "asked": len(asked), "accepted": len(accepted)}


def forged(count: int, seed: int = 5) -> int:
    """Random, replayed and bit-flipped frames that a receiver believes."""
    rng = random.Random(seed)
    ends = acquainted()
    shore = ends[RadioDirection.TO_VESSEL]
    assert shore.current is not None
    sealer, opener = Sealer(shore), Opener(ends[RadioDirection.TO_SHORE])
    good = [sealer.seal(Kind.STOP, rng.randbytes(rng.randrange(2, 8)), 0, shore.current) for _ in range(32)]
    assert sum(len(opener.receive(frame, 0)) for frame in good) == len(good)
    believed = 0
    for index in range(count):
        frame = good[index % len(good)]
        if index % 3 == 0:
            raw = bytearray(frame)
            place = rng.randrange(len(raw) * 8)
            raw[place // 8] ^= 1 << place % 8
            frame = bytes(raw)
        elif index % 3 == 1:
            body = rng.randbytes(rng.randrange(0, 8))
            head = rng.randrange(15) << 12 | len(body) << 6 | rng.randrange(64)
            frame = head.to_bytes(2, "big") + body + rng.randbytes(TAG_BYTES)
        believed += len(opener.receive(frame, 0))
    return believed


def exact_share(count: int, seed: int = 3) -> float:
    """Share of random plans whose items come back with the very same bytes."""
    rng = random.Random(seed)
    same = 0
    for _ in range(count):
        items = tuple(_random_item(rng) for _ in range(rng.randrange(0, 12)))
        _, back = decode_plan(
            encode_plan(PlanKind.MISSION, items, (411_850_123, -87_062_154)), (411_850_000, -87_062_000)
        )
        same += check_of(back) == check_of(items) and len(back) == len(items)
    return same / count


def exact_commands(count: int, seed: int = 4) -> float:
    """Share of random COMMAND_LONG and COMMAND_INT frames whose payload comes back with the very same bytes."""
    rng = random.Random(seed)
    same = 0
    for _ in range(count):
        long = rng.random() < 0.5
        usual = (0, 0x3F80_0000, 0xBF80_0000, 0x7FC0_0000, 0x7F80_0001, 0x8000_0000, rng.getrandbits(32))
        words = [rng.choice(usual) for _ in range(7)]
        command = rng.choice((400, 176, 192, 300, 16, rng.randrange(65536)))
        tail = [rng.choice((0, 1, rng.randrange(256))) for _ in range(3 if long else 5)]
        data = struct.pack("<7IH3B" if long else "<7IH5B", *words, command, *tail)
        origin = Origin(76 if long else 75, trimmed(data), (rng.choice((255, 245, 7)), 190), rng.random() < 0.5)
        same += decode_command(encode_command(origin, (1, 1)), (1, 1)) == origin
    return same / count


def _random_item(rng: random.Random) -> PlanItem:
    def real() -> float:
        raw = struct.pack("<I", rng.getrandbits(32))
        wild: float = struct.unpack("<f", raw)[0]
        return rng.choice([0.0, 1.0, -1.0, 20.0, 1.5, NAN, wild])

    command, frame = rng.choice([16, 16, 16, 17, 18, 19, 178, 177, 93, rng.randrange(65536)]), rng.choice([3, 6, 2])
    at_e7 = 411_850_123 + rng.randrange(-9999, 9999), -87_062_154 + rng.randrange(-9999, 9999)
    params = (real(), real(), real(), real())
    return plan_item(command, params, at_e7=at_e7, frame=frame, z=real(), autocontinue=rng.choice([1, 1, 0]))


def plan_rows(runs: int) -> list[Row]:
    """Uploads and stops."""
    short, long = loiter_items(), survey_items(100)
    seconds, size, _ = upload(short, 0.0, 0)
    long_s, long_size, _ = upload(long, 0.0, 0)
    thrifty = Rig(profile("n-0.1"))
    thrifty.run(30.0)
    _, refused = thrifty.ask(compiled(long))
    return [
        row("LoRa loiter plan, both ways", size, "bytes", "<= 35"),
        row("LoRa loiter plan confirmed, no loss", seconds, "s", "<= 1.5"),
        row("LoRa loiter plan confirmed, 30 % loss, mean", mean_upload_s(short, 0.3, runs), "s", "<= 3"),
        row("LoRa loiter plan confirmed, 50 % loss, mean", mean_upload_s(short, 0.5, runs), "s", "<= 5"),
        row("LoRa 100 waypoints", long_size, "bytes", "<= 470"),
        row("LoRa 100 waypoints confirmed, no loss", long_s, "s", "<= 8.5"),
        row(
            "LoRa 100 waypoints confirmed, 50 % loss, mean", mean_upload_s(long, 0.5, max(runs // 4, 10)), "s", "<= 20"
        ),
        row("LoRa 100 waypoints accepted at 0.1 %", float("airtime" not in refused.reason), "", "= 0"),
        row("LoRa stop order", stop_bytes(), "bytes", "<= 12"),
        row("LoRa stop until neutral, channel idle", stop_s(*disarm(), 5, 1), "s", "<= 1.0"),
        row("LoRa stop until neutral, worst of 200 phases", stop_s(*disarm(), 200, 5_000_000), "s", "<= 1.6"),
    ]


def run(*, quick: bool = False) -> list[Row]:
    """The whole table; ``quick`` takes fewer repetitions."""
    rows = state_rows() + plan_rows(60 if quick else 200)
    rows.append(row("LoRa shore bytes in an idle hour beside beacons", idle_bytes(), "bytes", "= 0"))
    for name in ("o-10", "n-0.1"):
        for loss in (0.0, 0.3, 0.6):
            found = soak(name, loss, 0.25 if quick else 1.0, seed=round(loss * 10))
            title = f"LoRa {name} at {loss * 100:.0f} % loss, an hour"
            for what in ("violations", "false", "twice"):
                row_name = {
                    "violations": "ledger violations",
                    "false": "false 'uploaded'",
                    "twice": "double executions",
                }
                rows.append(row(f"{title}: {row_name[what]}", found[what], "", "= 0"))
    rows.append(
        row("LoRa forged, replayed, flipped frames believed", forged(20_000 if quick else 1_000_000), "", "= 0")
    )
    rows.append(
        row(
            "LoRa COMMAND frames rebuilt byte for byte",
            100.0 * exact_commands(3000 if quick else 100_000),
            "%",
            "= 100",
        )
    )
    rows.append(row("LoRa plans rebuilt byte for byte", 100.0 * exact_share(300 if quick else 3000), "%", "= 100"))
    return rows


if __name__ == "__main__":
    for line in run(quick=True):
        print(
            f"{line['name']:60} {line['value']:10} {line['unit']:6} {line['bar']:8} {'yes' if line['holds'] else 'NO'}"
        )
