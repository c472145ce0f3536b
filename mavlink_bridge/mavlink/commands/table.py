"""What each MAV_CMD means for a boat: one small function per command, from its numbers to a request or a refusal.

NaN means 'not given' everywhere; 0 does where the definition says so. A boat ignores altitudes. Source: MAVLink
common.xml and the observed habits of the stations (gcs.md §2).
"""

from __future__ import annotations

import math
import typing
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from ...language import requests as ask
from ...language.figures import Circle, FigureEight, Hover
from ...language.messages import LoiterDirection, Mode
from ...language.nature import Ask
from ...language.spoken import Spoken
from ...language.trials import TRIAL_RADIUS_M, SeaTrial, TrialOrder
from ..persona import modes
from ..wire.cmd import Cmd
from .command import FAILED, REJECTED_NOW, UNSUPPORTED, Command, Refused, denied
from .plain import NUMBERS, fields_of

MAX_SPEED_MPS: Final = 50.0
MAX_RADIUS_M: Final = 10_000.0
NO_CUSTOM_MODE: Final = "no mode set: flag 1 (MAV_MODE_FLAG_CUSTOM_MODE_ENABLED) is missing in the base mode"
"""What SET_MODE and DO_SET_MODE are refused for that leave it out: the number beside it then means nothing."""
FORCE: Final = frozenset((21196.0, 2989.0))
"""Param 2 of COMPONENT_ARM_DISARM that means 'whatever the checks say': common.xml's and ArduPilot's number."""


@dataclass(frozen=True, slots=True)
class Context:
    """What the meaning of some commands depends on."""

    home_item: bool
    plan_length: int
    plan_seq: int
    psi_rad: float | None


Meaning = Callable[[Command, Context], ask.RequestBody | None]
"""None: accepted with nothing to do. Raises Refused."""


def _speed(command: Command, number: int) -> float | None:
    """A speed parameter: NaN, 0 and -1 leave the choice to the boat."""
    value = command.number(number, -1.0, -1.0, MAX_SPEED_MPS)
    if -1.0 < value < 0.0:
        raise denied(f"speed {value:g} m/s is negative")
    return value if value > 0.0 else None


def _arm(command: Command, _: Context) -> ask.RequestBody:
    value = command.params[0]
    if value not in (0.0, 1.0):
        raise denied("arm or disarm: parameter 1 must be 0 or 1")
    return ask.Arm(arm=value == 1.0, force=command.given(2) in FORCE)


def _set_mode(command: Command, _: Context) -> ask.RequestBody:
    if not command.whole(1, 1, 0, 255) & 1:
        raise denied(NO_CUSTOM_MODE)
    number = command.whole(2, -1, -1, 0xFFFFFFFF)
    mode = modes.from_set_mode(number, command.params[2], command.params[3])
    if mode is None:
        raise denied(f"{modes.foreign_name(number, command.params[2])} is not one of this boat's modes")
    return ask.SetMode(mode)


def _set_standard_mode(command: Command, _: Context) -> ask.RequestBody:
    number = command.whole(1, 0, 0, 255)
    mode = modes.from_standard(number)
    if mode is None:
        raise Refused(FAILED, f"standard mode {number} is not one of this boat's")
    return ask.SetMode(mode)


def _return_to_launch(_: Command, __: Context) -> ask.RequestBody:
    return ask.SetMode(Mode.RTL)


def _loiter_unlimited(command: Command, _: Context) -> ask.RequestBody:
    radius_m = command.number(3, 0.0, -MAX_RADIUS_M, MAX_RADIUS_M)
    position = command.position_rad(zero_is_here=True)
    if not radius_m and position is None:
        return ask.SetMode(Mode.LOITER)
    lat_rad, lon_rad = position or (None, None)
    if not radius_m:
        return ask.Orbit(lat_rad, lon_rad, Hover())
    return ask.Orbit(lat_rad, lon_rad, Circle(abs(radius_m), _direction(radius_m)))


def _direction(signed: float) -> LoiterDirection:
    return LoiterDirection.CCW if signed < 0.0 else LoiterDirection.CW


def _start(command: Command, context: Context) -> ask.RequestBody:
    if not context.plan_length:
        raise Refused(REJECTED_NOW, "there is no mission to start")
    shift = 1 if context.home_item else 0
    first = max(command.whole(1, 0, 0, 0xFFFF) - shift, 0)
    last = command.whole(2, 0, 0, 0xFFFF) - shift
    if first >= context.plan_length:
        raise denied(f"first item {first + shift} is beyond the mission's end")
    if last > 0 and (last < first or last >= context.plan_length):
        raise denied(f"last item {last + shift} is not in the mission after the first")
    return ask.StartPlan(first or None, last if last > 0 else None)


