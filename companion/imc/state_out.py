"""The vessel's state towards the consoles: which message how often, and never as new what is not.

A message is sent when the MAVLink message that it is made of has come anew, and no more often than its period. Together they are
about a tenth of what DUNE sends, and what a console was measured to need. While the vehicle is silent nothing is told of it but that.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from mavlink_bridge.imc import (
    NULL_MESSAGE,
    Asker,
    ControlLoops,
    EntityCondition,
    ManeuverControlState,
    ManeuverProgress,
    Message,
    OpMode,
    Outgoing,
    PlanControlState,
    PlanState,
    Teleoperation,
    VehicleFlags,
    VehicleState,
)

from . import motion, power
from .parts import LABELS, Told, is_heard, parts
from .path import PathTeller
from .picture import FRESH_US, ImcPicture
from .view import PlanView

NAVIGATION: Final = "Navigation"
VEHICLE_SUPERVISOR: Final = "Vehicle Supervisor"
PLAN_ENGINE: Final = "Plan Engine"
PATH_CONTROL: Final = "Path Control"
_SECOND_US: Final = 1_000_000
_GRAPH_US: Final = 2_000_000
"""What a console only draws as a graph: half as often as what it acts on."""
_DETAIL_US: Final = 5_000_000
"""What EstimatedState tells already, and soundings: the peer's own limit for those, 0.2 Hz."""
_BATTERY_US: Final = 10_000_000
"""The peer's limit too."""
_PARTS_US: Final = 2_000_000
_ON_PATH: Final = ControlLoops.PATH | ControlLoops.YAW | ControlLoops.SPEED
_ERRORS: Final = frozenset((EntityCondition.ERROR, EntityCondition.FAILURE))
_UNKNOWN_16: Final = 0xFFFF


@dataclass
class StateMessage:
    """One message: what it is made of, and how often it goes out at most."""

    source: str
    period_us: int
    make: Callable[[int], list[Outgoing]]
    sent_us: int | None = None
    told_us: int | None = None
    """When the source came that was told last."""


