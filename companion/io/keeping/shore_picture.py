"""What a gateway keeps of the vessel for its next start: when it is stored, and that it is taken back."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from mavlink_bridge.radio.shore import ShoreTwin
from mavlink_bridge.radio.shore.memory import ShorePicture, read, write

from .content import SaveValue
from .store import AnyStore

PICTURE_KEY: Final = "gateway-twin"
_LOOK_US: Final = 1_000_000
"""Plans and parameters change seldom, and comparing them costs; what stations act on is looked at each time."""
_STATE_US: Final = 10_000_000
"""A state of which only the place is new is kept this often: its age is told, and a card wears out."""


class PictureKeeper:
    """One gateway's. ``started_utc_us``: the calendar at its start, 0 = unknown."""

    def __init__(self, twin: ShoreTwin, store: AnyStore, started_utc_us: int) -> None:
        self._twin, self._store = twin, store
        self._started_utc_us = started_utc_us
        self._kept: ShorePicture | None = None
        self._stood: tuple[object, ...] | None = None
        self._looked_us: int | None = None
        self._kept_us = 0
        picture = read(store.snapshot().values.get(PICTURE_KEY, ""))
        if picture is not None:
            twin.restore(picture, started_utc_us, 0)

    def keep(self, now_us: int, *, at_once: bool = False) -> None:
        """Store what is known of the vessel, when it is worth it: mode, armed bit and readiness at once when they change."""
        stands = self._stands()
        is_due = self._looked_us is None or now_us - self._looked_us >= _LOOK_US
        if not at_once and not is_due and stands == self._stood:
            return
        self._looked_us = now_us
        self._twin.link.keep(now_us, at_once=at_once)
        picture = self._twin.picture(self._started_utc_us + now_us if self._started_utc_us else 0, now_us)
        if picture != self._kept and (at_once or stands != self._stood or self._is_worth_it(picture, now_us)):
            self._kept, self._kept_us, self._stood = picture, now_us, stands
            self._store.submit(SaveValue(PICTURE_KEY, write(picture)))

    def _is_worth_it(self, picture: ShorePicture, now_us: int) -> bool:
        kept = self._kept
        if kept is None or replace(picture, state=kept.state, state_utc_us=kept.state_utc_us) != kept:
            return True
        return picture.state is not None and now_us - self._kept_us >= _STATE_US

    def _stands(self) -> tuple[object, ...] | None:
        """What a station acts on."""
        state = self._twin.state
        return None if state is None else (state.mode, state.armed, state.prearm_ok)
