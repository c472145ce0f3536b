"""Values held against each other: each alone is possible, together they switch off what they are meant to set."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from mavlink_bridge.language.messages import Action

from ..core.board.wire import encode_level1
from ..core.config import Config
from ..core.hull import VesselConfig
from ..core.hull.statics import throttle_to_speed, top_speed_mps
from ..core.nmea.wanted import WantedSentences, unknown_names
from ..io.links import LinkConfigError, parse_link_url
from ..settings import Settings
from ..settings.schema import ActuatorLinkConfig, SensorConfig

_ORDERED: Final = (
    ("monitors.battery_empty_v", "monitors.battery_critical_v", "the boat would stop before it returns"),
    ("monitors.battery_critical_v", "monitors.battery_low_v", "the boat would return before it warns"),
    ("monitors.battery_empty_v", "monitors.battery_low_v", "the boat would stop before it warns"),
    ("monitors.late_s", "monitors.very_late_s", "the vessel would stop before it warns"),
    ("monitors.very_late_s", "monitors.jump_s", "the vessel would disarm before it stops"),
    ("estimate.frozen_warn_s", "estimate.frozen_invalid_s", "the position would be lost before it is warned of"),
    ("depth.input.range_min_m", "depth.input.range_max_m", "no reading would be believed"),
)
"""What must be less than what, and why. A voltage of 0 is a row that is off."""
_LEAST_HELM: Final = 0.1
"""Share of the helm that a bow which is half a turn off must ask for; with less of it no boat comes round against a breeze."""
_FASTEST_INTEGRAL_PS: Final = 1.0
"""Share of the proportional gain that an integral may gain in a second: hulls answer their helm in a second or more, and what grows
faster turns them on before they have answered."""
SLOWEST_STROKE_S: Final = 10.0
"""From rest to full output. The slowest steering engines take half of it; a guard's stop is reckoned with less."""
_POSITION: Final = frozenset({"GGA", "GNS", "GLL", "RMC"})
_HEADING: Final = frozenset({"HDT", "THS", "HDG", "HDM", "PASHR", "PSAT", "PSXN", "PTNL", "PSTI", "PTNTHTM"})

_MAGNETIC: Final = frozenset({"HDG", "HDM", "PTNTHTM"})


_AT_REST_US: Final = (1500, 1500, 1500, 1500)
_LINE_BITS: Final = 10
"""A byte on a serial line, with its start and stop."""


def value_mistakes(settings: Settings) -> list[str]:
    """Values that undo each other."""
    return [
        *_order(settings),
        *_guards(settings),
        *_sensing(settings.sensors),
        *_magnetic(settings),
        *_told_twice(settings),
        *_who(settings),
        *_seed(settings),
        *_escalation(settings),
        *_board(settings),
    ]


def hull_value_mistakes(settings: Settings, vessel: VesselConfig) -> list[str]:
    """Values that undo what the hull has."""
    return [
        *_reach(settings, vessel),
        *_thrust(settings, vessel),
        *_rates(settings, vessel),
        *_seed_helm(settings, vessel),
    ]


def _at(settings: Config, key: str) -> float:
    value: object = settings
    for name in key.split("."):
        value = getattr(value, name)
    assert isinstance(value, float)
    return value


def _order(settings: Settings) -> Iterator[str]:
    for less, more, why in _ORDERED:
        low, high = _at(settings, less), _at(settings, more)
        off = less.startswith("monitors.battery") and 0.0 in (low, high)
        if not off and low >= high:
            yield f"{less} = {low:g}: must be less than {more.rpartition('.')[2]} {high:g}; {why}"


