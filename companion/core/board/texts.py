"""What the operator reads about the actuator board: one sentence for each fault, and what a setting costs."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import Severity

from .actuator_map import ActuatorConfig
from .wire import Version

LEVEL0_TEXT: Final = "Actuator board (level 0) does not stop if this computer dies"

REASONS: Final = {
    "lost": "actuator port is not open",
    "blocked": "actuator port takes no data",
    "baud": "actuator board sends garbage: wrong baud rate?",
    "silent": "actuator board is silent",
    "foreign": "actuator board sends lines that this program does not know: other firmware?",
    "reset": "actuator board restarted",
    "failsafe": "actuator board stopped by itself: it did not hear us",
    "estop": "emergency stop pressed",
    "mismatch": "actuators apply something else than commanded",
    "garbage": "actuator line unreadable",
    "noise": "errors on the actuator line",
    "mute": "actuator board does not answer: look at baud rate, cable (crossed, broken, power) and firmware",
    "protocol": "actuator board speaks protocol {theirs}, this program {ours}: put this program's firmware on it",
    "level0": "nobody has seen this board's outputs move: stop, run 'companion bench-actuators FILE --check', start again",
}
"""Fault names, with the sentence for the operator."""


def started_text(level: int | None, version: Version | None) -> tuple[Severity, str]:
    """Return what to say when the board is ready."""
    if level == 0:
        return Severity.WARNING, LEVEL0_TEXT
    name = f" {version.board} {version.version}" if version else ""
    return Severity.INFO, f"Actuator board{name} ready, checked protocol"


def rate_text(config: ActuatorConfig) -> tuple[Severity, str]:
    """Return what a message frequency means for the vessel."""
    period_ms = 1000.0 / config.frequency_hz
    if config.too_slow:
        return Severity.WARNING, f"ACT_FREQ {config.frequency_hz:g} Hz: board stops between commands, no arming"
    if config.level == "0" and config.frequency_hz < 2.0:
        late = f"steering acts up to {period_ms:.0f} ms late"
        return (
            Severity.WARNING,
            f"ACT_FREQ {config.frequency_hz:g} Hz: {late}; a board that watches for silence stops between",
        )
    if config.frequency_hz < 10.0:
        return Severity.WARNING, f"ACT_FREQ {config.frequency_hz:g} Hz: steering acts up to {period_ms:.0f} ms late"
    return Severity.INFO, f"ACT_FREQ {config.frequency_hz:g} Hz: commands every {period_ms:.0f} ms"
