"""Arming: every reason against it, in plain words, all at once (pure); what an order that was left while disarmed means then, and one
that was broken off."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.geodesy import inverse
from mavlink_bridge.language.messages import EstimatedState, Goto, GuardState, Mode, Severity
from mavlink_bridge.language.requests import GuidedHeading, Orbit, Reposition, RequestBody, SetMode
from mavlink_bridge.language.snapshot import FenceStatus
from mavlink_bridge.language.stations import Station

from ..guard.failsafe_row import Takeover
from ..guard.failsafe_table import BY_NAME
from ..guide.leg import Leg
from .haven import THERE_M
from .navigator import Navigator, Steer
from .parts import Parts
from .plan_reach import shown

_STEERS_ITSELF = (Mode.HOLD, Mode.AUTO, Mode.RTL, Mode.GUIDED, Mode.CIRCLE, Mode.LOITER)
_FORBID = "mend the wrong one, or forbid it (sentences)"


def reasons(
    *,
    mode: Mode,
    state: EstimatedState,
    actuator_ready: bool,
    actuator_reason: str = "",
    terminated: bool = False,
    emergency_stop: bool = False,
    holding_causes: Sequence[str] = (),
    guard: GuardState = GuardState.UNKNOWN,
    guard_reason: str | None = None,
    depth_required: bool = False,
    altitude_known: bool = False,
    fence: FenceStatus | None = None,
    battery_low: bool = False,
    battery_lost: bool = False,
    sources_disagree: bool = False,
    compasses_apart: str = "",
    gcs_required: bool = False,
    gcs_heard: bool = False,
    plan_needed: bool = False,
    plan_loaded: bool = False,
    plan_refusal: str = "",
) -> tuple[str, ...]:
    """Return all reasons against arming; empty = may arm.

    ``holding_causes``: failsafe conditions of STOP or worse whose cause still stands, so that arming cannot clear them.
    ``guard_reason``: what ``DepthGuard.refusal`` answered. By hand an operator may sail out of a breach, off a shoal and
    without position, so these count only for modes that steer themselves. What bars a departure only, a store for one,
    is added by ``refusals.prearm_reasons``.
    """
    found = [
        (terminated, "terminated: restart first"),
        (emergency_stop, "emergency stop is active"),
        (not actuator_ready, f"actuators not ready: {actuator_reason or 'no answer'}"),
        (sources_disagree, "position sources disagree"),
        (bool(compasses_apart), f"compasses disagree: {compasses_apart}; {_FORBID}"),
        (battery_low, "battery low"),
        (battery_lost, "battery sensor lost"),
        (gcs_required and not gcs_heard, "no ground station heard"),
    ]
    if mode in _STEERS_ITSELF:
        found.append((not state.position_valid, "no position"))
        found.append((not state.heading_valid, "no heading"))
        # of a boat that a stream carries, and whose compass was never heard, the stream's course would pass for the bow's
        found.append((state.heading_from_course, "no compass: the course stands in for the heading"))
        found.append((guard_reason is not None, guard_reason or ""))
        found.append((guard is GuardState.LOCKED and guard_reason is None, "depth guard locked"))
        found.append((depth_required and not altitude_known, "water depth unknown, and depth.required is set"))
        found.append((fence is not None and fence.breached, "outside the fence"))
        found.append((mode is Mode.AUTO and plan_needed and not plan_loaded, "no plan loaded"))
        found.append((mode is Mode.AUTO and bool(plan_refusal), f"plan: {plan_refusal}"))
    else:
        holding_causes = [cause for cause in holding_causes if BY_NAME[cause].takeover is Takeover.NEVER]
    standing = [f"failsafe: {BY_NAME[cause].text}" for cause in holding_causes]
    return tuple([text for holds, text in found if holds] + standing)


LEFT_IN: Final = (Mode.GUIDED, Mode.CIRCLE)
"""A plan and a Return have looks and words of their own."""


class LeftOrder:
    """An order that leads somewhere and was given while disarmed: told at arming, or dropped when somebody else arms.

    Who arms may have just come aboard, and who ordered be long gone. A stream is no such order: whoever sends it is still there.
    """

    def __init__(self) -> None:
        self._by: Station | None = None
        """Who gave it; None = the vessel's own people."""

    def given(self, station: Station | None) -> None:
        """An order that moves was obeyed."""
        self._by = station

    def at_arming(self, parts: Parts, state: EstimatedState, station: Station | None) -> Sequence[tuple[Severity, str]]:
        """Say to whoever arms where the vessel is bound for; it holds instead when the order is not his."""
        order, giver = order_words(parts.navigator, state), self._by
        if not order:
            return ()
        if parts.operators.is_same(giver, station):
            return ((Severity.NOTICE, order),)
        whose = "from aboard" if giver is None else f"of {giver if station is None else giver.beside(station)}"
        parts.navigator.enter(Mode.HOLD, state)
        return ((Severity.WARNING, f"{order}: order {whose} dropped, holding here"),)


class KeptOrder:
    """The go-to, circle or course that stands, or that a failsafe broke off: the order of its mode then goes on with it."""

    def __init__(self) -> None:
        self._body: Reposition | Orbit | GuidedHeading | None = None

    def given(self, body: RequestBody, navigator: Navigator, stood: Leg | Steer | None) -> None:
        """An order was obeyed. ``stood``: what stood before it."""
        stands = navigator.standing
        if stands is not None and stands is stood:
            return
        self._body = None
        match body, stands:
            case GuidedHeading(), Steer(psi_rad=psi_rad, speed_mps=speed_mps):
                self._body = replace(body, psi_rad=psi_rad, speed_mps=speed_mps, throttle=None)
            case Reposition(), Leg(maneuver=goal):
                self._body = replace(body, lat_rad=goal.lat_rad, lon_rad=goal.lon_rad, change_mode=True)
            case Orbit(), Leg(maneuver=goal):
                self._body = replace(body, lat_rad=goal.lat_rad, lon_rad=goal.lon_rad)
            case SetMode(mode=Mode.CIRCLE), Leg(maneuver=goal):
                self._body = Orbit(goal.lat_rad, goal.lon_rad)

    def take_speed(self, speed_mps: float | None) -> None:
        """The speed was changed for what is under way."""
        self._body = None if self._body is None else replace(self._body, speed_mps=speed_mps)

    def drop(self) -> None:
        """Somebody has left it."""
        self._body = None

    def meant(self, body: RequestBody, broken_off: Mode | None) -> RequestBody:
        """What an order means while the mode ``broken_off`` waits: to go on with what was ordered in it."""
        kept = self._body
        goes_on = kept is not None and isinstance(body, SetMode) and body.mode is broken_off is kept.nature.aim[0]
        return kept if kept is not None and goes_on else body


def order_words(navigator: Navigator, state: EstimatedState) -> str:
    """The order that stands, in words; "" = it leads nowhere."""
    standing = navigator.standing if navigator.mode in LEFT_IN else None
    if standing is None:
        return ""
    if isinstance(standing, Steer):
        what = "Course" if standing.course else "Heading"
        return f"{what} {math.degrees(standing.psi_rad) % 360.0:.0f} deg at {standing.speed_mps:.1f} m/s"
    goal = standing.maneuver
    what = "Go-to" if isinstance(goal, Goto) else "Circle"
    if state.lat_rad is None or state.lon_rad is None:
        return f"{what}, distance unknown"
    away_m = inverse(state.lat_rad, state.lon_rad, goal.lat_rad, goal.lon_rad)[0]
    return f"{what} {shown(away_m)} away" if away_m >= THERE_M or what == "Circle" else ""