def _pause(command: Command, _: Context) -> ask.RequestBody:
    value = command.params[0]
    if value not in (0.0, 1.0):
        raise denied("pause or continue: parameter 1 must be 0 or 1")
    return ask.PausePlan(pause=value == 0.0)


def canonical_seq(seq: int, context: Context) -> int:
    """Turn a wire sequence number into a canonical one. Raises Refused when it is not in the mission."""
    shift = 1 if context.home_item else 0
    number = max(seq - shift, 0)
    if seq < 0 or number >= context.plan_length:
        raise denied(
            f"item {seq} is not in the mission of {context.plan_length + (shift if context.plan_length else 0)}"
        )
    return number


def _set_current(command: Command, context: Context) -> ask.RequestBody:
    seq = command.whole(1, -1, -1, 0xFFFF)
    reset = command.params[1] == 1.0
    if seq == -1:
        return ask.SetCurrent(context.plan_seq, reset)
    return ask.SetCurrent(canonical_seq(seq, context), reset)


def _reposition(command: Command, _: Context) -> ask.RequestBody:
    lat_rad, lon_rad = command.position_rad() or (None, None)
    radius_m = abs(command.number(3, 0.0, -MAX_RADIUS_M, MAX_RADIUS_M))
    flags = command.whole(2, 0, 0, 0xFFFF)
    return ask.Reposition(lat_rad, lon_rad, _speed(command, 1), radius_m or None, change_mode=bool(flags & 1))


def _orbit(command: Command, _: Context) -> ask.RequestBody:
    lat_rad, lon_rad = command.position_rad(zero_is_here=True) or (None, None)
    radius_m = command.number(1, 0.0, -MAX_RADIUS_M, MAX_RADIUS_M)
    angle_rad = command.number(4, 0.0, 0.0, 1e6)
    return ask.Orbit(
        lat_rad,
        lon_rad,
        Circle(abs(radius_m) or None, _direction(radius_m)),
        speed_mps=_speed(command, 2),
        turns=angle_rad / math.tau if angle_rad else None,
    )


def _figure_eight(command: Command, _: Context) -> ask.RequestBody:
    lat_rad, lon_rad = command.position_rad(zero_is_here=True) or (None, None)
    major_m = command.number(1, 0.0, -MAX_RADIUS_M, MAX_RADIUS_M)
    minor_m = command.number(2, 0.0, 0.0, MAX_RADIUS_M)
    if major_m and minor_m and abs(major_m) < 2.0 * minor_m:
        raise denied("figure eight: the major radius must be at least twice the minor")
    return ask.Orbit(
        lat_rad,
        lon_rad,
        FigureEight(
            radius_m=minor_m or None,
            length_m=2.0 * (abs(major_m) - minor_m) if major_m and minor_m else None,
            bearing_rad=command.number(4, 0.0, -math.tau, math.tau),
            direction=_direction(major_m),
        ),
    )


def _change_speed(command: Command, _: Context) -> ask.RequestBody | None:
    if command.whole(1, 1, 0, 255) > 1:
        raise denied("a boat has no climb or descent speed")
    speed = command.number(2, -1.0, -2.0, MAX_SPEED_MPS)
    throttle = command.number(3, -1.0, -2.0, 100.0)
    if speed == -2.0 or (speed == -1.0 and throttle == -2.0):
        return ask.SetSpeed()
    if speed == -1.0:
        return ask.SetSpeed(throttle=throttle / 100.0) if throttle > 0.0 else None
    if speed <= 0.0:
        raise denied(f"speed {speed:g} m/s: to stop, hold or disarm")
    return ask.SetSpeed(speed_mps=speed)


def _guided_speed(command: Command, _: Context) -> ask.RequestBody:
    speed = _speed(command, 2)
    if command.whole(1, 1, 0, 255) > 1 or speed is None:
        raise denied("a speed above 0 m/s is needed")
    return ask.SetSpeed(speed_mps=speed)


def _guided_heading(command: Command, _: Context) -> ask.RequestBody:
    angle_deg = command.given(2)
    if angle_deg is None or not 0.0 <= angle_deg <= 360.0:
        raise denied("a heading of 0 to 360 degrees is needed")
    return ask.GuidedHeading(_wrapped(math.radians(angle_deg)), course=command.whole(1, 1, 0, 2) == 0)


def _condition_yaw(command: Command, context: Context) -> ask.RequestBody:
    angle_deg = command.given(1)
    if angle_deg is None or not -360.0 <= angle_deg <= 360.0:
        raise denied("an angle of at most 360 degrees is needed")
    if command.whole(4, 0, 0, 1) == 0:
        return ask.GuidedHeading(_wrapped(math.radians(angle_deg)))
    if context.psi_rad is None:
        raise Refused(REJECTED_NOW, "no heading to turn from")
    side = -1.0 if command.whole(3, 1, -1, 1) < 0 else 1.0
    return ask.GuidedHeading(_wrapped(context.psi_rad + side * math.radians(angle_deg)))