class StateOut:
    """A part of the system. ``view``: the plan's life, from the half that takes orders. ``utc_s``: our clock."""

    def __init__(
        self,
        picture: ImcPicture,
        view: Callable[[int], PlanView],
        utc_s: Callable[[int], float],
        *,
        skews: Callable[[], Sequence[str]] = list,
        rudder_full_rad: float,
        state_hz: float,
    ) -> None:
        self._picture = picture
        self._view = view
        self._utc_s = utc_s
        self._skews = skews
        self._rudder_full_rad = rudder_full_rad
        self._path = PathTeller()
        self._rows = self._table(round(1e6 / state_hz))
        self._plan: PlanView | None = None
        self._plan_us: int | None = None
        self._parts: list[Told] = []
        self._parts_us: int | None = None
        self._state_us: int | None = None

    def _table(self, state_us: int) -> list[StateMessage]:
        return [
            StateMessage("GLOBAL_POSITION_INT", state_us, self._estimated_state),
            StateMessage("GPS_RAW_INT", _DETAIL_US, self._one(motion.gps_fix, "GPS")),
            StateMessage("ATTITUDE", _DETAIL_US, self._euler_angles),
            StateMessage("NAV_CONTROLLER_OUTPUT", _GRAPH_US, self._one(self._path.tell, PATH_CONTROL)),
            StateMessage("DISTANCE_SENSOR", _DETAIL_US, self._one(motion.distance, "Sounder")),
            StateMessage("WATER_DEPTH", _DETAIL_US, self._unsounded),
            StateMessage("SERVO_OUTPUT_RAW", _GRAPH_US, self._actuation),
            StateMessage("RPM", _SECOND_US, functools.partial(power.rpm, self._picture)),
            StateMessage("ESC_TELEMETRY_1_TO_4", _SECOND_US, functools.partial(power.rpm, self._picture)),
            StateMessage("SYS_STATUS", _BATTERY_US, functools.partial(power.battery, self._picture)),
        ]

    # ---- a part of the system -----------------------------------------------------------------------------------

    def receive(self, message: Message, asker: Asker, now_us: int) -> bool:
        return False

    def heard(self, asker: Asker, now_us: int) -> None: ...

    def met(self, asker: Asker, now_us: int) -> None:
        """Everything that is still true goes out at once."""
        for row in self._rows:
            row.sent_us = row.told_us = None
        self._plan_us = self._parts_us = self._state_us = None

    def entities(self) -> Sequence[str]:
        return (NAVIGATION, VEHICLE_SUPERVISOR, PLAN_ENGINE, PATH_CONTROL, *LABELS)

    def take(self, now_us: int) -> list[Outgoing]:
        out = self._parts_out(now_us)
        if is_heard(self._picture, now_us):
            out += self._plan_out(now_us)
        for row in self._rows:
            if self._is_due(row, now_us):
                out += row.make(now_us)
        return out

    def _is_due(self, row: StateMessage, now_us: int) -> bool:
        heard = self._picture.newest(row.source)
        if heard is None or heard.at_us == row.told_us or now_us - heard.at_us > FRESH_US:
            return False
        if row.sent_us is not None and now_us - row.sent_us < row.period_us:
            return False
        row.sent_us, row.told_us = now_us, heard.at_us
        return True

    # ---- motion -------------------------------------------------------------------------------------------------

    def _one(self, make: Callable[[ImcPicture, int], Message | None], label: str) -> Callable[[int], list[Outgoing]]:
        def made(now_us: int) -> list[Outgoing]:
            message = make(self._picture, now_us)
            return [] if message is None else [Outgoing(message, label=label, age_s=self._picture.age_s(now_us) or 0.0)]

        return made

    def _estimated_state(self, now_us: int) -> list[Outgoing]:
        """A state that crossed a radio is told once, with its age, and as a report for slow links too."""
        age_s, state = self._picture.age_s(now_us), motion.estimated_state(self._picture, now_us)
        if age_s is None or state is None:
            return []
        out = [Outgoing(state, label=NAVIGATION, age_s=age_s)]
        if not self._picture.by_radio(now_us):
            return out
        true_us = now_us - round(age_s * 1e6)
        if self._state_us is not None and true_us - self._state_us < _SECOND_US:
            return []
        self._state_us = true_us
        report = motion.state_report(self._picture, now_us, self._utc_s(now_us))
        return out if report is None else [*out, Outgoing(report, label=NAVIGATION)]

    def _unsounded(self, now_us: int) -> list[Outgoing]:
        """That the sounder measures nothing; what it measures comes by another message."""
        if self._picture.fresh("DISTANCE_SENSOR", now_us) is not None:
            return []
        return self._one(motion.distance, "Sounder")(now_us)

    def _euler_angles(self, now_us: int) -> list[Outgoing]:
        age_s = self._picture.age_s(now_us)
        angles = motion.euler_angles(self._picture, now_us, self._utc_s(now_us) - (age_s or 0.0))
        return [] if angles is None or age_s is None else [Outgoing(angles, label="Compass", age_s=age_s)]

    def _actuation(self, now_us: int) -> list[Outgoing]:
        return power.actuation(self._picture, now_us, self._rudder_full_rad)

    # ---- parts and plan -----------------------------------------------------------------------------------------

    def _parts_out(self, now_us: int) -> list[Outgoing]:
        told = parts(self._picture, now_us, self._skews())
        due = self._parts_us is None or now_us - self._parts_us >= _PARTS_US
        conditions = [(label, state.state) for label, state in told]
        if not due and conditions == [(label, state.state) for label, state in self._parts]:
            return []
        self._parts, self._parts_us = told, now_us
        return [Outgoing(state, label=label) for label, state in told]

    def _plan_out(self, now_us: int) -> list[Outgoing]:
        view = self._view(now_us)
        due = self._plan_us is None or now_us - self._plan_us >= _SECOND_US
        if not due and self._plan is not None and _mark(view) == _mark(self._plan):
            return []
        before, self._plan, self._plan_us = self._plan, view, now_us
        out = [
            Outgoing(self._vehicle_state(view, now_us), label=VEHICLE_SUPERVISOR),
            Outgoing(plan_control_state(view), label=PLAN_ENGINE),
        ]
        maneuver = maneuver_state(view, before)
        return out if maneuver is None else [*out, Outgoing(maneuver, label=PLAN_ENGINE)]

    def _vehicle_state(self, view: PlanView, now_us: int) -> VehicleState:
        bad = [label for label, state in self._parts if state.state in _ERRORS]
        in_maneuver = view.operation == OpMode.MANEUVER
        began_us, error_us = view.maneuver_started_us, view.last_error_us
        eta_s = view.maneuver_eta_s
        return VehicleState(
            op_mode=view.operation,
            error_count=min(len(bad), 255),
            error_ents=",".join(bad),
            maneuver_type=view.maneuver_type if in_maneuver else NULL_MESSAGE,
            maneuver_stime_s=self._utc_s(began_us) if in_maneuver and began_us is not None else -1.0,
            maneuver_eta_s=_UNKNOWN_16 if eta_s is None or not in_maneuver else max(0, min(eta_s, _UNKNOWN_16 - 1)),
            control_loops=_loops(view),
            flags=VehicleFlags.MANEUVER_DONE if view.maneuver_done else 0,
            last_error=view.last_error,
            last_error_time_s=-1.0 if error_us is None else self._utc_s(error_us),
        )


