"""Thresholds that nothing reaches, or everything: what they watch for would never be told, or always."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from typing import Final

from ..core.board.actuator_map import ChannelConfig
from ..core.estimate import EstimatorConfig
from ..core.hull import VesselConfig
from ..core.hull.statics import Statics, top_speed_mps
from ..settings import Settings

_SLOWEST_MPS: Final = 0.1
"""The slowest cruise there is; any breath of wind sets a boat faster."""
_LEAST_US: Final = 50
"""A tenth of the usual way from stop to full: within it most motor controllers stand still."""
_MUCH: Final = 0.75
"""A trim takes a few per cent of one side's way; who loses a quarter should know."""
_NAME_CHARS: Final = 25
"""Half of a STATUSTEXT's 50: a longer name leaves no room for what a text says of the link."""
_OLD_S: Final = 3.0
"""A sensor that is silent for so long is lost, and no guess should stand in for longer."""
_SHIPS: Final = ("2", "3", "4", "5", "6", "7", "98")
"""How numbers of vessels begin, and of craft that belong to one; others are of coasts, aircraft, buoys and men overboard."""


def threshold_mistakes(settings: Settings) -> list[str]:
    """Thresholds of a vessel's settings that cannot be meant, whatever her hull."""
    return [*_limits(settings), *_ages(settings), *_lists(settings), *_identity(settings), *pulse_mistakes(settings)]


def hull_threshold_mistakes(settings: Settings, vessel: VesselConfig) -> list[str]:
    """Those that this hull never reaches."""
    return [
        *_never_so_fast(settings, vessel),
        *_never_so_quick(settings, vessel),
        *_never_so_near(settings, vessel),
        *_never_cut(settings, vessel),
    ]


def threshold_warnings(settings: Settings) -> list[str]:
    """What may be meant, and should be looked at."""
    return [*_cut(settings), *_twice(settings), *_room(settings), *_tight(settings)]


def _limits(settings: Settings) -> Iterator[str]:
    monitors = settings.monitors
    swings, window_s = monitors.oscillation_reversals, monitors.oscillation_window_s
    if swings >= window_s * settings.system.tick_hz:
        yield (
            f"monitors.oscillation_reversals = {swings}: {window_s:g} s have {window_s * settings.system.tick_hz:g} ticks, and no loop "
            "swings so often; fewer, or a longer oscillation_window_s"
        )
    if settings.depth.enabled and settings.depth.input.quality_min >= 1.0:
        yield "depth.input.quality_min = 1: hardly any echo is perfect, and the depth would be unknown; about 0.05"
    station = settings.guidance.station
    if station.mode == "weathervane" and station.calm_mps >= station.speed_mps:
        yield (
            f"guidance.station.calm_mps = {station.calm_mps:g}: must be less than speed_mps {station.speed_mps:g}; "
            "what carries her as fast is no calm, and she would not come back"
        )
    if 0.0 < settings.modes.return_speed_mps < _SLOWEST_MPS:
        yield (
            f"modes.return_speed_mps = {settings.modes.return_speed_mps:g}: any current carries her faster; "
            f"at least {_SLOWEST_MPS:g}, or 0 for the cruise speed"
        )


def _ages(settings: Settings) -> Iterator[str]:
    """What is too old when it comes, and limits that stretch to less than they begin with."""
    estimate = settings.estimate
    for key, longest, shortest in (
        ("slow_receiver_s", estimate.slow_receiver_s, "position_timeout_s"),
        ("slow_compass_s", estimate.slow_compass_s, "heading_timeout_s"),
    ):
        if key in estimate.model_fields_set and longest < getattr(estimate, shortest):
            yield f"estimate.{key} = {longest:g}: less than {shortest} {getattr(estimate, shortest):g}, which it is to lengthen"
    for number, item in enumerate(settings.sensors):
        for key, late_s, limit, limit_s in (
            ("position_latency_s", item.nmea.position_latency_s, "position_timeout_s", _longest(estimate, "position", "receiver")),
            ("heading_latency_s", item.nmea.heading_latency_s, "heading_timeout_s", _longest(estimate, "heading", "compass")),
        ):  # fmt: skip
            if late_s >= limit_s:
                yield (
                    f"sensors.{number}.nmea.{key} = {late_s:g}: what comes is older than estimate.{limit} allows even a slow one, "
                    f"{limit_s:g} s, and would never count; less, or a longer limit"
                )


def _longest(estimate: EstimatorConfig, what: str, slow: str) -> float:
    """How old a value may be of the slowest sensor that is waited for, s."""
    base_s, slow_s = getattr(estimate, f"{what}_timeout_s"), getattr(estimate, f"slow_{slow}_s")
    return max(float(base_s), float(slow_s))


