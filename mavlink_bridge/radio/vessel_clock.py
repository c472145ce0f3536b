"""The vessel's clock as the shore can tell it: how old a state is that waited aboard until the hour had room for it.

States carry the vessel's seconds modulo 4096. The one that came soonest after it was made stands for no delay at all; a
little is forgiven each hour, as the two clocks do not run alike.
"""

from __future__ import annotations

from typing import Final

from .air.profile import LinkSettings
from .codec.state_fields import CLOCK_S

_DRIFT: Final = 2e-4
_HALF_S: Final = CLOCK_S / 2


class VesselClock:
    """Turns the vessel's seconds into times here, for profiles whose states may wait; of others each is as old as its way."""

    def __init__(self, settings: LinkSettings) -> None:
        self._is_needed = settings.batch > 1 and settings.batch * settings.state_s < _HALF_S
        self._session: bytes | None = None
        self._offset_s: float | None = None
        self._newest_s: int | None = None
        self._heard_us = 0

    def of_session(self, session: bytes | None) -> bool:
        """The vessel's clock begins anew with each of its starts. Returns whether this is another start than the one known."""
        is_another = self._session is not None and session != self._session
        if is_another:
            self._offset_s = self._newest_s = None
        self._session = session
        return is_another

    def made_us(self, t_s: int, now_us: int) -> int | None:
        """When a state of the vessel's second ``t_s`` that has just come was true; None when a later one has come already."""
        if not self._is_needed:
            return now_us
        now_s = now_us * 1e-6
        # after half a round of the vessel's seconds nothing older than the last state can be on its way any more
        is_recent = now_us - self._heard_us < _HALF_S * 1e6
        if self._newest_s is not None and is_recent and _signed_s(t_s - self._newest_s) < 0:
            return None
        self._newest_s = t_s
        if self._offset_s is None:
            self._offset_s, self._heard_us = now_s - t_s, now_us
        self._offset_s += _DRIFT * (now_us - self._heard_us) * 1e-6
        self._heard_us = now_us
        late_s = _signed_s(now_s - t_s - self._offset_s)
        self._offset_s += min(late_s, 0.0)
        return now_us - round(max(late_s, 0.0) * 1e6)


def _signed_s(seconds: float) -> float:
    return (seconds + _HALF_S) % CLOCK_S - _HALF_S