def _guards(settings: Settings) -> Iterator[str]:
    if settings.monitors.stuck_share >= 1.0:
        yield "monitors.stuck_share = 1: any boat is a little slower than reckoned, and would be stuck for ever; about 0.25"
    depth, traffic = settings.depth, settings.traffic
    if depth.enabled and 0.0 < depth.min_altitude_m < depth.minimum_margin_m:
        yield (
            f"depth.minimum_margin_m = {depth.minimum_margin_m:g}: more than min_altitude_m {depth.min_altitude_m:g}; "
            "the guard would lock only after the keel has touched"
        )
    if depth.enabled and depth.required and depth.unknown_policy == "ignore":
        yield "depth.unknown_policy = 'ignore': required = true does not go on without a depth; 'stop', or required = false"
    if depth.enabled and depth.brake and settings.gate.thruster_min == 0.0:
        yield "depth.brake = true: gate.thruster_min = 0 leaves no thrust astern to brake with; leave out one of the two"
    if traffic.required and not traffic.enabled:
        yield "traffic.required = true: nobody watches; set traffic.enabled = true, or required = false"
    for key in ("ship_distance_m", "small_distance_m"):
        wanted_m = getattr(traffic, key)
        if traffic.enabled and wanted_m > traffic.shown_range_m:
            yield (
                f"traffic.{key} = {wanted_m:g}: more than shown_range_m {traffic.shown_range_m:g}; "
                "nobody would see the vessel that is too close"
            )
    turns_dps = math.degrees(settings.steering.model.yaw_rate_limit)
    if settings.steering.profile == "model" and settings.estimate.heading_rate_max_dps < turns_dps:
        yield (
            f"estimate.heading_rate_max_dps = {settings.estimate.heading_rate_max_dps:g}: less than the law turns, {turns_dps:.0f} deg/s "
            "(steering.model.yaw_rate_limit): headings in a turn would be refused as jumps"
        )
    fastest_mps = max(settings.mission.cruise_speed_mps, settings.modes.return_speed_mps)
    if settings.estimate.speed_max_mps < fastest_mps:
        yield (
            f"estimate.speed_max_mps = {settings.estimate.speed_max_mps:g}: less than the speed sailed at, {fastest_mps:g} m/s: "
            "positions under way would be refused as jumps"
        )


def _reach(settings: Settings, vessel: VesselConfig) -> Iterator[str]:
    depth = settings.depth
    keel_below_m = vessel.keel_depth_m - vessel.transducer_depth_m
    needed_m = depth.min_altitude_m + depth.good_margin_m + keel_below_m
    if depth.enabled and depth.input.range_max_m < needed_m:
        yield (
            f"depth.input.range_max_m = {depth.input.range_max_m:g}: the sounder could never say that the water is deep enough; "
            f"at least {math.ceil(10.0 * needed_m) / 10.0:g} for a guard of {depth.min_altitude_m:g} m under the keel"
        )


def _thrust(settings: Settings, vessel: VesselConfig) -> Iterator[str]:
    """A cruise that the gate lets no thruster give."""
    limit, cruise_mps = settings.gate.thruster_max, settings.mission.cruise_speed_mps
    gives_mps = throttle_to_speed(vessel, limit)
    if vessel.thruster.dead_band < limit < 1.0 and gives_mps < cruise_mps <= top_speed_mps(vessel):
        yield (
            f"gate.thruster_max = {limit:g}: gives {gives_mps:.1f} m/s, and mission.cruise_speed_mps is {cruise_mps:g}; "
            "more thrust, or a slower cruise"
        )


def _rates(settings: Settings, vessel: VesselConfig) -> Iterator[str]:
    gate, dead_band = settings.gate, vessel.thruster.dead_band
    if 0.0 < gate.thruster_max <= dead_band:
        yield f"gate.thruster_max = {gate.thruster_max:g}: no propeller turns at it; the hull file's dead_band is {dead_band:g}"
    for key, rate, full, unit in (
        ("gate.thruster_rate", gate.thruster_rate, 1.0, "1/s"),
        ("gate.rudder_rate_degps", gate.rudder_rate_degps, vessel.rudder.max_deg, "deg/s"),
    ):
        if rate > 0.0 and full / rate > SLOWEST_STROKE_S:
            yield (
                f"{key} = {rate:g}: {full / rate:.0f} s from rest to full, and the boat cannot be steered; "
                f"at least {full / SLOWEST_STROKE_S:g} {unit}, or 0 for no limit"
            )