def _lists(settings: Settings) -> Iterator[str]:
    """A sentence that is wanted and forbidden."""
    for number, item in enumerate(settings.sensors):
        names = _sentences(item.nmea.sentences)
        both = next((name for name in names if f"-{name}" in names), "")
        if both:
            yield f"sensors.{number}.nmea.sentences = {item.nmea.sentences!r}: wants and forbids {both}; leave out one of the two"


def _sentences(text: str) -> list[str]:
    return [name.strip().upper() for name in text.split(",") if name.strip()]


def _identity(settings: Settings) -> Iterator[str]:
    """Who the boat is to others, and when her receiver's dates begin."""
    own = settings.traffic.own_mmsi
    if own >= 10**8 and not str(own).startswith(_SHIPS):
        yield f"traffic.own_mmsi = {own}: is no vessel's number, which begins with 2 to 7; 0 when there is no transponder"
    year = time.gmtime().tm_year
    for number, item in enumerate(settings.sensors):
        earliest = item.nmea.earliest_year
        if "earliest_year" in item.nmea.model_fields_set and 2025 <= year < earliest:
            yield f"sensors.{number}.nmea.earliest_year = {earliest}: it is {year}, and no time would be believed before then"
    for name in settings.page.names:
        if "*" in name:
            yield f"page.names: {name!r} is no name; write each name out"


def _travels(settings: Settings) -> Iterator[tuple[str, str, int, int]]:
    """Each side of each channel: its key, which pulse ends it, how far it goes from the middle, and how far within the bounds, us."""
    board = settings.actuators.board
    for name in ("thruster_port", "thruster_starboard", "rudder_port", "rudder_starboard"):
        channel: ChannelConfig = getattr(board, name)
        ends = (
            (channel.us_minus, channel.us_plus) if channel.encoding == "bipolar" else (board.lower_us, board.upper_us)
        )
        middle_us = channel.us_zero if channel.encoding == "bipolar" else sum(ends) // 2
        for side, end_us in zip(("minus", "plus"), ends, strict=True):
            middle, end = (min(max(us + channel.trim_us, board.lower_us), board.upper_us) for us in (middle_us, end_us))
            yield (
                f"actuators.board.{name}",
                f"{side} pulse {end_us + channel.trim_us}",
                abs(end_us - middle_us),
                abs(end - middle),
            )


def pulse_mistakes(settings: Settings) -> Iterator[str]:
    """Bounds that leave an actuator where it is."""
    for key, end, _, left_us in _travels(settings):
        if left_us < _LEAST_US:
            yield (
                f"{key}: its {end} comes {left_us} us from the middle, and nothing moves; look at its pulses, trim_us, and "
                f"actuators.board.lower_us {settings.actuators.board.lower_us} and upper_us {settings.actuators.board.upper_us}"
            )
            return


def _cut(settings: Settings) -> Iterator[str]:
    """A trim or a bound that takes much of one side's way."""
    for key, end, said_us, left_us in _travels(settings):
        if _LEAST_US <= left_us < _MUCH * said_us:
            yield f"{key}: its {end} is cut off by lower_us or upper_us, {100 * left_us // said_us} % of that side are left"


def _twice(settings: Settings) -> Iterator[str]:
    """What stands twice in one list was perhaps meant as another."""
    lists = [("operator.ids", map(str, settings.operator.ids)), ("page.names", iter(settings.page.names))]
    for number, item in enumerate(settings.sensors):
        lists.append((f"sensors.{number}.nmea.sentences", iter(_sentences(item.nmea.sentences))))
        lists.append((f"sensors.{number}.nmea.talkers", iter(item.nmea.talkers)))
    for key, entries in lists:
        for entry, count in Counter(entries).items():
            if count > 1:
                yield f"{key}: {entry} stands there {count} times; was another meant?"


