"""What the actuator board's reports mean for the vessel: flags for the failsafe, and the battery as the board measures it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from mavlink_bridge.language.messages import ActuatorStatus, SupplyVoltage
from mavlink_bridge.language.value import value

_SILENT: Final = frozenset({"lost", "blocked", "silent", "mute", "baud", "failsafe", "foreign", "protocol"})
"""Faults of the board after which nothing that is sent can be relied on."""


@value
class BoardFlags:
    """Of the actuator board and its line; names as in the failsafe table."""

    emergency_stop: bool = False
    """Level: the board's stop input."""
    actuator_lost: bool = False
    """Silent, closed, blocked, or not negotiated after it had been."""
    actuator_reset: bool = False
    actuator_mismatch: bool = False
    """Applied differs from commanded (300 ms, judged by the codec)."""
    actuator_noise: bool = False
    """More than 5 % bad lines in 2 s."""
    actuator_garbage: bool = False
    """More than 50 % bad lines in 1 s."""


CALM: Final = BoardFlags()


@value
class BoardReport:
    """What is known of the board in one tick."""

    flags: BoardFlags = CALM
    supply: SupplyVoltage | None = None
    """The battery as the board sees it; None when it does not measure."""


class BoardWatch:
    """One board's. A board that never was there cannot be lost."""

    def __init__(self) -> None:
        self._was_ready = False
        self._supply: SupplyVoltage | None = None

    def step(self, status: ActuatorStatus, faults: Sequence[str], *, ready: bool, armed: bool) -> BoardReport:
        """``faults``: names of what the codec finds wrong now. Armed, the board must be there, known before or not."""
        self._was_ready = self._was_ready or ready
        known = self._supply
        if status.voltage_v is None:
            self._supply = None
        elif known is None or known.t_us != status.t_us or known.voltage_v != status.voltage_v:
            self._supply = SupplyVoltage(status.t_us, status.voltage_v)
        flags = CALM
        if faults or status.emergency_stop:
            flags = self._flags(status, faults, expected=self._was_ready or armed)
        return BoardReport(flags, self._supply)

    @staticmethod
    def _flags(status: ActuatorStatus, faults: Sequence[str], *, expected: bool) -> BoardFlags:
        return BoardFlags(
            emergency_stop=status.emergency_stop,
            actuator_lost=expected and not _SILENT.isdisjoint(faults),
            actuator_reset="reset" in faults,
            actuator_mismatch="mismatch" in faults,
            actuator_noise="noise" in faults,
            actuator_garbage="garbage" in faults,
        )
