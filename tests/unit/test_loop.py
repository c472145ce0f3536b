"""The loop's grid, its overruns, its end; in virtual time."""

from __future__ import annotations

import itertools
import os
import signal
import socket

import pytest

from companion.io.clock import ManualClock
from companion.io.loop import LoopStats, StopFlag, run
from companion.io.notify import Notifier
from tests.soaked import in_the_soak


class App:
    def __init__(self, clock, costs=(), links=()):
        self.clock, self.costs, self.links = clock, dict(costs), links
        self.ticks, self.stopped = [], []
        self.actuator_fresh = True

    def pump(self, now_us):
        raise AssertionError("nothing to pump")

    def tick(self, now_us, *, late_s=0.0, load=0.0):
        self.ticks.append(now_us)
        self.clock.advance(self.costs.get(len(self.ticks), 0))
        return self

    def shutdown(self, now_us):
        self.stopped.append(now_us)


def test_ticks_sit_on_the_grid():
    clock = ManualClock()
    app = App(clock)
    assert run(app, clock, StopFlag(), period_us=50_000, until_us=1_000_000) == 0
    assert app.ticks == list(range(0, 1_000_000, 50_000))
    assert len(app.stopped) == 1


@pytest.mark.parametrize(
    "phase_us", [*range(0, 100_000, 21_000), *in_the_soak(*(us for us in range(0, 100_000, 7_000) if us % 21_000))]
)
def test_ticks_follow_the_sensor(phase_us):
    """A sensor at 10 Hz, its clock a little wrong: what it says waits 8 ms for the tick, and only the first period is more than 1 % off."""
    clock = ManualClock()
    app = App(clock)
    original = app.tick
    spoken_us = range(phase_us, 30_000_000, 100_020)

    def tick(now_us, **of_the_loop):
        app.sensed_us = max((at for at in spoken_us if at <= now_us), default=None)
        return original(now_us)

    app.tick = tick
    run(app, clock, StopFlag(), period_us=50_000, until_us=30_000_000)
    periods = [after - before for before, after in itertools.pairwise(app.ticks)]
    assert sum(abs(period - 50_000) > 500 for period in periods) <= 1  # the first burst places the grid
    assert all(25_000 <= period <= 75_000 for period in periods)
    waits = [min(at - said for at in app.ticks if at >= said) for said in spoken_us if 1_000_000 < said < 29_000_000]
    assert max(waits) <= 8_500


def test_a_short_tick_shifts_nothing():
    clock = ManualClock()
    app = App(clock, dict.fromkeys(range(1, 100), 20000))
    stats = LoopStats()
    run(app, clock, StopFlag(), period_us=50_000, until_us=1_000_000, stats=stats)
    assert app.ticks == list(range(0, 1_000_000, 50_000))
    assert stats.load == 0.4
    assert (stats.overruns, stats.skipped) == (0, 0)


def test_a_long_tick_is_counted_and_missed_ticks_are_skipped_not_repeated():
    clock = ManualClock()
    app = App(clock, {3: 180_000})
    stats = LoopStats()
    run(app, clock, StopFlag(), period_us=50_000, until_us=500_000, stats=stats)
    assert app.ticks == [0, 50_000, 100_000, 280_000, 300_000, 350_000, 400_000, 450_000]
    assert (stats.overruns, stats.skipped) == (1, 2)
    assert max(stats.late_us) == 30_000


def test_an_exception_in_the_app_writes_neutral_and_is_a_failure():
    clock = ManualClock()
    app = App(clock)
    app.tick = lambda now_us, **of_the_loop: 1 / 0
    assert run(app, clock, StopFlag(), period_us=50_000) == 1
    assert len(app.stopped) == 1


def test_a_stop_flag_ends_it_with_success():
    clock = ManualClock()
    app = App(clock)
    stop = StopFlag()
    original = app.tick

    def tick(now_us, **of_the_loop):
        if now_us == 200_000:
            stop.stop()
        return original(now_us)

    app.tick = tick
    assert run(app, clock, stop, period_us=50_000) == 0
    assert app.ticks[-1] == 200_000
    assert len(app.stopped) == 1


def test_row_02_the_watchdog_is_fed_only_while_the_actuators_are(tmp_path):
    """Fault row 2: a loop that turns without steering is restarted."""
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(path)
        listener.setblocking(False)
        clock = ManualClock()
        app = App(clock)
        original = app.tick

        def tick(now_us, **of_the_loop):
            app.actuator_fresh = now_us < 2_000_000
            return original(now_us)

        app.tick = tick
        notifier = Notifier({"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "2000000"})
        run(app, clock, StopFlag(), period_us=50_000, until_us=5_000_000, notifier=notifier)
        heard = []
        while True:
            try:
                heard.append(listener.recv(100))
            except BlockingIOError:
                break
    assert heard[0] == b"READY=1"
    assert heard[-1] == b"STOPPING=1"
    assert heard.count(b"WATCHDOG=1") == 3


def test_an_app_that_wants_to_stop_is_shut_down():
    clock = ManualClock()
    app = App(clock)
    original = app.tick

    def tick(now_us, **of_the_loop):
        app.stop_wanted = now_us >= 100_000
        return original(now_us)

    app.tick = tick
    assert run(app, clock, StopFlag(), period_us=50_000, until_us=1_000_000) == 0
    assert app.ticks[-1] == 100_000
    assert len(app.stopped) == 1


@pytest.fixture
def handlers():
    """The process's own signal handlers, put back afterwards."""
    kept = {
        number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
    }
    yield
    for number, handler in kept.items():
        signal.signal(number, handler)


def _signalled(number, stop, at_us=200_000):
    """The app of a loop whose process gets a signal within a tick."""
    clock = ManualClock()
    app = App(clock)
    original = app.tick

    def tick(now_us, **of_the_loop):
        if now_us == at_us:
            os.kill(os.getpid(), number)
        return original(now_us)

    app.tick = tick
    assert run(app, clock, stop, period_us=50_000, until_us=1_000_000) == 0
    assert len(app.stopped) == 1
    return app


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
def test_each_signal_that_ends_a_program_ends_it_with_neutral(handlers, number):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    assert _signalled(number, StopFlag().install()).ticks[-1] == 200_000


def test_a_terminal_that_closes_ends_no_vessel_that_must_go_on(handlers):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    stop = StopFlag().install()
    stop.stays = lambda: True
    assert _signalled(signal.SIGHUP, stop).ticks[-1] == 950_000
    stop.stays = lambda: False
    assert _signalled(signal.SIGHUP, stop).ticks[-1] == 200_000


def test_a_hangup_that_is_ignored_from_the_start_stays_ignored(handlers):
    """As under nohup."""
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    assert _signalled(signal.SIGHUP, StopFlag().install()).ticks[-1] == 950_000