def _room(settings: Settings) -> Iterator[str]:
    """How near another vessel may come, how long a guess may stand in, and one plan's word that would stand for ever."""
    traffic, estimate = settings.traffic, settings.estimate
    if traffic.enabled and traffic.small_distance_m > traffic.ship_distance_m:
        yield (
            f"traffic.small_distance_m = {traffic.small_distance_m:g}: more room from a boat than from a ship, ship_distance_m "
            f"{traffic.ship_distance_m:g}; were the two exchanged?"
        )
    for key, guess_s in (("position_hold_s", estimate.position_hold_s), ("heading_hold_s", estimate.heading_hold_s)):
        if guess_s > _OLD_S:
            way_m = guess_s * settings.mission.cruise_speed_mps
            yield f"estimate.{key} = {guess_s:g}: she sails {way_m:.0f} m by a guess while what the sensor says is refused"
    if estimate.heading_jump_deg == 180.0:
        yield "estimate.heading_jump_deg = 180: no heading is ever a jump, whatever a compass says; about 25"
    if settings.mission.far_plan:
        yield f"mission.far_plan = {settings.mission.far_plan}: is one plan's word, for a station to give (PLAN_FAR_OK); leave it out here"
    names = [
        ("sensors", [item.name for item in settings.sensors]),
        ("endpoints", [item.name for item in settings.endpoints]),
    ]
    for table, called in names:
        for number, name in enumerate(called):
            if len(name) > _NAME_CHARS:
                yield f"{table}.{number}.name = {name!r}: texts have no room for so long a name; {_NAME_CHARS} characters at most"


def _never_so_fast(settings: Settings, vessel: VesselConfig) -> Iterator[str]:
    top_mps = top_speed_mps(vessel)
    for key, table, what in (
        ("estimate.course_speed_mps", settings.estimate, "the course would never stand in for a lost heading"),
        ("monitors.drift_mps", settings.monitors, "no drift would be told, and she would never be stuck"),
    ):
        name = key.rpartition(".")[2]
        speed_mps = getattr(table, name)
        if name in table.model_fields_set and speed_mps > top_mps:
            yield f"{key} = {speed_mps:g}: the hull reaches {top_mps:.1f} m/s: {what}; less"


def _never_so_quick(settings: Settings, vessel: VesselConfig) -> Iterator[str]:
    """Plans of speed that all thrust together could not follow; without thrust astern there is the drag."""
    ahead_n, astern_n = (
        vessel.thruster.count * newtons for newtons in (vessel.thruster.ahead_n, vessel.thruster.astern_n)
    )
    law, follow = settings.steering.model, settings.guidance.follow
    for key, table, wanted, force_n in (
        ("steering.model.acceleration", law, law.acceleration, ahead_n),
        ("guidance.follow.deceleration", follow, follow.deceleration, ahead_n + astern_n),
    ):
        most = force_n / vessel.hull.m11_kg
        if key.rpartition(".")[2] in table.model_fields_set and wanted > most:
            yield f"{key} = {wanted:g}: all her thrust gives {most:.1f} m/s^2; less"


def _never_cut(settings: Settings, vessel: VesselConfig) -> Iterator[str]:
    """A cut of the thrust that takes nothing off, because the gate lets no more through anyhow."""
    failsafe, most = settings.failsafe, settings.gate.thruster_max
    if "oscillation_thrust" in failsafe.model_fields_set:
        command = Statics(vessel).most_command(failsafe.oscillation_thrust)
        if command >= most:
            yield (
                f"failsafe.oscillation_thrust = {failsafe.oscillation_thrust:g}: takes an output of {command:.2f}, which must be less than "
                f"gate.thruster_max {most:g}; nothing would be taken off while the control swings"
            )


def _never_so_near(settings: Settings, vessel: VesselConfig) -> Iterator[str]:
    """A sounder that is deaf where the guard would have to stop."""
    depth = settings.depth
    below_m = vessel.keel_depth_m - vessel.transducer_depth_m
    nearest_m = depth.input.range_min_m - below_m
    if depth.enabled and 0.0 < depth.min_altitude_m <= nearest_m and "range_min_m" in depth.input.model_fields_set:
        yield (
            f"depth.input.range_min_m = {depth.input.range_min_m:g}: the sounder is deaf where the guard stops, "
            f"{depth.min_altitude_m:g} m under the keel; less than {depth.min_altitude_m + below_m:g}"
        )
    thrust = -settings.gate.thruster_min
    if 0.0 < thrust <= vessel.thruster.dead_band:
        yield (
            f"gate.thruster_min = {settings.gate.thruster_min:g}: no propeller turns at it; the hull file's dead_band is "
            f"{vessel.thruster.dead_band:g}: more, or 0 for no thrust astern"
        )


def _tight(settings: Settings) -> Iterator[str]:
    """A loiter that the law does not turn as tightly, however slowly."""
    guidance, law = settings.guidance, settings.steering.model
    turn_radps = law.yaw_rate_limit * guidance.follow.turn_share
    least_m = guidance.follow.speed_min_mps / turn_radps
    if settings.steering.profile == "model" and guidance.loiter_radius_m < least_m:
        yield (
            f"guidance.loiter_radius_m = {guidance.loiter_radius_m:g}: at {guidance.follow.speed_min_mps:g} m/s, the slowest in a bend "
            f"(guidance.follow.speed_min_mps), she turns no tighter than {least_m:.1f} m"
        )
