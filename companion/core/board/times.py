"""The times of the conversation with the actuator board, microseconds, and why each is so long."""

from __future__ import annotations

from typing import Final

BANNER_WAIT_US: Final = 2_500_000
"""Boot loaders of these boards listen for up to 2 s after the reset that opening the port causes."""
ANSWER_WAIT_US: Final = 1_000_000
"""Four questions without an answer: a board that checks its line answers the first within a tick."""
ASK_EVERY_US: Final = 250_000
"""Slow enough that an answer on a line of 9600 baud is back before the next question."""
NEUTRAL_FRAMES: Final = 5
"""A quarter of a second at 20 Hz: one of them arrives whatever was left on the line."""
SILENT_AFTER_US: Final = 300_000
"""Three status lines of a board that sends ten a second (firmware-reliability, C row 9)."""
STALE_OUTPUT_US: Final = 250_000
"""An output this old is of a loop that stands still; the board's own deadline is not kept asleep by it."""
RESET_SHOWN_US: Final = 1_000_000
"""Long enough for a failsafe of the slowest tick rate to see it."""
WARN_EVERY_US: Final = 30_000_000
"""A standing warning: often enough to be remembered, too seldom to hide an alarm."""
