"""Combinations of settings that cannot be meant, though each value alone is possible: told with key, value and mend."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from ..core.hull import VesselConfig
from ..core.hull.statics import top_speed_mps
from ..core.steer.gain_check import gains_problem
from ..settings import Settings
from ..settings.schema import EndpointSettings
from .carriers import carrier_mistakes
from .places import place_mistakes
from .thresholds import hull_threshold_mistakes, threshold_mistakes
from .values import hull_value_mistakes, value_mistakes

MAX_GUARD_M: Final = 50.0
"""More water than this under a small boat's keel is no guard but a unit: 400 are centimetres, or feet."""
_RESERVED: Final = ("actuators", "radio", "plotter")
"""Names of links that have no list; recordings and texts tell links apart by their names."""


def vessel_meaning(settings: Settings) -> list[str]:
    """What cannot be meant of a vessel's settings, whatever her hull."""
    return [
        *_sensors(settings),
        *_names(
            [("sensors", settings.sensors), ("endpoints", settings.endpoints)],
            dict.fromkeys(_RESERVED, "a part of the program"),
        ),
        *_distances(settings),
        *_actuators(settings),
        *_people(settings),
        *_water(settings),
        *_keys(settings),
        *value_mistakes(settings),
        *place_mistakes(settings),
        *carrier_mistakes(settings),
        *threshold_mistakes(settings),
        *_open_or_shut(settings.endpoints),
    ]


def hull_meaning(settings: Settings, vessel: VesselConfig) -> list[str]:
    """What cannot be meant of them on this hull."""
    return [
        *_speeds(settings, vessel),
        *hull_value_mistakes(settings, vessel),
        *hull_threshold_mistakes(settings, vessel),
    ]


def plain_meaning(settings: Settings, vessel: VesselConfig) -> list[str]:
    """What cannot be meant of values alone: no disk, no line and no clock is looked at."""
    return [
        *_distances(settings),
        *_actuators(settings),
        *_water(settings),
        *value_mistakes(settings),
        *_speeds(settings, vessel),
        *hull_value_mistakes(settings, vessel),
    ]


def gain_mistakes(settings: Settings, vessel: VesselConfig) -> list[str]:
    """Gains that leave the heading or the speed no margin."""
    problem = gains_problem(settings.steering, vessel)
    return [f"steering.model: {problem}"] if problem else []


def endpoint_mistakes(endpoints: Sequence[EndpointSettings]) -> list[str]:
    """What cannot be meant of a gateway's links to stations."""
    return [*_names([("endpoints", endpoints)], {}), *_open_or_shut(endpoints)]


def _open_or_shut(endpoints: Sequence[EndpointSettings]) -> Iterator[str]:
    for number, item in enumerate(endpoints):
        if item.insecure and item.link_class != "trusted":
            yield (
                f'endpoints.{number}.insecure = true: link_class = "{item.link_class}" is what it would open; '
                "leave out one of the two"
            )


def _sensors(settings: Settings) -> Iterator[str]:
    if not settings.sensors:
        yield "sensors: missing; add [[sensors]] with name and url: nothing else tells the vessel where it is"
    for number, item in enumerate(settings.sensors):
        if not item.url:
            yield f'sensors.{number}.url: missing; give the compass\' device or address, e.g. "serial:/dev/ttyS0?baud=115200"'


def _names(lists: Iterable[tuple[str, Sequence[object]]], known: dict[str, str]) -> Iterator[str]:
    """Links are told apart by their names. ``known``: those that are taken, and by whom."""
    for table, items in lists:
        for number, item in enumerate(items):
            name = getattr(item, "name", "")
            if not name.strip():
                yield f"{table}.{number}.name = {name!r}: is empty; give it a name that texts and logs can use"
            elif not name.isprintable():
                yield f"{table}.{number}.name = {name!r}: holds what no screen shows; give it a name that texts and logs can use"
            elif name in known:
                yield f"{table}.{number}.name = {name!r}: is the name of {known[name]} already; give each link its own"
            known.setdefault(name, f"{table} {name!r}")