def _sensing(sensors: Sequence[SensorConfig]) -> Iterator[str]:
    """A vessel whose settings let no position or no heading in never departs."""
    lines = [item.nmea for item in sensors]
    for number, line in enumerate(lines):
        wanted = [entry.strip().upper() for entry in line.talkers]
        both = next((entry for entry in wanted if f"-{entry}" in wanted), "")
        if both:
            yield f"sensors.{number}.nmea.talkers: wants and forbids {both}; leave out one of the two"
    allowed = [WantedSentences(line.sentences, line.talkers) for line in lines if not unknown_names(line.sentences)]
    for kinds, what, offer in ((_POSITION, "position", "GGA"), (_HEADING, "heading", "HDT")):
        if len(allowed) == len(lines) > 0 and not any(_lets_in(wanted, kinds) for wanted in allowed):
            yield (
                f"sensors.0.nmea.sentences = {lines[0].sentences!r}: no sentence with a {what} is let in, and the vessel never departs; "
                f"add one, such as {offer}"
            )


def _magnetic(settings: Settings) -> Iterator[str]:
    """A magnetic heading without a variation is no heading."""
    lines = [WantedSentences(item.nmea.sentences, item.nmea.talkers) for item in settings.sensors]
    known = settings.estimate.world_magnetic_model or settings.estimate.variation_deg is not None
    helpful = (_HEADING - _MAGNETIC) | {"HDG", "RMC"}  # those two may bring the variation along
    if lines and not known and not any(_lets_in(wanted, helpful) for wanted in lines):
        yield (
            "estimate.world_magnetic_model = false: only a magnetic heading is let in, and no variation is known; "
            "set it to true, or give variation_deg"
        )


def _lets_in(wanted: WantedSentences, kinds: Iterable[str]) -> bool:
    """Whether a sentence of these formatters is read, from whatever talker."""
    talkers = ("GP", "GN", "HE", "II")
    return any(wanted.allows(kind if len(kind) > 3 else talker + kind) for kind in kinds for talker in talkers)


def _told_twice(settings: Settings) -> Iterator[str]:
    links = [(f"sensors.{number}", item.url, item.baud) for number, item in enumerate(settings.sensors)]
    for key, url, baud in (*links, ("actuators", settings.actuators.url, settings.actuators.baud)):
        if baud is not None and "baud=" in url:
            yield f"{key}.baud = {baud}: the url says a baud rate too; leave out one of the two"


def _who(settings: Settings) -> Iterator[str]:
    own, name = settings.system.system_id, settings.system.name
    for entry in settings.operator.ids:
        if str(entry).partition("/")[0] == str(own):
            yield f"operator.ids: {entry} is this vessel itself, and nobody else could command; give the stations' ids, as 255"
    if not name.strip() or not name.isprintable():
        yield f"system.name = {name!r}: {'holds what no screen shows' if name.strip() else 'is empty'}; give the boat a name"
    if 0 < settings.traffic.own_mmsi < 10**8:
        yield f"traffic.own_mmsi = {settings.traffic.own_mmsi}: a vessel's number has nine digits; 0 when there is no transponder"


