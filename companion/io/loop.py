"""The loop: ticks at a fixed rate, bytes served in between, one way out.

Ticks sit on a fixed grid, so lateness does not add up; a tick that comes more than one period late skips the missed
ones instead of running them in a burst. The grid slides slowly, by a hundredth, until ticks come just after the heading
sensor has spoken: what it said then reaches the actuators in milliseconds instead of up to a period later. Whatever ends
the loop (a signal, an exception, the end of a simulation), the app's ``shutdown`` writes neutral last.
"""

from __future__ import annotations

import gc
import logging
import signal
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import FrameType
from typing import Final, Protocol

from .clock import Clock, ManualClock
from .interpreter import compile_early, settle, unsettle
from .notify import Notifier

PUMP_PAUSE_US: Final = 500
"""At least so long between two pumps: a flood of small reads must not take the whole processor."""
SETTLE_US: Final = 8_000
"""Where the grid wants its ticks: this long after the last byte of the sensor's burst, which a slow computer needs to decode it."""
SLEW_US: Final = 500
"""The most that one period is longer or shorter for it; only the first burst moves the grid at once."""
TIDY_TICKS: Final = 20
TIDY_NEEDS_US: Final = 10_000
"""The garbage collector works right after every 20th tick when so much time is left, and never in between."""
_TIDY_ANYWAY: Final = 1_000
"""Every so many ticks all of it is looked through, come what may."""
_LATE_KEPT: Final = 2_000
_HANGUP: Final = "SIGHUP"
"""Ignored from the start (nohup) it stays ignored: that is what nohup was asked for."""
_ENDING: Final = ("SIGINT", "SIGTERM", _HANGUP, "SIGQUIT")
"""All that a person or a service manager ends a program by; what kills it at once would leave the last thrust standing."""

log = logging.getLogger(__name__)


class Waited(Protocol):
    """Something whose bytes wake the loop: a link, or a socket that is none."""

    def filenos(self) -> list[int]:
        """Descriptors to select on for reading."""
        ...


class LoopApp(Protocol):
    """What the loop drives."""

    @property
    def links(self) -> Sequence[Waited]: ...

    def pump(self, now_us: int) -> None:
        """Serve protocol endpoints."""
        ...

    def tick(self, now_us: int, *, late_s: float = 0.0, load: float = 0.0) -> object:
        """Run one control tick; None says that it failed."""
        ...

    def shutdown(self, now_us: int) -> None:
        """Write neutral and close everything."""
        ...


@dataclass(slots=True)
class LoopStats:
    """How well the loop keeps its time; share it with the app, which shows it."""

    ticks: int = 0
    pumps: int = 0
    overruns: int = 0
    """Ticks that took longer than a period."""
    skipped: int = 0
    """Ticks of the grid that never ran, because one before was late."""
    load: float = 0.0
    """Share of the period that the last tick took."""
    late_us: deque[int] = field(default_factory=lambda: deque(maxlen=_LATE_KEPT))
    """How long after its time each of the last ticks began."""


class StopFlag:
    """Raised by a signal that asks for an end, or by hand; a second SIGINT interrupts at once.

    SIGHUP says that the terminal is gone: somebody closed the window, or the line to him broke. It ends the loop too, unless
    ``stays`` is set and says otherwise then.
    """

    def __init__(self) -> None:
        self.raised = False
        self.reason = ""
        self.stays: Callable[[], bool] | None = None
        """Asked between two ticks, never in the handler, whether to go on without the terminal."""
        self._hung_up = False

    def stop(self, reason: str = "asked to stop") -> None:
        self.raised, self.reason = True, self.reason or reason

    def install(self) -> StopFlag:
        """Listen to the signals (main thread only)."""
        for name in _ENDING:
            number = getattr(signal, name, None)  # Windows has no SIGHUP and no SIGQUIT
            if number is not None and (name != _HANGUP or signal.getsignal(number) is not signal.SIG_IGN):
                signal.signal(number, self._on_signal)
        return self

    def settle(self) -> bool:
        """Decide about a terminal that has gone since the last call; return whether the loop ends."""
        if self._hung_up:
            self._hung_up = False
            if self.stays is None or not self.stays():
                self.stop(_HANGUP)
        return self.raised

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        name = signal.Signals(number).name
        if self.raised and number == signal.SIGINT:
            raise KeyboardInterrupt
        if name == _HANGUP:
            self._hung_up = True
        else:
            self.stop(name)


