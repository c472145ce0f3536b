"""Faults of thrusters and rudders put into the simulated hull, and when the vessel tells of them, counted from the truth.

A fault counts from the first moment at which it changes what pushes or turns the hull: a propeller that is not asked for
anything shows nothing. That moment comes from a sound twin of the hull, which gets the same commands and the same motion.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from companion.core.guard.diagnosis import Cause, Diagnosis
from companion.core.guard.propulsion import PropulsionWatch
from companion.core.hull import VesselConfig
from sitl.plant import SimVessel

from .control_loop import TICK_S, ControlLoop

Fault = Callable[[SimVessel], None]
"""Puts the fault into a hull; called once."""

_SHARE: Final = 0.2
"""Of what is commanded: a fault that changes less is none yet."""
_LEAST: Final = 0.02
"""Of full thrust: where hardly anything is commanded any change is a fifth of it."""
_STILL_MPS: Final = 0.05
"""A rudder trails with no less flow than this."""


def thrusters(port: float, starboard: float) -> Fault:
    """Return the fault after which each side gives this share of its thrust."""

    def break_down(vessel: SimVessel) -> None:
        vessel.thruster_health[:] = [port, starboard]

    return break_down


def stuck(degrees: float) -> Fault:
    """Return the fault of rudders that stand at an angle."""

    def break_down(vessel: SimVessel) -> None:
        vessel.rudder_stuck_rad[:] = [math.radians(degrees)] * 2

    return break_down


def wired(change: Callable[[float, float, float, float], tuple[float, float, float, float]]) -> Fault:
    """Return the fault of leads: ``change`` makes of the four commands what arrives."""

    def break_down(vessel: Any) -> None:
        step = vessel.step

        def rewired(
            dt_s: float,
            thruster_port: float,
            thruster_starboard: float,
            rudder_port_rad: float,
            rudder_starboard_rad: float,
            **water: Any,
        ) -> None:
            told = change(thruster_port, thruster_starboard, rudder_port_rad, rudder_starboard_rad)
            names = ("thruster_port", "thruster_starboard", "rudder_port_rad", "rudder_starboard_rad")
            step(dt_s, **dict(zip(names, told, strict=True)), **water)

        vessel.step = rewired

    return break_down


def trailing(vessel: Any) -> None:
    """Rudders that have come off their stocks: they lie in the flow, that of the propellers too."""
    step = vessel.step

    def trailed(dt_s: float, *commands: float, **named: Any) -> None:
        across = vessel.v_mps + vessel.config.rudder.x_m * vessel.r_radps
        for side, (thrust_n, aside) in enumerate(zip(vessel.thrust_n, (1.0, -1.0), strict=True)):
            along = vessel.u_mps + aside * vessel.model.lateral_m * vessel.r_radps
            race2 = vessel.model.race_per_n * max(0.0, thrust_n)
            flow_mps = max(_STILL_MPS, math.sqrt(race2 + along * along))
            vessel.rudder_stuck_rad[side] = math.copysign(math.atan2(across, flow_mps), -across)
        step(dt_s, *commands, **named)

    vessel.step = trailed


REVERSED: Final = wired(lambda port, starboard, a, b: (-port, starboard, a, b))
STARBOARD_REVERSED: Final = wired(lambda port, starboard, a, b: (port, -starboard, a, b))
SWAPPED: Final = wired(lambda port, starboard, a, b: (starboard, port, a, b))
MIRRORED: Final = wired(lambda port, starboard, a, b: (port, starboard, -a, -b))

_OF_TWO: Final = {
    "port dead": (thrusters(0.0, 1.0), Cause.PORT_WEAK),
    "starboard dead": (thrusters(1.0, 0.0), Cause.STARBOARD_WEAK),
    "weed to port": (thrusters(0.3, 1.0), Cause.PORT_WEAK),
    "weed to starboard": (thrusters(1.0, 0.4), Cause.STARBOARD_WEAK),
    "slip": (thrusters(0.4, 0.4), Cause.SLIP),
    "port reversed": (REVERSED, Cause.PORT_REVERSED),
    "starboard reversed": (STARBOARD_REVERSED, Cause.STARBOARD_REVERSED),
    "swapped": (SWAPPED, Cause.SWAPPED),
}
_OF_ONE: Final = {
    "dead": (thrusters(0.0, 0.0), Cause.WEAK),
    "weed": (thrusters(0.3, 0.3), Cause.WEAK),
    "reversed": (wired(lambda port, starboard, a, b: (-port, -starboard, a, b)), Cause.REVERSED),
}
_OF_RUDDERS: Final = {
    "rudders stuck at 15 degrees": (stuck(15.0), Cause.RUDDERS_STILL),
    "rudders stuck amidships": (stuck(0.0), Cause.RUDDERS_STILL),
    "rudders free": (trailing, Cause.RUDDERS_STILL),
    "rudders mirrored": (MIRRORED, Cause.RUDDERS_REVERSED),
}


def faults(vessel: VesselConfig) -> dict[str, tuple[Fault, Cause]]:
    """Return each fault that this vessel can have, by name, with its cause: twelve on a hull of two thrusters and rudders."""
    found = dict(_OF_ONE if vessel.thruster.count == 1 else _OF_TWO)
    return found | _OF_RUDDERS if vessel.rudder.count else found


class SoundTwin:
    """The hull without the fault: same commands, same motion. Make it before the fault is put in."""

    def __init__(self, run: ControlLoop) -> None:
        self._run, self._twin = run, SimVessel(run.vessel.config)
        thruster = run.vessel.config.thruster
        model = run.vessel.model
        full_n = thruster.ahead_n * thruster.count
        half_n = 0.5 * full_n
        helm_nm = model.rudder_slope_nm(0.0, half_n, half_n) * run.vessel.config.rudder.max_rad
        self._least = _LEAST * full_n, _LEAST * max(model.lateral_m * full_n, helm_nm)

    def differs(self) -> bool:
        """Take the tick that has just been sailed; return whether the fault has changed surge force or yaw moment by a fifth."""
        run, twin, sent = self._run, self._twin, self._run.sent
        if sent is None:
            return False
        hull = run.vessel
        for name in ("north_m", "east_m", "psi_rad", "u_mps", "v_mps", "r_radps", "vn_mps", "ve_mps"):
            setattr(twin, name, getattr(hull, name))
        through = hull.u_mps, hull.v_mps, hull.r_radps
        for _ in range(3):  # as the loop steps it
            twin.step(
                TICK_S / 3.0,
                sent.thruster_port,
                sent.thruster_starboard,
                rudder_port_rad=sent.rudder_port_rad,
                rudder_starboard_rad=sent.rudder_starboard_rad,
                water=run.water,
            )
        should, does = (
            boat.model.actuator_forces(through, (boat.thrust_n[0], boat.thrust_n[1]), boat.rudder_rad[0])
            for boat in (twin, hull)
        )
        return any(
            abs(it - wanted) > max(_SHARE * abs(wanted), least)
            for it, wanted, least in zip(does, should, self._least, strict=True)
        )


class Ears:
    """What the operator is told of thrusters and rudders: by the diagnosis, and by the watch that acts, wired as in the vessel."""

    def __init__(self, vessel: VesselConfig) -> None:
        self._diagnosis, self._watch = Diagnosis(vessel), PropulsionWatch(vessel)

    def step(self, run: ControlLoop) -> frozenset[Cause]:
        """Take a tick; return the causes that a new text leaves possible, none where there is no text."""
        watch, diagnosis = self._watch, self._diagnosis
        if any(watch.weak) or watch.helm_mirrored:
            diagnosis.rest()
            return frozenset()
        cause = diagnosis.step(TICK_S, run.state, run.sent)
        watch.step(TICK_S, run.state, run.sent, diagnosis.opinion, diagnosis.told, before_mps=diagnosis.before_mps)
        return frozenset([cause]) if cause is not None else self._acted_on()

    def _acted_on(self) -> frozenset[Cause]:
        watch = self._watch
        if watch.helm_mirrored:
            return frozenset([Cause.SWAPPED, Cause.RUDDERS_REVERSED])
        weak = (Cause.PORT_WEAK, Cause.STARBOARD_WEAK)
        wrong_way = (Cause.PORT_REVERSED, Cause.STARBOARD_REVERSED)
        causes = wrong_way if watch.flags.thruster_reversed else weak
        return frozenset(cause for cause, is_found in zip(causes, watch.weak, strict=True) if is_found)


@dataclass(frozen=True, slots=True)
class Told:
    """How a fault was told of; None: not in the time that was sailed."""

    causes: frozenset[Cause]
    shown_s: float | None
    """When the truth first showed it, after it began."""
    told_s: float | None
    """When the vessel told, after the truth showed it; before it where negative."""

    def within(self, seconds: float, cause: Cause) -> bool | None:
        """Whether this cause was told in time; None where the fault never showed."""
        if self.told_s is not None:
            return cause in self.causes and self.told_s <= seconds
        return None if self.shown_s is None else False


def tell(
    run: ControlLoop, fault: Fault, mps: float, *, fault_s: float = 30.0, wait_s: float = 15.0, most_s: float = 120.0
) -> Told:
    """Sail on under guidance, let the fault begin, and return how it was told.

    Ends ``wait_s`` after the truth showed it, or ``most_s`` after it began.
    """
    twin, ears = SoundTwin(run), Ears(run.setup.belief or run.setup.vessel)
    shown_s: float | None = None
    is_broken = False
    while run.t_s < fault_s + most_s and (shown_s is None or run.t_s < fault_s + shown_s + wait_s):
        if not is_broken and run.t_s > fault_s:
            fault(run.vessel)
            is_broken = True
        run.tick(mps)
        differs = twin.differs()
        if is_broken and shown_s is None and differs:
            shown_s = run.t_s - fault_s
        causes = ears.step(run)
        if causes:
            return Told(causes, shown_s, run.t_s - fault_s - (shown_s or 0.0))
    return Told(frozenset(), shown_s, None)