def _seed(settings: Settings) -> Iterator[str]:
    """The seed's law: gains of nothing, which the law itself takes, and limits that stop it."""
    seed = settings.steering.seed
    if settings.steering.profile != "seed":
        return
    for name, gains, least in (
        ("heading_gains", seed.heading_gains, _LEAST_HELM / math.pi),
        ("speed_gains", seed.speed_gains, 0.0),
    ):
        if gains is not None and (gains.kp == 0.0 or gains.kp < least):
            yield f"steering.seed.{name}.kp = {gains.kp:g}: must be {f'at least {least:.2f}' if least else 'above 0'}; nothing follows"
        elif gains is not None and gains.ki > gains.kp * _FASTEST_INTEGRAL_PS:
            yield (
                f"steering.seed.{name}.ki = {gains.ki:g}: more than kp {gains.kp:g} in a second, and the boat swings or circles; "
                f"at most {gains.kp * _FASTEST_INTEGRAL_PS:g}"
            )
    if seed.max_thruster_output == 0.0:
        yield "steering.seed.max_thruster_output = 0: the vessel could never go ahead; 1 is all that there is"
    if 0.0 < seed.high_speed_threshold_kn <= seed.high_speed_hysteresis_kn:
        yield (
            f"steering.seed.high_speed_hysteresis_kn = {seed.high_speed_hysteresis_kn:g}: must be less than "
            f"high_speed_threshold_kn {seed.high_speed_threshold_kn:g}; fast once, it would count as fast at rest"
        )


def _seed_helm(settings: Settings, vessel: VesselConfig) -> Iterator[str]:
    """Shares that leave the seed's law nothing to turn this hull with, slow or fast."""
    seed, rudders = settings.steering.seed, vessel.rudder.count
    if settings.steering.profile != "seed" or not vessel.thruster.turns:
        return
    for key, share in (
        ("low_speed_thruster_share", seed.low_speed_thruster_share),
        ("high_speed_thruster_share", seed.high_speed_thruster_share),
    ):
        by_thrust = min(share, seed.max_thruster_differential)
        by_rudders = 1.0 - share if rudders else 0.0
        if by_thrust + by_rudders > 0.0:
            continue
        if share == 0.0:
            yield f"steering.seed.{key} = 0: this hull has no rudders, and would not turn; above 0"
        else:
            yield f"steering.seed.max_thruster_differential = 0: with {key} {share:g} nothing turns the hull; above 0"
            return


def _escalation(settings: Settings) -> Iterator[str]:
    """A second action that is less than the first is never taken; where it is not said the default may stand."""
    failsafe = settings.failsafe
    first, then = failsafe.gcs_action, failsafe.gcs_then_action
    if "gcs_then_action" in failsafe.model_fields_set and Action.NONE < then < first:
        yield (
            f"failsafe.gcs_then_action = {then.name.lower()!r}: less than gcs_action {first.name.lower()!r}, and would never be taken; "
            "'none', or what is more"
        )


def _baud(line: ActuatorLinkConfig) -> int:
    """Bits a second of a serial line, where they are said; else 0."""
    try:
        parsed = parse_link_url(line.url, {} if line.baud is None else {"baud": line.baud}) if line.url else None
    except LinkConfigError:
        return 0
    said = str(parsed.options.get("baud", "")) if parsed is not None and parsed.scheme == "serial" else ""
    return int(said) if said.isascii() and said.isdigit() else 0


def _board(settings: Settings) -> Iterator[str]:
    """Keys of the board that do nothing beside others that are said."""
    board = settings.actuators.board
    if board.sketch and "terminator" in board.model_fields_set:
        yield f"actuators.board.terminator = {board.terminator!r}: sketch = {board.sketch!r} chooses it; leave out one of the two"
    rate, need = _baud(settings.actuators), len(encode_level1(_AT_REST_US, batch=board.batch)) * _LINE_BITS
    if rate and rate < need * board.frequency_hz:
        yield (
            f"actuators.board.frequency_hz = {board.frequency_hz:g}: the commands need {need * board.frequency_hz:.0f} bit/s, and the "
            f"line has {rate}; a faster line (the shipped firmware's is 115200), or fewer of them"
        )
    for name in ("thruster_port", "thruster_starboard", "rudder_port", "rudder_starboard"):
        channel = getattr(board, name)
        idle = sorted({"us_minus", "us_zero", "us_plus"} & channel.model_fields_set)
        if channel.encoding == "duty" and idle:
            yield (
                f'actuators.board.{name}.{idle[0]} = {getattr(channel, idle[0])}: encoding "duty" goes from lower_us to upper_us and '
                "has no such pulse; leave out one of the two"
            )
