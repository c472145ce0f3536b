"""What a state packet tells, and each of its fields in the steps and bits of the air. 'Unknown' is a field's highest code."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from ...language.messages import Action, FixType, GuardState, Mode, PlanState
from ...language.snapshot import Snapshot
from .bits import BitReader, BitsError, BitWriter
from .threat import Threat, threat_of
from .wire import ACTION, FIX, GUARD, MODE, PLAN_STATE

CLOCK_S: Final = 4096
_LAT_STEP_DEG: Final = 180.0 / 2**26
_LON_STEP_DEG: Final = 360.0 / 2**27
_DEGREE_M: Final = 111_320.0
"""A degree of latitude as the format reckons it: both ends take this, so its error is nobody's. Frozen with the format."""
_SPEED_STEP: Final = 0.05
COARSE_SPEED_STEP: Final = 0.25
_ANGLE_STEP_RAD: Final = math.radians(4.0)
_ALT_BASE_M: Final = 0.1
_ALT_FACTOR: Final = 1.07


def plan_hash(plan_id: int) -> int:
    """What a state tells of a plan's id."""
    return plan_id & 0x3F


@dataclass(frozen=True, slots=True)
class RadioState:
    """What a state packet tells. Unknown is None; values are those of the steps once they have been through the codec."""

    t_s: int = 0
    """Vessel's clock, modulo 4096 s."""
    lat_rad: float | None = None
    lon_rad: float | None = None
    """Steps of 0.3 m."""
    sog_mps: float | None = None
    """Steps of 0.05 m/s, up to 12.7 m/s."""
    psi_rad: float | None = None
    """Steps of 1.4 degrees."""
    phi_rad: float | None = None
    theta_rad: float | None = None
    """Steps of 4 degrees, within 28 degrees."""
    alt_m: float | None = None
    """Water under the keel, steps of 7 %, from 0.1 m to 500 m."""
    mode: Mode = Mode.HOLD
    armed: bool = False
    action: Action = Action.NONE
    guard: GuardState = GuardState.UNKNOWN
    plan_state: PlanState = PlanState.NO_MISSION
    seq: int = 0
    """Modulo 128."""
    plan_hash: int = 0
    """Low six bits of the plan's CRC-32."""
    battery: float | None = None
    """Share of the charge, steps of 1/62."""
    fix: FixType = FixType.NONE
    gps_ok: bool = False
    heading_ok: bool = False
    actuators_ok: bool = False
    prearm_ok: bool = False
    satellites: int | None = None
    """At least so many: steps of 4, up to 24."""
    threat: Threat | None = None
    """The most dangerous other vessel."""

    @classmethod
    def of(cls, snapshot: Snapshot) -> RadioState:
        """Take what the radio tells out of the vessel's picture of itself."""
        state, health = snapshot.state, snapshot.health
        return cls(
            t_s=snapshot.t_us // 1_000_000 % CLOCK_S,
            lat_rad=state.lat_rad,
            lon_rad=state.lon_rad,
            sog_mps=state.sog_mps,
            psi_rad=state.psi_rad,
            phi_rad=state.phi_rad,
            theta_rad=state.theta_rad,
            alt_m=state.alt_m,
            mode=snapshot.mode,
            threat=threat_of(snapshot.traffic),
            armed=snapshot.armed,
            action=snapshot.action,
            guard=snapshot.guard,
            plan_state=snapshot.progress.state,
            seq=snapshot.progress.seq % 128,
            plan_hash=plan_hash(snapshot.progress.mission_id),
            battery=snapshot.supply.remaining if snapshot.supply else None,
            fix=state.fix_type,
            gps_ok=health.gps,
            heading_ok=health.heading,
            actuators_ok=health.actuators,
            prearm_ok=health.prearm_ok,
            satellites=None if snapshot.fix is None else snapshot.fix.satellites,
        )

    @property
    def status(self) -> tuple[object, ...]:
        """What must be told at once when it changes."""
        return (self.mode, self.armed, self.action, self.guard, self.plan_state, self.seq, self.plan_hash)

    @property
    def flags(self) -> tuple[bool, ...]:
        """What an operator waits for before he can start."""
        return (self.gps_ok, self.heading_ok, self.actuators_ok, self.prearm_ok)