def _wrapped(angle_rad: float) -> float:
    return (angle_rad + math.pi) % math.tau - math.pi


def _set_home(command: Command, _: Context) -> ask.RequestBody:
    if command.whole(1, 0, 0, 1) == 1:
        return ask.SetHomePosition(None, None)
    position = command.position_rad()
    if position is None:
        raise denied("home: no position given")
    return ask.SetHomePosition(*position)


def _terminate(command: Command, _: Context) -> ask.RequestBody:
    if command.number(1, 0.0, 0.0, 1.0) <= 0.5:
        raise denied("a termination cannot be taken back")
    return ask.Terminate()


def _fence_enable(command: Command, _: Context) -> ask.RequestBody:
    value = command.params[0]
    if value not in (0.0, 1.0):
        raise denied("fence: parameter 1 must be 0 or 1")
    return ask.EnableFence(enable=value == 1.0)


def _reboot(command: Command, _: Context) -> ask.RequestBody:
    value = command.whole(1, 0, 0, 255)
    if value == 3:
        raise Refused(UNSUPPORTED, "there is no boot loader")
    if value not in (1, 2):
        raise denied("parameter 1 must be 1 (restart) or 2 (shut down)")
    return ask.Reboot(shutdown=value == 2)


def _storage(command: Command, _: Context) -> None:
    """PREFLIGHT_STORAGE: parameters are stored when they are set, so reading and writing need nothing; a reset is refused."""
    if command.whole(1, 0, 0, 255) > 1:
        raise Refused(UNSUPPORTED, "parameters are reset in the configuration file")


def _take_command(command: Command, _: Context) -> ask.RequestBody:
    """MAV_CMD_REQUEST_OPERATOR_CONTROL: param 2 is 1 to take command, 0 to give it up."""
    return ask.TakeCommand(take=command.whole(2, 1, 0, 1) == 1)


_TRIAL_ORDERS: Final = {
    0: TrialOrder.END,
    1: TrialOrder.BEGIN,
    2: TrialOrder.CONFIRM,
    3: TrialOrder.TELL,
    4: TrialOrder.LOOK,
}
TRIAL_NUMBERS: Final = {order: float(number) for number, order in _TRIAL_ORDERS.items()}
"""Param 1 of USER_3."""


def _sea_trial(command: Command, _: Context) -> ask.RequestBody:
    radius_m = command.number(2, 0.0, 0.0, MAX_RADIUS_M) or TRIAL_RADIUS_M
    order = _TRIAL_ORDERS[command.whole(1, 0, 0, max(_TRIAL_ORDERS))]
    return SeaTrial(order, radius_m, quick=command.params[2] == 1.0, fitted=command.params[3] == 1.0)


@dataclass(frozen=True, slots=True)
class CommandRow:
    """One command, whole: what it is called, what it means now, what it asks of the vessel. All other tables are derived from these."""

    number: int
    """MAV_CMD."""
    name: str
    """As the dialect calls it, without MAV_CMD_."""
    meaning: Meaning
    brings: tuple[type[ask.RequestBody], ...]
    """The requests that it may become; empty: nothing is asked of the vessel."""
    stops: bool = False
    """Whether it may mean a request whose nature is to stop, for who sees only the number."""
    progress: bool = True
    """False: MAVSDK 4.1 takes IN_PROGRESS for the final answer and ends its process at the real one."""
    planned: bool = False
    """Whether it means something as an item of a plan too (``plan_mapping`` has it then)."""
    own: bool = False
    """The pinned dialect does not name it: a number of ours, or a newer one."""


