"""Progress of long work on a terminal: how far, how fast, how long yet. In a pipe it says nothing."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Final, TextIO

from mavlink_bridge.language.snapshot import Snapshot

from ..io.log_file import parts_of

SHOW_EVERY_S: Final = 0.5
_FIRST_S: Final = 1.0
"""Work that is done by then shows nothing."""


class ProgressLine:
    """One line that is written over. ``total_s``: seconds of voyage that there are to go through; None = not known."""

    def __init__(
        self,
        what: str,
        total_s: float | None,
        *,
        out: TextIO | None = None,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._what, self._total_s, self._clock_s = what, total_s, clock_s
        self._out = out or sys.stderr
        self._shows = self._out.isatty()
        self._began_s = clock_s()
        self._due_s = self._began_s + _FIRST_S
        self._width = 0

    def __enter__(self) -> ProgressLine:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def update(self, snapshot: Snapshot) -> None:
        """The vessel's time tells how far it is; also what ``status.Watched`` calls after each tick."""
        if self._shows:
            self.at(snapshot.t_us * 1e-6)

    def at(self, done_s: float) -> None:
        """So many seconds are done."""
        now_s = self._clock_s()
        if not self._shows or now_s < self._due_s:
            return
        self._due_s = now_s + SHOW_EVERY_S
        rate = done_s / (now_s - self._began_s)
        if self._total_s is None or rate <= 0.0:
            self.say(f"{self._what} {_span(done_s)}, {rate:.0f} times real time")
            return
        left_s = max(self._total_s - done_s, 0.0) / rate
        share = min(done_s / self._total_s, 1.0) if self._total_s > 0.0 else 1.0
        self.say(
            f"{self._what} {share:4.0%}  {_span(done_s)} of {_span(self._total_s)}, {rate:.0f} times real time, {_span(left_s)} left"
        )

    def count(self, done: float, total: float, unit: str) -> None:
        """So many of so many are done: ``12.1 of 40.0 MB, 3.10 MB/s, 9 s left``."""
        now_s = self._clock_s()
        if not self._shows or now_s < self._due_s:
            return
        self._due_s = now_s + SHOW_EVERY_S
        rate = done / (now_s - self._began_s)
        left = f"{max(total - done, 0.0) / rate:.0f} s left" if rate > 0.0 else "..."
        self.say(f"{self._what} {done:.1f} of {total:.1f} {unit}, {rate:.2f} {unit}/s, {left}")

    def say(self, text: str) -> None:
        """Show a text in the place of the one before."""
        if self._shows:
            print(f"\r{text:{self._width}}", end="", file=self._out, flush=True)
            self._width = len(text)

    def close(self) -> None:
        """Take the line away."""
        if self._width:
            print(f"\r{'':{self._width}}\r", end="", file=self._out, flush=True)
            self._width = 0


def _span(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def recorded_s(run_dir: Path) -> float | None:
    """How long a recorded voyage is: the time in the last row of its control log; None when that cannot be read."""
    try:
        last = parts_of(run_dir / "control.csv")[-1]
        with last.open("rb") as file:
            file.seek(max(0, last.stat().st_size - 4096))
            rows = file.read().decode("utf-8", "replace").splitlines()
        return float(rows[-1].partition(",")[0])
    except (OSError, ValueError, IndexError):
        return None