def run(
    app: LoopApp,
    clock: Clock,
    stop: StopFlag,
    *,
    period_us: int,
    stats: LoopStats | None = None,
    notifier: Notifier | None = None,
    until_us: int | None = None,
) -> int:
    """Drive ``app`` until ``stop`` is raised or ``until_us`` is reached; return the exit status.

    An app whose ``stop_wanted`` turns true is shut down. One that has an ``actuator_fresh`` attribute feeds systemd's
    watchdog only while that is true: a loop that turns and does not steer is as good as dead. One with a ``sensed_us`` (when
    its heading sensor last spoke, or None) has its ticks moved to just after that. An exception in the app is
    logged, neutral is written, and the status is 1.
    """
    stats = stats or LoopStats()
    notifier = notifier or Notifier()
    status = 0
    settle()
    if type(clock) is ManualClock:
        compile_early()
    else:
        gc.disable()
    try:
        _turn(app, clock, stop, period_us=period_us, stats=stats, notifier=notifier, until_us=until_us)
    except Exception:
        log.exception("the loop ended by an error; neutral is written")
        status = 1
    finally:
        notifier.send("STOPPING=1")
        try:
            app.shutdown(clock.now_us())
        except Exception:
            log.exception("the shutdown was not clean")
            status = 1
        gc.enable()
        unsettle()
    return status


def _turn(
    app: LoopApp,
    clock: Clock,
    stop: StopFlag,
    period_us: int,
    stats: LoopStats,
    notifier: Notifier,
    until_us: int | None,
) -> None:
    due_us = clock.now_us()
    fed_us = due_us
    placed = False
    notifier.send("READY=1")
    while not stop.raised and (until_us is None or due_us < until_us):
        if getattr(app, "stop_wanted", False):
            stop.stop("a ground station asked for it")
            return
        if stop.settle():
            return
        _wait(app, clock, stop, stats, due_us)
        now_us = clock.now_us()
        late_us = max(0, now_us - due_us)
        stats.late_us.append(late_us)
        worked = app.tick(now_us, late_s=late_us * 1e-6, load=stats.load) is not None
        ended_us = clock.now_us()
        stats.ticks += 1
        stats.load = (ended_us - now_us) / period_us
        stats.overruns += ended_us - now_us > period_us
        slide_us = _slide_us(app, due_us, period_us)
        due_us += period_us + (max(-SLEW_US, min(SLEW_US, slide_us)) if placed else slide_us)
        placed = placed or slide_us != 0
        missed = max(0, (ended_us - due_us) // period_us)
        stats.skipped += missed
        due_us += missed * period_us
        if notifier.watchdog_us and now_us - fed_us >= notifier.watchdog_us // 4 and worked and _steering(app):
            notifier.send("WATCHDOG=1")
            fed_us = now_us


def _slide_us(app: LoopApp, due_us: int, period_us: int) -> int:
    """How much later the grid ought to be, us, for ticks to follow the sensor's bursts (``sensed_us`` of the app)."""
    sensed_us: int | None = getattr(app, "sensed_us", None)
    if sensed_us is None or sensed_us <= due_us - period_us:
        return 0
    return (sensed_us + SETTLE_US - due_us + period_us // 2) % period_us - period_us // 2


def _steering(app: LoopApp) -> bool:
    return bool(getattr(app, "actuator_fresh", True))


def _wait(app: LoopApp, clock: Clock, stop: StopFlag, stats: LoopStats, due_us: int) -> None:
    """Serve what arrives until the tick is due."""
    if type(clock) is ManualClock:  # in virtual time nothing arrives while one waits
        clock.sleep_until_us(due_us)
        return
    if stats.ticks % TIDY_TICKS == 0 and (due_us - clock.now_us() > TIDY_NEEDS_US or stats.ticks % _TIDY_ANYWAY == 0):
        gc.collect(1 if stats.ticks % _TIDY_ANYWAY else 2)
    while not stop.raised:
        filenos = [fileno for link in app.links for fileno in link.filenos()]
        if not clock.sleep_until_us(due_us, filenos):
            return
        now_us = clock.now_us()
        if due_us - now_us < PUMP_PAUSE_US:
            # Too near to the tick to begin something else; the tick reads these bytes itself.
            clock.sleep_until_us(due_us)
            return
        app.pump(now_us)
        stats.pumps += 1
        clock.sleep_until_us(min(due_us, clock.now_us() + PUMP_PAUSE_US))