def _loops(view: PlanView) -> int:
    if view.operation != OpMode.MANEUVER:
        return 0
    return ControlLoops.TELEOPERATION if view.maneuver_type == Teleoperation.NUMBER else _ON_PATH


def _mark(view: PlanView) -> tuple[object, ...]:
    """What of a view is told at once when it changes."""
    plan = (view.state, view.plan_id, view.maneuver_id, view.maneuver_type, view.last_outcome)
    return (*plan, view.operation, view.last_error, view.maneuver_done)


def plan_control_state(view: PlanView) -> PlanControlState:
    """The plan's life, with what is not known as -1."""
    running = view.state in (PlanState.EXECUTING, PlanState.INITIALIZING)
    return PlanControlState(
        state=view.state,
        plan_id=view.plan_id,
        plan_eta_s=-1 if view.plan_eta_s is None or not running else view.plan_eta_s,
        plan_progress_pct=-1.0 if view.progress_pct is None or not running else view.progress_pct,
        man_id=view.maneuver_id if running else "",
        man_type=view.maneuver_type if running else NULL_MESSAGE,
        man_eta_s=-1 if view.maneuver_eta_s is None or not running else view.maneuver_eta_s,
        last_outcome=view.last_outcome,
    )


def maneuver_state(view: PlanView, before: PlanView | None) -> ManeuverControlState | None:
    """The manoeuvre while there is one, and once how it ended."""
    eta_s = view.maneuver_eta_s
    if view.operation == OpMode.MANEUVER and not view.maneuver_done:
        known = _UNKNOWN_16 if eta_s is None else max(0, min(eta_s, _UNKNOWN_16 - 1))
        return ManeuverControlState(ManeuverProgress.EXECUTING, known, view.maneuver_id)
    if before is None or before.operation != OpMode.MANEUVER:
        return None
    if view.operation == OpMode.ERROR:
        return ManeuverControlState(ManeuverProgress.ERROR, 0, view.last_error)
    ended = ManeuverProgress.DONE if view.maneuver_done else ManeuverProgress.STOPPED
    return ManeuverControlState(ended, 0, before.maneuver_id)
