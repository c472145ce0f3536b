"""Faults of our own: neutral in the same tick, disarmed, and after three in a row the end."""

from __future__ import annotations

import pytest

from companion.app import AppFaultError
from sitl.world.world import World
from tests.by_hand import driven


@pytest.fixture
def under_way() -> World:
    world = driven()
    assert world.surroundings.plant.board.pulses_us[0] > 1800
    return world


def test_row_05_an_exception_in_the_tick_writes_neutral_in_that_tick(
    under_way: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*arguments: object) -> None:
        raise ZeroDivisionError

    with monkeypatch.context() as patch:
        patch.setattr(under_way.app.vehicle.parts.guidance, "step", broken)
        patch.setattr(under_way.app.vehicle.parts.estimator, "predict", broken)
        assert under_way.tick() is None
    under_way.step()
    assert all(abs(pulse - 1500) < 1 for pulse in under_way.surroundings.plant.board.pulses_us)
    under_way.run(1.0)
    assert under_way.snapshot is not None
    assert not under_way.snapshot.armed


def test_three_in_a_row_end_the_process(under_way: World, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*arguments: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(under_way.app.vehicle.parts.estimator, "predict", broken)
    under_way.tick()
    under_way.tick()
    with pytest.raises(AppFaultError):
        under_way.tick()


def test_shutdown_is_neutral_and_may_come_twice(under_way: World) -> None:
    under_way.shutdown(under_way.now_us)
    assert all(abs(pulse - 1500) < 1 for pulse in under_way.surroundings.plant.board.pulses_us)
    under_way.app.shutdown(under_way.now_us)


def test_a_fault_between_two_ticks_is_one_of_ours_like_any_other(
    under_way: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ended the process at once, where the same fault in a tick may happen twice."""

    def broken(now_us: int) -> None:
        raise ZeroDivisionError

    with monkeypatch.context() as patch:
        patch.setattr(under_way.app.sensors[0], "read", broken)
        under_way.app.pump(under_way.now_us)
    under_way.run(1.0)
    assert all(abs(pulse - 1500) < 1 for pulse in under_way.surroundings.plant.board.pulses_us)
    assert under_way.snapshot is not None
    assert not under_way.snapshot.armed
