"""Roll and pitch: of each one source is used, the others are compared with it, and what is too old is unknown."""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.messages import EulerAngles
from mavlink_bridge.language.units import wrap_pi

from .config import EstimatorConfig
from .sources import Choice, Texts, degrees

_APART_RAD: Final = math.radians(5.0)
"""Two sensors on one hull: how askew they are mounted, and how late one is in a wave."""


class _Axis:
    """One of the two."""

    def __init__(self, what: str, texts: Texts) -> None:
        self.choice = Choice(what, texts, least_s=1.0, most_s=3.0, figure=degrees)
        self.newest: tuple[float, int] | None = None
        self.offset_rad = 0.0

    def update(self, angle_rad: float | None, angles: EulerAngles, link: int) -> bool:
        """Take an angle of a message, None where it has none; True when its source is the one that counts."""
        if angle_rad is None:
            return False
        level_rad = wrap_pi(angle_rad + self.offset_rad)
        if self.choice.leads(angles.source, link, angles.t_us):
            self.newest = (level_rad, angles.t_us)
            return True
        self.choice.compare_newest(angles, link, value=level_rad, used=self.newest, limit=_APART_RAD)
        return False


class Tilt:
    """Both."""

    def __init__(self, texts: Texts) -> None:
        self._roll, self._pitch = _Axis("Roll", texts), _Axis("Pitch", texts)

    def configure(self, config: EstimatorConfig) -> None:
        """Take new settings; the state is kept."""
        self._timeout_us = config.attitude_timeout_s * 1e6
        self._roll.offset_rad = math.radians(config.roll_offset_deg)
        self._pitch.offset_rad = math.radians(config.pitch_offset_deg)

    @property
    def choices(self) -> dict[str, Choice]:
        """The choice of each by the name of its quantity."""
        return {"roll": self._roll.choice, "pitch": self._pitch.choice}

    @property
    def is_known(self) -> bool:
        """Whether roll or pitch has ever been measured."""
        return self._roll.newest is not None or self._pitch.newest is not None

    def update(self, angles: EulerAngles, link: int) -> bool:
        """Take what a message tells of both; True when it is the source that counts for one of them."""
        is_roll = self._roll.update(angles.phi_rad, angles, link)
        return self._pitch.update(angles.theta_rad, angles, link) or is_roll

    def at(self, now_us: int) -> tuple[float | None, float | None]:
        """Roll and pitch, rad; None where unknown or too old."""
        return self._fresh(self._roll, now_us), self._fresh(self._pitch, now_us)

    def is_too_old(self, t_us: int, now_us: int) -> bool:
        """Whether what was measured then says nothing now."""
        return now_us - t_us > self._timeout_us

    def _fresh(self, axis: _Axis, now_us: int) -> float | None:
        newest = axis.newest
        return None if newest is None or now_us - newest[1] > self._timeout_us else newest[0]

    def beside(self, t_us: int, compass: EulerAngles | None) -> EulerAngles:
        """Roll and pitch beside what the compass says, at a time; of either what is too old is left out."""
        if compass is None or self.is_too_old(compass.t_us, t_us):
            compass = EulerAngles(t_us)
        phi_rad, theta_rad = self.at(t_us)
        return EulerAngles(
            t_us=t_us,
            phi_rad=phi_rad,
            theta_rad=theta_rad,
            psi_rad=compass.psi_rad,
            psi_magnetic_rad=compass.psi_magnetic_rad,
            psi_accuracy_rad=compass.psi_accuracy_rad,
            variation_rad=compass.variation_rad,
        )