def _speeds(settings: Settings, vessel: VesselConfig) -> Iterator[str]:
    top_mps = top_speed_mps(vessel)
    most_mps = math.floor(100.0 * top_mps) / 100.0
    for key, speed_mps in (
        ("mission.cruise_speed_mps", settings.mission.cruise_speed_mps),
        ("modes.return_speed_mps", settings.modes.return_speed_mps),
        ("depth.unknown_speed_mps", settings.depth.unknown_speed_mps),
        ("depth.slow_least_mps", settings.depth.slow_least_mps),
        ("guidance.follow.speed_min_mps", settings.guidance.follow.speed_min_mps),
        ("guidance.station.speed_mps", settings.guidance.station.speed_mps),
    ):
        if speed_mps > top_mps:
            yield f"{key} = {speed_mps:g}: more than the hull's top speed; at most {most_mps:g} m/s, or another vessel file"
    cruise_mps = settings.mission.cruise_speed_mps
    for key, said, speed_mps in (
        (
            "guidance.follow.speed_min_mps",
            settings.guidance.follow.model_fields_set,
            settings.guidance.follow.speed_min_mps,
        ),
        ("depth.slow_least_mps", settings.depth.model_fields_set, settings.depth.slow_least_mps),
    ):
        if key.rpartition(".")[2] in said and cruise_mps < speed_mps <= top_mps:
            yield f"{key} = {speed_mps:g}: more than mission.cruise_speed_mps {cruise_mps:g}; it would never be slower"


def _distances(settings: Settings) -> Iterator[str]:
    if settings.mission.leg_distance_m < settings.mission.first_distance_m:
        yield (
            f"mission.leg_distance_m = {settings.mission.leg_distance_m:g}: less than first_distance_m "
            f"{settings.mission.first_distance_m:g}; the first way is a leg too"
        )


def _actuators(settings: Settings) -> Iterator[str]:
    board, gate = settings.actuators.board, settings.gate
    if board.too_slow:
        yield (
            f"actuators.board.frequency_hz = {board.frequency_hz:g}: the board stops between two commands and the vessel never arms; "
            f"raise it, or silence_ms {board.silence_ms}"
        )
    if board.frequency_hz > settings.system.tick_hz:
        yield (
            f"actuators.board.frequency_hz = {board.frequency_hz:g}: commands go out on ticks; at most system.tick_hz "
            f"{settings.system.tick_hz}"
        )
    if gate.thruster_max == 0.0:
        yield "gate.thruster_max = 0: the vessel could never go ahead; to keep it still leave actuators.url empty"
    if board.sketch and board.level == "1":
        yield f'actuators.board.sketch = {board.sketch!r}: is how a level-0 sketch reads; level = "1" never speaks to one'


def _people(settings: Settings) -> Iterator[str]:
    """Somebody must be able to give orders, and to be heard."""
    heard = [item for item in settings.endpoints if item.link_class != "telemetry"]
    if heard or settings.radio.url:
        return
    has = "every one is for telemetry only" if settings.endpoints else "there is none"
    yield f"endpoints: {has} and no radio is set: nobody could arm or stop the vessel; add one that takes orders"


def _water(settings: Settings) -> Iterator[str]:
    depth = settings.depth
    if depth.enabled and depth.min_altitude_m > MAX_GUARD_M:
        yield f"depth.min_altitude_m = {depth.min_altitude_m:g}: metres under the keel, at most {MAX_GUARD_M:g}; were centimetres meant?"
    if depth.required and not depth.enabled:
        yield "depth.required = true: the guard itself is off; set depth.enabled = true, or required = false"


def _keys(settings: Settings) -> Iterator[str]:
    radio, security = settings.radio, settings.security
    if radio.key_file and not radio.url:
        yield f"radio.key_file = {radio.key_file!r}: there is no radio; give radio.url, or leave the key out"
    if radio.url and radio.key_file and radio.protocol != "compact":
        yield f'radio.protocol = {radio.protocol!r}: uses no key, and radio.key_file names one; "compact" does'
    if security.key_file and not any(item.link_class == "signed" for item in settings.endpoints):
        yield f'security.key_file = {security.key_file!r}: no endpoint has link_class = "signed", so nothing is signed with it'
