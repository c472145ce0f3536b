"""One vessel's diagnosis: a tick in, now and then a cause out, each told once in an arming."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import ActuatorOutput, EstimatedState

from ...hull import ForceModel, VesselConfig
from .causes import Cause
from .evidence import Evidence, Noise
from .residual import SAMPLE_S, Residual
from .suspects import suspects

_GALE_MPS: Final = 10.0
"""More wind than such boats are sent out in."""
_GUSTS: Final = 0.4
"""Share of its push by which it comes and goes, taken for the noise until the weather is known."""
_LEAST: Final = 0.03
"""Share of one thruster's pull that no sensor shows."""


class Diagnosis:
    """One call per tick under arms. A vessel with one thruster, or with both on the centre line, is not judged."""

    def __init__(self, vessel: VesselConfig) -> None:
        model = ForceModel(vessel)
        self._is_judged = model.lateral_m > 0.0
        among = suspects(vessel)
        self._residual = Residual(vessel, model, among)
        self._evidence = Evidence(among, _noise(vessel, model))
        self.told: frozenset[Cause] = frozenset()

    def clear(self) -> None:
        """Forget all: disarmed."""
        self.rest()
        self.told = frozenset()

    def rest(self) -> None:
        """What is wrong is known: the hull is no longer what its file says, and nothing else can be told by it."""
        self._residual.forget()
        self._evidence.forget()

    def step(self, dt_s: float, state: EstimatedState, sent: ActuatorOutput | None) -> Cause | None:
        """Return a cause when there is a new one."""
        if not self._is_judged:
            return None
        sample = self._residual.step(dt_s, state, sent, self._evidence.suspected)
        cause = None if sample is None else self._evidence.step(SAMPLE_S, sample)
        if cause is None or cause in self.told:
            return None
        self.told |= {cause}
        return cause


def _noise(vessel: VesselConfig, model: ForceModel) -> Noise:
    side_n = vessel.thruster.ahead_n
    surge_n, _, _ = model.wind(_GALE_MPS, 0.0)
    slant_mps = _GALE_MPS * 0.5**0.5
    _, _, yaw_nm = model.wind(slant_mps, slant_mps)
    least = (_squared(_LEAST * side_n), _squared(_LEAST * side_n * model.lateral_m))
    first = (max(least[0], _squared(_GUSTS * surge_n)), max(least[1], _squared(_GUSTS * yaw_nm)))
    return Noise(least, first, model.lateral_m)


def _squared(number: float) -> float:
    return number * number
