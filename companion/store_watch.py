"""What the vessel makes of its store's state: whether it may depart, what the operator is told and how often, and which stored
parameters stand over the configuration file's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Final

from mavlink_bridge.language.messages import Severity

from .facade import SettingsParams
from .io.keeping import Completion, StoreContent
from .io.keeping.mark import departure_refusal, fence_refusal
from .settings import Settings

AGAIN_US: Final = 60_000_000
"""A trouble that lasts is told once a minute: often enough not to be forgotten, seldom enough not to hide anything."""


class StoreWatch:
    """Follows the store's completions. ``required``: without a store that takes changes there is no departure."""

    def __init__(self, say: Callable[[Severity, str], None], content: StoreContent, *, required: bool) -> None:
        self._say = say
        self._required = required
        self._trouble = ""
        self._failed = False
        self._aside, self._fence = departure_refusal(content), fence_refusal(content)
        self._tell_us: int | None = None
        self.standing: tuple[tuple[Severity, str], ...] = ()
        """What each station that comes later is told too: how the store makes this boat differ from its configuration file."""

    @property
    def fault(self) -> bool:
        """Whether what is acknowledged now might not outlive this process, or is refused for that."""
        return bool(self._trouble) or self._failed

    @property
    def barred(self) -> tuple[str, ...]:
        """Why the vessel must not depart, each with its mend."""
        trouble = f"store: {self._trouble}; mend it, or arm by force" if self._trouble and self._required else ""
        return tuple(text for text in (self._aside, self._fence, trouble) if text)

    def fence_adopted(self) -> None:
        """A fence is in force, or none on purpose: whatever was lost before."""
        self._fence = ""

    def take_back(self, params: SettingsParams, stored: Mapping[str, float], warnings: tuple[str, ...]) -> Settings:
        """Put stored parameters in force and tell what differs from the file and what no longer fits; return the settings then."""
        told = overrides(params, stored)
        self.standing = (*((Severity.WARNING, text) for text in warnings), *((Severity.INFO, text) for text in told))
        for severity, text in self.standing:
            self._say(severity, text)
        for name, value in stored.items():
            try:
                params.settings = params.change(name, value)
            except ValueError as error:
                self._say(Severity.WARNING, f"stored parameter left out: {error}")
        return params.settings

    def news(self, done: Completion) -> None:
        """The disk is well (no text, or one to know), or has a trouble."""
        if not done.ok:
            self._trouble, self._tell_us = done.text, None
        elif done.text:
            self._say(Severity.WARNING, done.text)
        elif self._trouble:
            self._trouble = ""
            self._say(Severity.INFO, "Store: can be written again")

    def wrote(self, done: Completion) -> None:
        """A change of plan or parameter is done, or is not."""
        self._failed = not done.ok or bool(done.text)
        if done.ok and done.text:
            self._say(Severity.WARNING, f"Taken over, but {done.text}")

    def tick(self, now_us: int) -> None:
        """Tell what lasts."""
        if not self._trouble or (self._tell_us is not None and now_us < self._tell_us):
            return
        self._tell_us = now_us + AGAIN_US
        then = "changes are refused" if self._required else "changes are kept in memory"
        self._say(Severity.WARNING, f"Store: {self._trouble}; {then}, tried again every 30 s")


def overrides(params: SettingsParams, stored: Mapping[str, float]) -> list[str]:
    """Which stored parameters differ from the configuration's, one line each."""
    lines = []
    for name, value in sorted(stored.items()):
        info = params.get(name)
        if info is not None and not math.isclose(info.value, value, rel_tol=1e-6):  # the wire's REAL32 has 24 bits
            lines.append(f"{name} = {value:g} from the store (file: {info.value:g})")
    return lines
