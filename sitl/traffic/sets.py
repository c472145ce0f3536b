"""Encounters to judge by: the 22 of Imazu, the 55 of DNV, random ones by seed, and narrow water.

An encounter is a straight leg of ours to the north and vessels that nobody warns. Sources: Imazu 1987 as tabled by Sawada, Sato and
Majima 2021 (cases 8 and 12 as argued in docs/TRAFFIC.md); DNV ship-traffic-generator's baseline situations (MIT); the random sets are ours.
"""

from __future__ import annotations

import csv
import math
import random
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mavlink_bridge.language.units import KNOT_MPS

from .target import ManoeuvreText, SilenceText, VesselText

CRUISE_MPS: Final = 1.5


@dataclass(frozen=True, slots=True)
class Encounter:
    """One leg among others."""

    name: str
    seed: str
    """What reports and losses are drawn from."""
    leg_m: float
    vessels: tuple[VesselText, ...]
    own_mps: float = CRUISE_MPS
    width_m: float | None = None
    """Of the channel around the leg; None: open water."""


_IMAZU: Final = """
1 180 | 2 270 | 3 0*0.7 | 4 45 | 5 180 270 | 6 350 315 | 7 0*0.7 315 | 8 180 90 | 9 330 270 | 10 270 15 | 11 90 330
| 12 180 315 350 | 13 180 10 45 | 14 350 315 270 | 15 0*0.7 315 270 | 16 45*0.7 90 270 | 17 0*0.7 10 315 | 18 225 345 330
| 19 15 345 225 | 20 0*0.7 345 270 | 21 345 15 270 | 22 0*0.7 315 270
"""
"""Number, then each vessel's course and, where it is not ours, her speed over ours."""


def imazu(own_mps: float = CRUISE_MPS, factor: float = 1.0) -> list[Encounter]:
    """All 22 at boat scale: 300 s to the meeting. ``factor`` 1: boats of 12 m at our speed; 4: ships of 60 m, four times as fast."""
    time_s = 300.0
    length_m, ais = (12.0, "B") if factor < 2.0 else (60.0, "A")
    found = []
    for row in _IMAZU.replace("\n", " ").split("|"):
        number, *others = row.split()
        vessels = []
        for other in others:
            course, _, share = other.partition("*")
            speed, angle = float(share or 1.0) * own_mps * factor, math.radians(float(course))
            vessels.append(
                VesselText(
                    ais=ais,
                    north_m=own_mps * time_s - speed * time_s * math.cos(angle),
                    east_m=-speed * time_s * math.sin(angle),
                    course_deg=float(course),
                    speed_mps=speed,
                    length_m=length_m,
                )
            )
        seed = f"imazu-{factor:g}-{own_mps:g}-{number}"
        found.append(Encounter(seed, seed, 2.0 * own_mps * time_s, tuple(vessels), own_mps))
    return found


def dnv(path: Path, own_mps: float = CRUISE_MPS, *, similar: bool = False) -> list[Encounter]:
    """The 55 situations. ``similar``: scaled to our speed, ships become boats; else real ships on a meeting 200 to 600 s ahead."""
    cases: dict[int, list[VesselText]] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            cases.setdefault(int(row["case"]), []).append(_dnv_vessel(row, own_mps, similar=similar))
    kind = "similar" if similar else "real"
    leg_m = own_mps * (2000.0 if similar else 700.0)
    names = {number: f"dnv-{kind}-{own_mps:g}-{number}" for number in cases}
    return [Encounter(names[number], names[number], leg_m, tuple(cases[number]), own_mps) for number in sorted(cases)]


def _dnv_vessel(row: dict[str, str], own_mps: float, *, similar: bool) -> VesselText:
    angle, speed = math.radians(float(row["cog_deg"])), float(row["sog_kn"]) * KNOT_MPS
    length_m, beam_m = float(row["length_m"]), float(row["beam_m"])
    if similar:
        scale = own_mps / (float(row["own_sog_kn"]) * KNOT_MPS)
        north, east = float(row["north_m"]) * scale, float(row["east_m"]) * scale
        speed, length_m, beam_m = speed * scale, max(8.0, 0.1 * length_m), max(2.5, 0.1 * beam_m)
    else:
        meet_s = float(row["tcpa_s"]) / 3.0
        north = own_mps * meet_s - speed * math.cos(angle) * meet_s
        east = -speed * math.sin(angle) * meet_s
    return VesselText(
        ais="B" if similar else "A",
        north_m=north,
        east_m=east,
        course_deg=math.degrees(angle),
        speed_mps=speed,
        length_m=length_m,
        beam_m=beam_m,
    )