_WITH_MEANINGS: Final = (
    CommandRow(
        Cmd.LOITER_UNLIM, "NAV_LOITER_UNLIM", _loiter_unlimited, (ask.SetMode, ask.Orbit), stops=True, planned=True
    ),
    CommandRow(Cmd.RETURN_TO_LAUNCH, "NAV_RETURN_TO_LAUNCH", _return_to_launch, (ask.SetMode,), planned=True),
    CommandRow(Cmd.DO_ORBIT, "DO_ORBIT", _orbit, (ask.Orbit,), planned=True),
    CommandRow(Cmd.DO_FIGURE_EIGHT, "DO_FIGURE_EIGHT", _figure_eight, (ask.Orbit,), planned=True),
    CommandRow(Cmd.CONDITION_YAW, "CONDITION_YAW", _condition_yaw, (ask.GuidedHeading,)),
    CommandRow(Cmd.DO_SET_MODE, "DO_SET_MODE", _set_mode, (ask.SetMode,), stops=True, progress=False),
    CommandRow(Cmd.DO_CHANGE_SPEED, "DO_CHANGE_SPEED", _change_speed, (ask.SetSpeed,), planned=True),
    CommandRow(Cmd.DO_SET_HOME, "DO_SET_HOME", _set_home, (ask.SetHomePosition,), planned=True),
    CommandRow(Cmd.DO_FLIGHTTERMINATION, "DO_FLIGHTTERMINATION", _terminate, (ask.Terminate,), stops=True),
    CommandRow(Cmd.DO_REPOSITION, "DO_REPOSITION", _reposition, (ask.Reposition,), stops=True),
    CommandRow(Cmd.DO_PAUSE_CONTINUE, "DO_PAUSE_CONTINUE", _pause, (ask.PausePlan,), stops=True),
    CommandRow(Cmd.DO_FENCE_ENABLE, "DO_FENCE_ENABLE", _fence_enable, (ask.EnableFence,), planned=True),
    CommandRow(Cmd.DO_SET_MISSION_CURRENT, "DO_SET_MISSION_CURRENT", _set_current, (ask.SetCurrent,)),
    CommandRow(Cmd.PREFLIGHT_STORAGE, "PREFLIGHT_STORAGE", _storage, ()),
    CommandRow(Cmd.PREFLIGHT_REBOOT_SHUTDOWN, "PREFLIGHT_REBOOT_SHUTDOWN", _reboot, (ask.Reboot,)),
    CommandRow(Cmd.DO_SET_STANDARD_MODE, "DO_SET_STANDARD_MODE", _set_standard_mode, (ask.SetMode,)),
    CommandRow(Cmd.MISSION_START, "MISSION_START", _start, (ask.StartPlan,), progress=False),
    CommandRow(Cmd.COMPONENT_ARM_DISARM, "COMPONENT_ARM_DISARM", _arm, (ask.Arm,), stops=True),
    CommandRow(Cmd.SEA_TRIAL, "USER_3", _sea_trial, (SeaTrial,)),
    CommandRow(Cmd.REQUEST_OPERATOR_CONTROL, "REQUEST_OPERATOR_CONTROL", _take_command, (ask.TakeCommand,), own=True),
    CommandRow(Cmd.GUIDED_CHANGE_SPEED, "GUIDED_CHANGE_SPEED", _guided_speed, (ask.SetSpeed,)),
    CommandRow(Cmd.GUIDED_CHANGE_HEADING, "GUIDED_CHANGE_HEADING", _guided_heading, (ask.GuidedHeading,)),
)


def _plain_row(kind: type[ask.RequestBody], spoken: Spoken) -> CommandRow:
    """The row of a request that says itself how it is asked for. Raises KeyError: the dialect knows no such command."""

    def meaning(command: Command, _: Context) -> ask.RequestBody:
        return kind(**fields_of(spoken, command))

    return CommandRow(NUMBERS[spoken.command], spoken.command, meaning, (kind,), stops=spoken.stops)


BODIES: Final[tuple[type[ask.RequestBody], ...]] = typing.get_args(ask.RequestBody)
ROWS: Final = (*_WITH_MEANINGS, *(_plain_row(kind, kind.spoken) for kind in BODIES if kind.spoken is not None))


def flaws(rows: Sequence[CommandRow], requests: Sequence[type] = tuple(Ask.__subclasses__())) -> list[str]:
    """What is missing or wrong: a number twice, a name that the dialect does not give it, a request that is none of the union."""
    bodies = {body.__name__ for body in BODIES}
    left_out = dict.fromkeys(kind.__name__ for kind in requests if kind.__name__ not in bodies)
    found = [f"{name} is missing in RequestBody" for name in left_out]
    names = {number: name for name, number in NUMBERS.items()}
    for row in rows:
        if [other.number for other in rows].count(row.number) > 1:
            found.append(f"command {row.number} has two rows")
        if (names.get(row.number) != row.name) != row.own:
            found.append(f"command {row.number} is {names.get(row.number, 'in no dialect')}, not {row.name}")
        found += [
            f"{row.name} brings {body.__name__}, which is no request" for body in row.brings if body not in BODIES
        ]
    return found


if flaws(ROWS):
    raise ImportError("; ".join(flaws(ROWS)))

MEANINGS: Final[dict[int, Meaning]] = {row.number: row.meaning for row in ROWS}
MAY_STOP: Final = frozenset(row.number for row in ROWS if row.stops)
NO_PROGRESS: Final = frozenset(row.number for row in ROWS if not row.progress)
