"""What the coefficients of a fit come to for whoever sails the boat, and how surely: thrust, drag, turning, the sides, the way to rest; and
how late her compass is.

A coefficient by itself is told poorly where another may stand for it (linear drag for square drag, slip for thrust); what they do together
at a speed that the boat sails at is told much better, and is all that an operator notices.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ..core.hull import VesselConfig
from ..core.hull.statics import Statics
from ..core.hull.thrust import ThrustLaw
from .fit import Fit
from .hull_arrays import coefficients
from .problem import RATE_FILTER_S, TOGETHER
from .unknowns import FitUnknown, with_values

Array = Any

THROTTLE: Final = 0.6
"""What most boats sail at: all is told at this throttle, and at the speed that it comes to."""
_TURN_RADPS: Final = 0.3
"""A turn that any boat sails."""
_NUDGE: Final = 1e-3
LEAST_LATE_S: Final = 0.1
"""Less is not told: the heading loop bears 0.15 s as it is, and a hull that slips otherwise than the model looks 0.08 s late."""
MOST_LATE_S: Final = 0.4
"""More is never to be set: boats are steered by compasses that are quicker, and settings that said 0.9 s of one on time made legs in a blow
four times as wide."""


def vessel_at(vessel: VesselConfig, unknowns: list[FitUnknown], theta: Array) -> VesselConfig:
    """The vessel at a point of a fit, its way to rest without the file's safety factor."""
    values = {u.name: float(u.value(theta[k])) for k, u in enumerate(unknowns)}
    shares = {name: values.pop(name) for name in TOGETHER if name in values}
    base = coefficients(vessel)
    for together, share in shares.items():
        for name in TOGETHER[together]:
            values[name] = share * values.get(name, base[name])
    return with_values(vessel, values).model_copy(update={"stopping_factor": 1.0})


class Effects:
    """Logarithms of what a fit comes to, against the file's."""

    def __init__(self, vessel: VesselConfig, unknowns: list[FitUnknown]) -> None:
        self._vessel, self._unknowns = vessel, unknowns
        plain = vessel.model_copy(update={"stopping_factor": 1.0})
        self._speed_mps = Statics(plain).throttle_to_speed(THROTTLE)
        self._by_file = self._of(plain, self._speed_mps)

    def at(self, theta: Array) -> dict[str, float]:
        """Logarithm of each one's share of what the file says."""
        found = self._of(vessel_at(self._vessel, self._unknowns, theta), self._speed_mps)
        return {name: float(np.log(value / self._by_file[name])) for name, value in found.items()}

    def covariance(self, theta: Array, covariance: Array) -> Array:
        """Of these logarithms, in their order, to first order."""
        slopes = []
        for k in range(len(self._unknowns)):
            ends = [self.at(theta + side * _NUDGE * np.eye(len(theta))[k]) for side in (1.0, -1.0)]
            slopes.append([(ends[0][name] - ends[1][name]) / (2.0 * _NUDGE) for name in self._by_file])
        by = np.array(slopes)
        return by.T @ covariance @ by

    def _of(self, vessel: VesselConfig, speed_mps: float) -> dict[str, float]:
        hull, law, statics = vessel.hull, ThrustLaw(vessel), Statics(vessel)
        found = {
            "thrust": law.thrust_n(0, law.revs(THROTTLE), speed_mps),
            "drag": statics.drag_n(speed_mps),
            "turning": hull.nr + hull.nrr * _TURN_RADPS + hull.nur * speed_mps,
            "rest": statics.stopping_distance_m(speed_mps),
        }
        names = {u.name for u in self._unknowns}
        found |= {"starboard_share": vessel.thruster.starboard_share} if "starboard_share" in names else {}
        return found | ({"area": vessel.rudder.area_m2} if "area" in names else {})


@dataclass(frozen=True, slots=True)
class Blame:
    """What one cause must be to explain logarithms of thrust and drag, its variance, and what it leaves, in squares of spreads."""

    log: float
    variance: float
    left: float

    @staticmethod
    def of(way: Array, found: Array, covariance: Array) -> Blame:
        """``way``: by how much each of the found changes with the cause."""
        belief = np.linalg.inv(covariance)
        variance = 1.0 / float(way @ belief @ way)
        log = variance * float(way @ belief @ found)
        rest = found - log * way
        return Blame(log, variance, float(rest @ belief @ rest))


def heading_late_s(fit: Fit) -> float:
    """By how much the recorded heading is late at least; 0 where the record does not show it.

    What shows it is the track: a heading that is told late makes sway of surge in every turn. That the turn rate comes late after the
    commands shows nothing: thrusters that run up slowly look the same, and a rate stays late when the settings already make up for the
    heading's age. So the fit's belief that both are late together is taken out, and only the lower end of the interval is told:
    whoever sets it and sails again is told the rest, or nothing.
    """
    names = [u.name for u in (*fit.unknowns, *fit.untold)]
    if not fit.known.get("bow_late", False):
        return 0.0
    bow = names.index("bow_late")
    learnt = 1.0 - min(float(fit.covariance[bow, bow]), 1.0)
    weight = np.zeros(len(names))
    weight[bow] = fit.unknowns[bow].width
    late_s = fit.values["bow_late"]
    # of a foreign log with a sway of its own the fit takes rate and heading for two
    if "sensor_forward" not in fit.values and "heading_late" in fit.values:
        rate = names.index("heading_late")
        weight[rate] = learnt * fit.unknowns[rate].width
        late_s += learnt * (fit.values["heading_late"] - RATE_FILTER_S)
    least_s = late_s - 2.0 * float(np.sqrt(weight @ fit.covariance @ weight))
    return least_s if least_s > LEAST_LATE_S else 0.0
