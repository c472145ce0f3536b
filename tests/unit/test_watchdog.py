"""What systemd's watchdog is for: a loop that does not steer. A board that is not there is no such loop, and is waited for."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

import config
from companion.build import build_app
from companion.io.clock import ManualClock
from companion.io.links import Link
from companion.io.links.mem import MemLink, pair
from companion.io.loop import StopFlag, run
from companion.io.notify import Notifier
from companion.settings.schema import Settings, load
from sitl.world.world import World
from tests.by_hand import driven

LIMIT_US = 2_000_000
SAILED_US = 12_000_000


class Systemd(Notifier):
    """What the unit asks for, and when it was fed."""

    def __init__(self, clock: ManualClock) -> None:
        super().__init__({"WATCHDOG_USEC": str(LIMIT_US)})
        self.clock, self.heard_us = clock, [clock.now_us()]

    def send(self, message: str) -> None:
        if message == "WATCHDOG=1":
            self.heard_us.append(self.clock.now_us())

    def longest_us(self) -> int:
        """The longest time without a word."""
        return max(after - before for before, after in itertools.pairwise([*self.heard_us, self.clock.now_us()]))


def longest_us(url: str, board: Link | None = None) -> int:
    """How long a boat with such a board leaves systemd without a word."""
    settings = load(
        config.path("boat.toml"), [f'actuators.url="{url}"', "sensors=[]", 'store=""', "endpoints=[]"], Settings
    )
    app = build_app(settings, make_link=lambda name, url, **_: board or MemLink(name)) if board else build_app(settings)
    clock = ManualClock()
    systemd = Systemd(clock)
    assert run(app, clock, StopFlag(), period_us=app.period_us, until_us=SAILED_US, notifier=systemd) == 0
    return systemd.longest_us()


def test_a_board_that_is_not_there_restarts_nothing(tmp_path: Path) -> None:
    """It ended the program each 4 s, for ever: no telemetry, no page, and a run folder for each start."""
    assert longest_us(f"serial:{tmp_path}/no-board") < LIMIT_US


def test_a_boat_without_a_board_restarts_nothing() -> None:
    assert longest_us("") < LIMIT_US


def test_a_board_that_is_slow_to_wake_restarts_nothing() -> None:
    """One that says nothing when its port opens is waited for longer than systemd would wait."""
    near, _far = pair("board")
    assert longest_us("mem:board", near) < LIMIT_US


def test_a_port_that_takes_nothing_is_a_loop_that_does_not_steer() -> None:
    near, _blocked = pair("board", capacity=8)
    assert longest_us("mem:board", near) > LIMIT_US


def under_way(*words: str) -> World:
    world = driven(*words)
    assert world.snapshot is not None
    assert world.snapshot.armed
    return world


def cable(world: World) -> MemLink:
    assert world.app.actuators is not None
    link = world.app.actuators.link
    assert isinstance(link, MemLink)
    return link


def unfed_ticks(world: World, seconds: float) -> int:
    """The longest row of ticks after which systemd would not be fed."""
    longest = row = 0
    for _ in range(round(seconds * 20)):
        world.step()
        row = 0 if world.app.actuator_fresh else row + 1
        longest = max(longest, row)
    return longest


def test_a_plug_that_is_pulled_at_sea_leaves_the_program_running() -> None:
    """Who must find a drifting boat needs its telemetry more than ever."""
    world = under_way()
    cable(world).unplug()
    assert unfed_ticks(world, 10.0) <= 5
    assert world.snapshot is not None
    assert not world.snapshot.armed
    cable(world).plug()
    assert unfed_ticks(world, 10.0) <= 5


@pytest.mark.parametrize(("action", "fed"), [("disarm", True), ("stop", False)])
def test_a_vessel_that_stays_armed_without_its_board_is_begun_anew(action: str, fed: bool) -> None:
    world = under_way(f'failsafe.conditions.actuator_lost.action="{action}"')
    cable(world).unplug()
    assert (unfed_ticks(world, 5.0) < 40) is fed
