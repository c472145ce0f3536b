"""Supervision of the parts that the vessel can do without: ground stations and the recorder must not stop the control tick.

A part that raises is left alone for a second and then tried again; five failures in a minute mean that it keeps failing,
and the failsafe acts (firmware-reliability §C, row 4).
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Iterable
from typing import Final, Protocol, TypeVar, TypeVarTuple

from mavlink_bridge.language.messages import Severity

log = logging.getLogger(__name__)


class Named(Protocol):
    """A part with a name."""

    name: str


Arguments = TypeVarTuple("Arguments")
Part = TypeVar("Part", bound=Named)
Result = TypeVar("Result")

_REST_US: Final = 1_000_000
_WINDOW_US: Final = 60_000_000
_FAILURES: Final = 5


class Supervisor:
    """Calls parts by name and keeps their faults from spreading."""

    def __init__(self, say: Callable[[Severity, str], None]) -> None:
        self._say = say
        self._rest_until_us: dict[str, int] = {}
        self._failures: dict[str, deque[int]] = {}

    def call(
        self,
        name: str,
        now_us: int,
        part: Callable[[*Arguments], Result],
        *arguments: *Arguments,
    ) -> Result | None:
        """Return what the part returns; None while it rests, and when it raises."""
        if self._rest_until_us and now_us < self._rest_until_us.get(name, 0):
            return None
        try:
            return part(*arguments)
        except Exception as error:
            self._failed(name, now_us, error)
        return None

    def each(
        self,
        parts: Iterable[Part],
        now_us: int,
        act: Callable[[Part, *Arguments], object],
        *arguments: *Arguments,
    ) -> None:
        """Have every part that does not rest act; the fault of one is not the others'."""
        for part in parts:
            if self._rest_until_us and now_us < self._rest_until_us.get(part.name, 0):
                continue
            try:
                act(part, *arguments)
            except Exception as error:
                self._failed(part.name, now_us, error)

    def _failed(self, name: str, now_us: int, error: Exception) -> None:
        log.error("%s failed", name, exc_info=error)
        self._rest_until_us[name] = now_us + _REST_US
        self._failures.setdefault(name, deque(maxlen=_FAILURES)).append(now_us)
        self._say(Severity.ERROR, f"{name} failed ({type(error).__name__}), tried again in a second")

    def failing(self, now_us: int) -> bool:
        """True while a part has failed five times within the last minute."""
        if not self._failures:
            return False
        return any(len(times) == _FAILURES and now_us - times[0] <= _WINDOW_US for times in self._failures.values())
