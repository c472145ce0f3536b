"""What each cause would make of thrust and rudder angle: the hypotheses that are weighed, and what each changes on the hull.

A fault's size is not known, so a cause has several suspects: nothing left and a third left of a thruster, a rudder that
stands at one of five angles or trails with the flow. What lies between them is nearer to one of its own than to another cause.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from mavlink_bridge.language.value import value

from ...hull import ForceModel, VesselConfig
from .causes import Cause

_LITTLE: Final = 0.3
"""What is left of a thruster's pull with a blade full of weed."""
_RARE: Final = 4.0
"""Two propellers do not fail in one moment, but for a rope in both: odds of fifty to one against it. Without them a single one that
failed was found so late in a sea trial that she was carried out of its circle."""
_SLIP: Final = 0.4
"""And of both in aerated water or aground on mud."""
_STANDS: Final = (-0.67, -0.33, 0.0, 0.33, 0.67)
"""Angles at which rudders may stand, as shares of the greatest: none in between is farther than a sixth from one."""


@value
class Acting:
    """How the hull goes through the water, and what its actuators should do: means over one sample."""

    u_mps: float
    v_mps: float
    r_radps: float
    port_n: float
    starboard_n: float
    rudder_rad: float


Instead = tuple[float, float, float | None]
"""What acts instead: port (N), starboard (N), rudders (rad, None = they trail with the flow)."""


@value
class Suspect:
    """One hypothesis."""

    cause: Cause
    instead: Callable[[Acting], Instead]
    rare: float = 0.0
    """Log odds against it before anything is seen."""


def suspects(vessel: VesselConfig) -> tuple[Suspect, ...]:
    """Every hypothesis that this vessel's actuators allow."""
    found = _of_one(vessel) if vessel.thruster.count == 1 else _of_two(vessel)
    if vessel.rudder.count:
        found += [Suspect(Cause.RUDDERS_STILL, partial(_stands, at * vessel.rudder.max_rad)) for at in _STANDS]
        found.append(Suspect(Cause.RUDDERS_STILL, _trails))
        found.append(Suspect(Cause.RUDDERS_REVERSED, partial(_mirrored, vessel.rudder.offset_rad)))
    return tuple(found)


def _of_one(vessel: VesselConfig) -> list[Suspect]:
    """A single thruster that slips is one that gives little."""
    return [
        Suspect(Cause.WEAK, partial(_share, 0.0, 0.0)),
        Suspect(Cause.WEAK, partial(_share, _LITTLE, _LITTLE)),
        Suspect(Cause.REVERSED, partial(_both_reversed, _astern(vessel))),
    ]


def _of_two(vessel: VesselConfig) -> list[Suspect]:
    astern = _astern(vessel)
    return [
        Suspect(Cause.PORT_WEAK, partial(_share, 0.0, 1.0)),
        Suspect(Cause.PORT_WEAK, partial(_share, _LITTLE, 1.0)),
        Suspect(Cause.STARBOARD_WEAK, partial(_share, 1.0, 0.0)),
        Suspect(Cause.STARBOARD_WEAK, partial(_share, 1.0, _LITTLE)),
        Suspect(Cause.PORT_REVERSED, partial(_port_reversed, astern)),
        Suspect(Cause.STARBOARD_REVERSED, partial(_starboard_reversed, astern)),
        Suspect(Cause.SLIP, partial(_share, _SLIP, _SLIP)),
        Suspect(Cause.SLIP, partial(_share, 0.0, 0.0), _RARE),
        Suspect(Cause.SWAPPED, partial(_swapped, vessel.thruster.starboard_share)),
    ]


def _astern(vessel: VesselConfig) -> float:
    """Thrust astern over thrust ahead."""
    return vessel.thruster.astern_n / vessel.thruster.ahead_n


def effect(model: ForceModel, suspect: Suspect, acting: Acting, healthy: tuple[float, float]) -> tuple[float, float]:
    """What the suspect adds to the hull's surge force (N) and yaw moment (Nm) beyond what healthy actuators give."""
    surge_n, yaw_nm = pushed(model, acting, *suspect.instead(acting))
    return surge_n - healthy[0], yaw_nm - healthy[1]


def pushed(
    model: ForceModel, acting: Acting, port_n: float, starboard_n: float, rudder_rad: float | None
) -> tuple[float, float]:
    """Surge force and yaw moment of these thrusts and this angle of the rudders."""
    return model.actuator_forces((acting.u_mps, acting.v_mps, acting.r_radps), (port_n, starboard_n), rudder_rad)


def _share(port: float, starboard: float, a: Acting) -> Instead:
    return port * a.port_n, starboard * a.starboard_n, a.rudder_rad


def _port_reversed(astern: float, a: Acting) -> Instead:
    return _reversed(a.port_n, astern), a.starboard_n, a.rudder_rad


def _starboard_reversed(astern: float, a: Acting) -> Instead:
    return a.port_n, _reversed(a.starboard_n, astern), a.rudder_rad


def _both_reversed(astern: float, a: Acting) -> Instead:
    return _reversed(a.port_n, astern), _reversed(a.starboard_n, astern), a.rudder_rad


def _reversed(thrust_n: float, astern: float) -> float:
    """A propeller that turns the other way gives less than it should ahead, and more than it should astern."""
    return -thrust_n * astern if thrust_n > 0.0 else -thrust_n / astern


def _swapped(share: float, a: Acting) -> Instead:
    """Each turns as the other should; ``share``: what the starboard one gives of what the port one does."""
    return a.starboard_n / share, a.port_n * share, a.rudder_rad


def _stands(at_rad: float, a: Acting) -> Instead:
    return a.port_n, a.starboard_n, at_rad


def _trails(a: Acting) -> Instead:
    return a.port_n, a.starboard_n, None


def _mirrored(offset_rad: float, a: Acting) -> Instead:
    """The command turns round, not what the rudders stand off by: that is how they are mounted."""
    return a.port_n, a.starboard_n, 2.0 * offset_rad - a.rudder_rad
