"""What is wrong with the actuator board and its line: counters and windows behind ``Arduino.faults``.

Three watchers with no opinion on what to do: share of bad lines in both directions, applied against commanded pulses, and a port
that takes no bytes. Limits are those of the fault matrix (firmware-reliability §C rows 10, 13, 14).
"""

from __future__ import annotations

from collections import deque
from typing import Final

from mavlink_bridge.language.messages import ActuatorStatus

from .wire import STATE_NAMES, Microseconds, Status

MATCH_WINDOW_US: Final = 300_000
"""What was commanded shows in a status line within this: a command's period, the board's, and a lost line."""
BLOCKED_AFTER_US: Final = 250_000
"""Five ticks at 20 Hz whose bytes the port did not take."""
NOISE_WINDOW_US: Final = 2_000_000
"""Forty lines at 20 Hz: one bad line is 2.5 %, and no verdict."""
GARBAGE_WINDOW_US: Final = 1_000_000
"""A board that speaks another baud rate is told within this."""
SAMPLE_US: Final = 200_000
"""How finely the windows above slide."""
NOISE_SHARE: Final = 0.05
"""Each bad line is a command late by a period; beyond one in twenty the line wants mending."""
GARBAGE_SHARE: Final = 0.5
"""Beyond a half it is no noise but another baud rate, or another program."""
EMERGENCY: Final = STATE_NAMES["E"]
_LEAST_BAD: Final = 3
"""Fewer bad lines than this in a window are no verdict."""


class LineQuality:
    """Share of bad lines, both directions together, over sliding windows."""

    def __init__(self) -> None:
        self.good = 0
        self.bad = 0
        self._bad_us = -NOISE_WINDOW_US
        self._bad_seen = 0
        self._board: tuple[int, int] | None = None
        self._samples: deque[tuple[int, int, int]] = deque(maxlen=256)

    def heard(self, good: int, bad: int) -> None:
        """Add lines read from the board."""
        self.good += good
        self.bad += bad

    def reported(self, good: int, bad: int) -> None:
        """Take the board's own totals; after its reset they start again."""
        old = self._board
        if old is not None and good >= old[0] and bad >= old[1]:
            self.heard(good - old[0], bad - old[1])
        self._board = (good, bad)

    def forget_board(self) -> None:
        """The board restarted: its next totals are a new beginning."""
        self._board = None

    def sample(self, now_us: int) -> None:
        """Remember the totals, now and then, and whenever a bad line came."""
        if self.bad != self._bad_seen:
            self._bad_seen, self._bad_us = self.bad, now_us
        elif self._samples and now_us - self._samples[-1][0] < SAMPLE_US:
            return
        self._samples.append((now_us, self.good, self.bad))
        while len(self._samples) > 2 and self._samples[1][0] <= now_us - NOISE_WINDOW_US:
            self._samples.popleft()

    def noisy(self, now_us: int) -> bool:
        return self._share(now_us - NOISE_WINDOW_US) > NOISE_SHARE

    def garbage(self, now_us: int) -> bool:
        return self._share(now_us - GARBAGE_WINDOW_US) > GARBAGE_SHARE

    def recent(self, now_us: int) -> bool:
        """Any bad line within the longer window? Mostly none, and then there is nothing to count."""
        return self.bad != self._bad_seen or now_us - self._bad_us <= NOISE_WINDOW_US

    def _share(self, since_us: int) -> float:
        start = next((sample for sample in reversed(self._samples) if sample[0] <= since_us), None)
        if start is None:
            start = self._samples[0] if self._samples else (0, self.good, self.bad)
        good, bad = self.good - start[1], self.bad - start[2]
        return bad / (good + bad) if bad >= _LEAST_BAD else 0.0


class Agreement:
    """Do the pulses at the pins follow the commands? The applied ones must equal a command of the last 300 ms."""

    def __init__(self) -> None:
        self._sent: deque[tuple[int, Microseconds]] = deque(maxlen=256)
        self._agreed_us: int | None = None
        self._judged_us: int | None = None

    def commanded(self, pulses_us: Microseconds, now_us: int) -> None:
        if self._sent and self._sent[-1][1] == pulses_us:
            return
        self._sent.append((now_us, pulses_us))
        while len(self._sent) > 2 and self._sent[1][0] <= now_us - MATCH_WINDOW_US:
            self._sent.popleft()
        if self._agreed_us is None:
            self._agreed_us = now_us

    def applied(self, pulses_us: Microseconds, now_us: int) -> None:
        """Judge one status line."""
        self._judged_us = now_us
        since_us = now_us - MATCH_WINDOW_US
        for t_us, commanded_us in reversed(self._sent):
            if commanded_us == pulses_us:
                self._agreed_us = now_us
                return
            if t_us <= since_us:
                return  # this one was in force when the window began

    def disagrees(self, now_us: int) -> bool:
        """A board that is silent says nothing else: a line must have told so."""
        if self._agreed_us is None or self._judged_us is None or self._judged_us <= self._agreed_us:
            return False
        return now_us - self._agreed_us >= MATCH_WINDOW_US


class PortFlow:
    """A port that takes nothing, or only part: stale frames are dropped and counted, never queued."""

    def __init__(self) -> None:
        self.dropped = 0
        self.held_since_us: int | None = None
        """Since when the port has taken less than it was given; None while it takes all."""

    def note(self, accepted: int, offered: int, now_us: int) -> None:
        if accepted >= offered:
            self.held_since_us = None
            return
        self.dropped += 1
        if self.held_since_us is None:
            self.held_since_us = now_us

    def blocked(self, now_us: int) -> bool:
        return self.held_since_us is not None and now_us - self.held_since_us >= BLOCKED_AFTER_US


def reported(line: Status, t_us: int, level: int | None, *, connected: bool) -> ActuatorStatus:
    """The board's own account, of its last status line."""
    return ActuatorStatus(
        t_us=t_us,
        connected=connected,
        level=level,
        state=line.state,
        applied_us=line.applied_us,
        good_frames=line.good,
        bad_frames=line.bad,
        reset_cause=line.reset_cause,
        emergency_stop=line.state == EMERGENCY,
        voltage_v=line.voltage_v,
    )