def with_flags(state: RadioState, other: RadioState) -> RadioState:
    """The state with the readiness of another."""
    return replace(
        state,
        gps_ok=other.gps_ok,
        heading_ok=other.heading_ok,
        actuators_ok=other.actuators_ok,
        prearm_ok=other.prearm_ok,
    )


def to_level(value: float | None, step: float, width: int) -> int:
    """Unsigned steps; more than fits is the largest value."""
    top = (1 << width) - 1
    if value is None or not math.isfinite(value):
        return top
    return min(max(round(value / step), 0), top - 1)


def from_level(code: int, step: float, width: int) -> float | None:
    return None if code == (1 << width) - 1 else code * step


def to_turn(angle_rad: float | None, width: int) -> int:
    """A heading; the highest code means unknown."""
    count = (1 << width) - 1
    if angle_rad is None or not math.isfinite(angle_rad):
        return count
    return round(angle_rad / math.tau * count) % count


def from_turn(code: int, width: int) -> float | None:
    count = (1 << width) - 1
    return None if code == count else (code / count * math.tau + math.pi) % math.tau - math.pi


def to_tilt(angle_rad: float | None) -> int:
    if angle_rad is None or not math.isfinite(angle_rad):
        return 15
    return min(max(round(angle_rad / _ANGLE_STEP_RAD), -7), 7) + 7


def from_tilt(code: int) -> float | None:
    return None if code == 15 else (code - 7) * _ANGLE_STEP_RAD


def to_depth(alt_m: float | None) -> int:
    """Logarithmic: 0 = 0.1 m or less, 126 = 500 m or more, 127 = unknown."""
    if alt_m is None or not math.isfinite(alt_m):
        return 127
    return min(max(round(math.log(max(alt_m, _ALT_BASE_M) / _ALT_BASE_M) / math.log(_ALT_FACTOR)), 0), 126)


def from_depth(code: int) -> float | None:
    return None if code == 127 else _ALT_BASE_M * float(_ALT_FACTOR**code)


def to_grid(state: RadioState) -> tuple[int, int]:
    """Position on the key's grid; the last latitude means unknown."""
    if state.lat_rad is None or state.lon_rad is None:
        return 2**26 - 1, 0
    lat = round((math.degrees(state.lat_rad) + 90.0) / _LAT_STEP_DEG)
    lon = round((math.degrees(state.lon_rad) + 180.0) / _LON_STEP_DEG)
    return min(max(lat, 0), 2**26 - 2), lon % 2**27


def from_grid(lat: int, lon: int) -> tuple[float | None, float | None]:
    if lat == 2**26 - 1:
        return None, None
    return math.radians(lat * _LAT_STEP_DEG - 90.0), math.radians(lon * _LON_STEP_DEG - 180.0)


def write_position(writer: BitWriter, state: RadioState) -> None:
    lat, lon = to_grid(state)
    writer.put(lat, 26)
    writer.put(lon, 27)
    writer.put(to_level(state.sog_mps, _SPEED_STEP, 8), 8)
    writer.put(to_turn(state.psi_rad, 8), 8)


def read_position(reader: BitReader, state: RadioState) -> RadioState:
    lat_rad, lon_rad = from_grid(reader.get(26), reader.get(27))
    speed, turn = reader.get(8), reader.get(8)
    return replace(
        state,
        lat_rad=lat_rad,
        lon_rad=lon_rad,
        sog_mps=from_level(speed, _SPEED_STEP, 8),
        psi_rad=from_turn(turn, 8),
    )


