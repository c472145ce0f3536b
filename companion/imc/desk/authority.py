"""Which console commands: one at a time. Its presence is what the vehicle counts as a ground station.

The first that orders motion commands, until it is silent; another takes over when its operator insists, as on the vessel itself. What stops
is obeyed from everybody, and is none of this room's business.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

INSIST_AFTER_US: Final = 4_000_000
INSIST_US: Final = 30_000_000
"""An order that is pressed again within this, but not at once, is meant (as ``core/vehicle/operators``)."""


@dataclass(frozen=True, slots=True)
class Console:
    """Who it is: an IMC id at a host. Two programs of one id on two hosts are two consoles."""

    imc_id: int
    host: str
    name: str = ""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Console) and (self.imc_id, self.host) == (other.imc_id, other.host)

    def __hash__(self) -> int:
        return hash((self.imc_id, self.host))

    def __str__(self) -> str:
        return f"IMC, {self.host}, {self.name} (0x{self.imc_id:04X})"


class Authority:
    """``ids``: IMC ids that may command; empty = any console."""

    def __init__(self, timeout_s: float, ids: Iterable[int] = (), commander: Console | None = None) -> None:
        self._timeout_us = round(timeout_s * 1e6)
        self._ids = frozenset(ids)
        self.commander = commander
        self._heard_us: int | None = None
        self._wish: tuple[Console, type, int] | None = None

    def heard(self, console: Console, now_us: int) -> bool:
        """A console gave a sign of life; returns whether it is the one that commands."""
        if self.commander != console:
            return False
        self._heard_us = now_us
        return True

    def is_silent(self, now_us: int) -> bool:
        return self.commander is None or self._heard_us is None or now_us - self._heard_us >= self._timeout_us

    def refusal(self, console: Console, order: type, now_us: int) -> str:
        """Why this console may not order now, or "". ``order``: its kind; who orders something else does not order again."""
        if self._ids and console.imc_id not in self._ids:
            return f"{console} is no operator here (commander_ids): it may stop and abort"
        if self.commander in (None, console) or self.is_silent(now_us):
            return ""
        wish = self._wish
        if wish is not None and wish[:2] == (console, order) and now_us - wish[2] <= INSIST_US:
            if now_us - wish[2] >= INSIST_AFTER_US:
                return ""
        else:
            self._wish = console, order, now_us
        return f"{self.commander} commands: order again in {INSIST_AFTER_US // 1_000_000} s to take command"

    def take(self, console: Console, now_us: int) -> Console | None:
        """A console commands from now on; returns who did before, when that was another."""
        before, self.commander = self.commander, console
        self._heard_us, self._wish = now_us, None
        return before if before not in (None, console) else None
