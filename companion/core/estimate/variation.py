"""The variation of a magnetic heading: what a sentence tells, a setting, or the magnetic model, and what is said of a wrong one.

Compasses and receivers that were never set send a variation of 0.0, which few waters have.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from mavlink_bridge.language.messages import EulerAngles, Severity
from mavlink_bridge.language.units import wrap_pi

from .config import EstimatorConfig
from .sources import Texts, degrees

_OFF_RAD: Final = math.radians(3.0)
"""The model is good to half a degree, iron in the ground and a table of ten years ago to one or two: more is a wrong setting."""
_STANDS_US: Final = 10_000_000
"""A receiver that has just begun may not know its place yet."""


class Variation:
    """What the magnetic heading is off the true one, east positive."""

    def __init__(self, config: EstimatorConfig, texts: Texts) -> None:
        self.configure(config)
        self.by_model: Callable[[], float | None] = lambda: None
        """Of the magnetic model, where the vessel is."""
        self._texts = texts
        self._off_us: int | None = None
        self._said = False

    def configure(self, config: EstimatorConfig) -> None:
        """Take new settings; the state is kept."""
        self._set_rad = None if config.variation_deg is None else math.radians(config.variation_deg)

    def of(self, angles: EulerAngles) -> float | None:
        """The variation to be used; an exact zero only where nothing else is known."""
        told_rad = angles.variation_rad
        if told_rad:
            self._compare(angles, told_rad)
            return told_rad
        other_rad = self.by_model() if self._set_rad is None else self._set_rad
        return told_rad if other_rad is None else other_rad

    def _compare(self, angles: EulerAngles, told_rad: float) -> None:
        """Say once that a told variation is another than the model's; it counts all the same, for it was set by somebody."""
        if self._said:
            return
        model_rad = self.by_model()
        if model_rad is None or abs(wrap_pi(told_rad - model_rad)) <= _OFF_RAD:
            self._off_us = None
            return
        if self._off_us is None:
            self._off_us = angles.t_us
        if angles.t_us - self._off_us >= _STANDS_US:
            self._said = True
            text = f"Heading: the told variation is {_named(told_rad)}, here it is {_named(model_rad)}: set the compass"
            self._texts.append((Severity.WARNING, text))


def _named(variation_rad: float) -> str:
    return f"{degrees(abs(variation_rad))} {'W' if variation_rad < 0.0 else 'E'}"