_KINDS: Final = (("ship", 0.4), ("small", 0.4), ("fast", 0.1), ("anchored", 0.1))


def random_set(
    count: int, seed: int, *, channel: bool = False, silent_share: float = 0.0, first: int = 0
) -> Iterator[Encounter]:
    """Random encounters, each by its own number: 1 to 5 vessels that pass near our place 120 to 550 s ahead.

    40 % ships, 40 % small ones, 10 % fast, 10 % anchored; a quarter of small and fast ones turn shortly before; 15 % have a silent span.
    ``channel``: 60 to 160 m wide, ships along it. ``silent_share`` have no AIS at all.
    """
    for number in range(first, first + count):
        name = f"{'channel' if channel else 'random'}-{seed}-{number}"
        rng = random.Random(name)
        vessels = [_random_vessel(rng, channel=channel, silent_share=silent_share) for _ in range(rng.randint(1, 5))]
        kept = tuple(v for v in vessels if math.hypot(v.north_m, v.east_m) >= 150.0 + v.length_m)
        yield Encounter(name, name, 900.0, kept, width_m=rng.uniform(60.0, 160.0) if channel else None)


def _random_vessel(rng: random.Random, *, channel: bool, silent_share: float) -> VesselText:
    kind = rng.choices([name for name, _ in _KINDS], [share for _, share in _KINDS])[0]
    speed, length = {
        "ship": (rng.uniform(3.0, 10.0), rng.uniform(25.0, 200.0)),
        "small": (rng.uniform(1.0, 8.0), rng.uniform(5.0, 18.0)),
        "fast": (rng.uniform(10.0, 18.0), rng.uniform(15.0, 60.0)),
        "anchored": (0.0, rng.uniform(8.0, 120.0)),
    }[kind]
    class_a = {"ship": True, "small": False, "fast": length > 25.0, "anchored": length > 30.0}[kind]
    angle = rng.choice((0.0, math.pi)) + rng.gauss(0.0, 0.05) if channel else rng.uniform(-math.pi, math.pi)
    meet_s = rng.uniform(120.0, 550.0)
    off = rng.uniform(-1.0, 1.0) * (60.0 if kind == "small" else 100.0) * (0.3 if channel else 1.0)
    north = CRUISE_MPS * meet_s - off * math.sin(angle) - speed * meet_s * math.cos(angle)
    east = off * math.cos(angle) - speed * meet_s * math.sin(angle)
    if not speed and abs(east) < 15.0:
        east += math.copysign(length / 2.0, east)  # not straight on the line
    return VesselText(
        ais="none" if rng.random() < silent_share else "A" if class_a else "B",
        north_m=north,
        east_m=east,
        course_deg=math.degrees(angle),
        speed_mps=speed,
        length_m=length,
        status=1 if kind == "anchored" and class_a else 0,
        manoeuvres=_turn(rng, meet_s) if kind in ("small", "fast") and rng.random() < 0.25 else (),
        silent=_silence(rng, meet_s) if rng.random() < 0.15 else (),
    )


def _turn(rng: random.Random, meet_s: float) -> tuple[ManoeuvreText, ...]:
    angle = rng.uniform(20.0, 90.0) * rng.choice((-1, 1))
    return (ManoeuvreText(at_s=meet_s - rng.uniform(10.0, 100.0), turn_deg=angle),)


def _silence(rng: random.Random, meet_s: float) -> tuple[SilenceText, ...]:
    start_s = rng.uniform(0.0, meet_s)
    return (SilenceText(from_s=start_s, to_s=start_s + rng.uniform(30.0, 150.0)),)


SETS: Final[dict[str, Callable[[int, int], Iterable[Encounter]]]] = {
    "imazu": lambda count, seed: imazu()[:count],
    "imazu-x4": lambda count, seed: imazu(factor=4.0)[:count],
    "random": random_set,
    "channel": lambda count, seed: random_set(count, seed, channel=True),
}
"""Sets that need nothing but a count and a seed."""


def by_name(name: str) -> Encounter | None:
    """One encounter of these sets by the name that it was judged under; None: no set makes such a name."""
    kind, _, rest = name.rpartition("-")
    number, seed = int(rest) if rest.isdecimal() else -1, kind.partition("-")[2]
    if number < 0:
        return None
    if seed.isdecimal() and kind.startswith(("random-", "channel-")):
        (found,) = random_set(1, int(seed), channel=kind.startswith("channel-"), first=number)
        return found
    return next((each for each in (*imazu(), *imazu(factor=4.0)) if each.name == name), None)