def write_status(writer: BitWriter, state: RadioState) -> None:
    writer.put(to_depth(state.alt_m), 7)
    writer.put(MODE.number(state.mode), MODE.bits)
    writer.flag(state.armed)
    writer.put(ACTION.number(state.action), ACTION.bits)
    writer.put(GUARD.number(state.guard), GUARD.bits)
    writer.put(PLAN_STATE.number(state.plan_state), PLAN_STATE.bits)
    writer.put(state.seq % 128, 7)
    writer.put(state.plan_hash & 0x3F, 6)
    writer.put(to_level(state.battery, 1.0 / 62.0, 6), 6)
    writer.put(FIX.number(state.fix), FIX.bits)
    for flag in (state.gps_ok, state.heading_ok, state.actuators_ok, state.prearm_ok):
        writer.flag(flag)


def read_status(reader: BitReader, state: RadioState) -> RadioState:
    try:
        return replace(
            state,
            alt_m=from_depth(reader.get(7)),
            mode=MODE.member(reader.get(MODE.bits)),
            armed=reader.flag(),
            action=ACTION.member(reader.get(ACTION.bits)),
            guard=GUARD.member(reader.get(GUARD.bits)),
            plan_state=PLAN_STATE.member(reader.get(PLAN_STATE.bits)),
            seq=reader.get(7),
            plan_hash=reader.get(6),
            battery=from_level(reader.get(6), 1.0 / 62.0, 6),
            fix=FIX.member(reader.get(FIX.bits)),
            gps_ok=reader.flag(),
            heading_ok=reader.flag(),
            actuators_ok=reader.flag(),
            prearm_ok=reader.flag(),
        )
    except (ValueError, IndexError):
        raise BitsError("no such state") from None


def write_change(writer: BitWriter, state: RadioState) -> None:
    """Thirty bits: the status, and what of the vessel's health may forbid a start."""
    writer.put(MODE.number(state.mode), MODE.bits)
    writer.flag(state.armed)
    writer.put(ACTION.number(state.action), ACTION.bits)
    writer.put(GUARD.number(state.guard), GUARD.bits)
    writer.put(PLAN_STATE.number(state.plan_state), PLAN_STATE.bits)
    writer.put(state.seq % 128, 7)
    writer.put(state.plan_hash & 0x3F, 6)
    for flag in (state.gps_ok, state.heading_ok, state.actuators_ok, state.prearm_ok):
        writer.flag(flag)


def read_change(reader: BitReader, state: RadioState) -> RadioState:
    """Raises BitsError."""
    return replace(
        state,
        mode=MODE.member(reader.get(MODE.bits)),
        armed=reader.flag(),
        action=ACTION.member(reader.get(ACTION.bits)),
        guard=GUARD.member(reader.get(GUARD.bits)),
        plan_state=PLAN_STATE.member(reader.get(PLAN_STATE.bits)),
        seq=reader.get(7),
        plan_hash=reader.get(6),
        gps_ok=reader.flag(),
        heading_ok=reader.flag(),
        actuators_ok=reader.flag(),
        prearm_ok=reader.flag(),
    )


def metres_between(key: RadioState, state: RadioState) -> tuple[float, float] | None:
    """North and east from the key's position, on a plane that both ends share."""
    if key.lat_rad is None or key.lon_rad is None or state.lat_rad is None or state.lon_rad is None:
        return None
    north = math.degrees(state.lat_rad - key.lat_rad) * _DEGREE_M
    east = math.degrees(state.lon_rad - key.lon_rad) * _DEGREE_M * math.cos(key.lat_rad)
    return north, east


def moved(key: RadioState, north_m: float, east_m: float) -> tuple[float, float]:
    assert key.lat_rad is not None
    assert key.lon_rad is not None
    lat_rad = key.lat_rad + math.radians(north_m / _DEGREE_M)
    return lat_rad, key.lon_rad + math.radians(east_m / (_DEGREE_M * math.cos(key.lat_rad)))
