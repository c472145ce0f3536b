"""Whether the thrusters' difference, or the rudders, turn the hull the wrong way round: leads changed over, a servo mounted mirrored.

A helm that works the wrong way leaves a moment missing that is twice what was asked, with the other sign. Wind, a file
that is off, or a rudder that stands still leave at most as much as the helm that is held against it. Only a helm that is
larger than a gale's moment is judged, and only until it has worked for a while: wires do not change on the water. A heading that comes
late looks like it, too: where that is enough for what is missing nothing is found.
"""

from __future__ import annotations

from typing import Final

_MEMORY_S: Final = 4.0
"""A boat whose helm turns it the wrong way is at full helm within two or three seconds."""
_HELD_S: Final = 4.0
"""As long again: a gust that happens to look like it is gone by then."""
_TWICE: Final = (1.5, 2.8)
"""Missing over asked, both ways of the helm: 1 is a helm that does nothing, 2 one that does the opposite."""
_ONCE: Final = 0.5
"""A thruster that gives nothing leaves all of its own moment missing, weed half of it."""
_EXPLAINED: Final = 0.85
"""Share of what is missing that the helm must explain."""
_PROVEN_S: Final = 30.0
"""A helm that has worked for so long in this arming is wired as it should be: nobody changes leads over on the water, and what looks
like it later is a gale."""


class _Fit:
    """How well one moment explains what is missing, over the last seconds."""

    def __init__(self) -> None:
        self.own = self._both = self._missing = 0.0

    def step(self, dt_s: float, own_nm: float, missing_nm: float) -> None:
        share = dt_s / _MEMORY_S
        self.own += share * (own_nm * own_nm - self.own)
        self._both -= share * (own_nm * missing_nm + self._both)
        self._missing += share * (missing_nm * missing_nm - self._missing)

    def explains(self, least: float, most: float) -> bool:
        """What is missing is this moment so many times over, and goes as it goes."""
        about = least * self.own < self._both < most * self.own
        return about and self._both * self._both > _EXPLAINED * self.own * self._missing


class WrongWay:
    """One helm of one vessel; one call per tick."""

    def __init__(self, least_nm: float) -> None:
        self._least = least_nm * least_nm
        self._helm, self._sides = _Fit(), (_Fit(), _Fit())
        self._held_s = self._right_s = 0.0
        self.found = False

    def step(
        self,
        dt_s: float,
        helm_nm: float,
        sides_nm: tuple[float, float],
        missing_nm: float,
        *,
        may_be: bool = True,
        is_late: bool = False,
        patience: float = 1.0,
    ) -> None:
        """Take what this helm and each thruster should turn the hull by, and what is missing of all, after one low-pass.

        ``may_be``: nothing else is likelier. ``is_late``: a heading that comes late is enough for what is missing. ``patience``: so many
        times as long it must look so.
        """
        self._helm.step(dt_s, helm_nm, missing_nm)
        for fit, side_nm in zip(self._sides, sides_nm, strict=True):
            fit.step(dt_s, side_nm, missing_nm)
        # a single propeller that is dead or turns the other way leaves the same, as long as the helm does not change
        one_alone = any(fit.explains(_ONCE, _TWICE[1]) for fit in self._sides)
        is_clear = self._helm.own > self._least
        looks_so = is_clear and self._helm.explains(*_TWICE) and not one_alone and not is_late
        self._held_s = self._held_s + dt_s if looks_so else 0.0
        self._right_s += dt_s if is_clear and not looks_so else 0.0
        self.found = self.found or (may_be and self._held_s > patience * _HELD_S and self._right_s < _PROVEN_S)
