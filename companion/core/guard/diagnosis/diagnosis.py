"""One vessel's diagnosis: a tick in, now and then a cause out, each told once in an arming."""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.messages import ActuatorOutput, EstimatedState, Severity

from ...hull import ForceModel, VesselConfig
from .causes import Cause, withdrawn
from .residual import SAMPLE_S, Residual
from .suspects import suspects
from .weather import GALE_MPS, Bounds, Pair
from .weighing import Weighing

_GUSTS: Final = 0.4
"""Share of its push by which it comes and goes, taken for the noise until the weather is known."""
_LEAST: Final = 0.03
"""Share of one thruster's pull that no sensor shows."""
_OFF: Final = 0.2
"""Share of one thruster's pull by which a hull file may be off for ever."""
_DOUBTFUL_US: Final = 45_000_000
"""What was told so shortly before a heading is proven wrong was told by it: one that creeps by a degree a second shows as a thruster
up to half a minute sooner."""


class Diagnosis:
    """One call per tick under arms. A vessel with two thrusters on the centre line is not judged: it has no side."""

    def __init__(self, vessel: VesselConfig) -> None:
        model = ForceModel(vessel)
        self._is_judged = vessel.thruster.count == 1 or model.lateral_m > 0.0
        among = suspects(vessel)
        self._residual = Residual(vessel, model, among)
        self._weighing = Weighing(among, _bounds(vessel, model))
        self.told: frozenset[Cause] = frozenset()
        self._told_us: dict[Cause, int] = {}
        self._heading_wrong = False

    def clear(self) -> None:
        """Forget all: disarmed."""
        self.rest()
        self.told = frozenset()
        self._told_us.clear()

    def rest(self) -> None:
        """What is wrong is known: the hull is no longer what its file says, and nothing else can be told by it."""
        self._residual.forget()
        self._weighing.forget()

    def heed(self, now_us: int, *, heading_wrong: bool) -> list[tuple[Severity, str]]:
        """Take whether thrust has proven the heading wrong; where it just has, return the texts that take back what was told by it."""
        is_new, self._heading_wrong = heading_wrong and not self._heading_wrong, heading_wrong
        if not is_new:
            return []
        self.rest()
        doubtful = [cause for cause, told_us in self._told_us.items() if now_us - told_us < _DOUBTFUL_US]
        self.told -= frozenset(doubtful)
        self._told_us.clear()
        return [(Severity.NOTICE, withdrawn(cause)) for cause in doubtful]

    @property
    def opinion(self) -> frozenset[Cause] | None:
        """What may be behind what the hull does now, and nothing else may; None as long as nothing is known of the weather."""
        return self._weighing.opinion if self._is_judged else None

    @property
    def before_mps(self) -> tuple[float, float]:
        """The drift, north and east, as it was before anything was suspected."""
        return self._residual.before_mps

    def step(self, dt_s: float, state: EstimatedState, sent: ActuatorOutput | None) -> Cause | None:
        """Return a cause when there is a new one."""
        if not self._is_judged:
            return None
        sample = self._residual.step(dt_s, state, sent, self._weighing.suspected)
        cause = None if sample is None else self._weighing.step(SAMPLE_S, sample)
        if cause is None or cause in self.told:
            return None
        self.told |= {cause}
        self._told_us[cause] = state.t_us
        return cause


def _bounds(vessel: VesselConfig, model: ForceModel) -> Bounds:
    side_n = vessel.thruster.ahead_n
    lever_m = model.lateral_m or _rudder_lever_m(vessel, model)
    side = (side_n, side_n * lever_m)
    slant_mps = GALE_MPS * math.sqrt(0.5)
    gale = (abs(model.wind(GALE_MPS, 0.0)[0]), abs(model.wind(slant_mps, slant_mps)[2]))
    least, first = _squares(_LEAST, side), _squares(_GUSTS, gale)
    first = (max(least[0], first[0]), max(least[1], first[1]))
    most = (gale[0] + _OFF * side[0], gale[1] + _OFF * side[1])
    return Bounds(least, first, most, lever_m=lever_m)


def _rudder_lever_m(vessel: VesselConfig, model: ForceModel) -> float:
    """Moment of the rudder hard over in the race, over the thrust of the only propeller: what stands for a side's lever."""
    half_n = 0.5 * vessel.thruster.ahead_n
    return model.rudder_slope_nm(0.0, half_n, half_n) * vessel.rudder.max_rad / vessel.thruster.ahead_n


def _squares(share: float, pair: Pair) -> Pair:
    return share * share * pair[0] * pair[0], share * share * pair[1] * pair[1]
