"""What commands that talk to a vessel leave behind: armed or not, and what the person is told of it."""

from __future__ import annotations

import pytest

from companion.cli import main
from companion.commands.plan import link
from companion.commands.plan.plan_watch import PlanWatch
from companion.commands.trial.watch import TrialWatch
from mavlink_bridge.language.messages import Action, PlanState
from mavlink_bridge.language.trials import TrialOrder
from mavlink_bridge.mavlink.commands.table import TRIAL_NUMBERS
from mavlink_bridge.mavlink.wire.cmd import Cmd

action = pytest.importorskip("mavsdk.plugins.action")
REFUSED = 2


class FakeVessel(link.Vessel):
    """Arms and disarms as it is told; starts no plan and begins no trial unless it is willing."""

    def __init__(self, *, armed=False, error=None):
        self._said, self.heard, self.shows_again, self.counts_home = set(), [], False, True
        self._mission, self._system, self._refusals = self, None, None
        self.is_up, self.error = armed, error
        self.settings = {
            "GCS_REQUIRED": 1.0,
            "FS_GCS_TIMEOUT": 5.0,
            "FS_GCS_ACTION": Action.HOLD,
            "FS_GCS_THEN_T": 60.0,
            "FS_GCS_THEN": Action.RETURN,
        }

    @property
    def is_armed(self):
        return self.is_up

    @property
    def home_item(self):
        return self.counts_home

    def arm(self):
        self.is_up = True

    def start_mission(self):
        if self.error is not None:
            raise self.error

    def pause_mission(self):
        pass

    def watch(self):
        pass

    def setting(self, name):
        if name not in self.settings:
            raise link.LinkError(f"{name}: timeout")
        return float(self.settings[name])

    def _answer(self, number, params):
        if number == Cmd.COMPONENT_ARM_DISARM:
            self.is_up = bool(params[0])
        begins = number == Cmd.SEA_TRIAL and params[0] == TRIAL_NUMBERS[TrialOrder.BEGIN]
        if begins and isinstance(self.error, KeyboardInterrupt):
            raise self.error
        return REFUSED if begins and self.error is not None else 0


@pytest.fixture
def run(monkeypatch):
    monkeypatch.setattr(link, "_REASON_S", 0.0)

    def run(vessel, *words):
        monkeypatch.setattr(link, "find", lambda urls, wait_s: vessel)
        return main([*words, "--url", "udpin://:1"])

    return run


@pytest.mark.parametrize("words", [("plan", "start"), ("trial", "start")])
def test_what_was_armed_for_a_start_that_is_refused_is_disarmed_again(run, capsys, words):
    vessel = FakeVessel(error=RuntimeError("plan too far"))
    assert run(vessel, *words) == 1
    assert not vessel.is_up
    assert "disarmed again" in capsys.readouterr().err


def test_a_plan_that_was_uploaded_and_not_started_leaves_the_vessel_disarmed(run, tmp_path, monkeypatch):
    assert main(["plan", "make", str(tmp_path / "a.plan"), "41.1852,-8.7060"]) == 0
    vessel = FakeVessel(error=RuntimeError("plan too far"))
    monkeypatch.setattr(vessel, "upload", lambda plan: None)
    assert run(vessel, "plan", "upload", str(tmp_path / "a.plan"), "--start") == 1
    assert not vessel.is_up


@pytest.mark.parametrize("words", [("plan", "start"), ("trial", "start")])
def test_so_it_is_when_the_start_is_interrupted(run, words):
    vessel = FakeVessel(error=KeyboardInterrupt())
    run(vessel, *words)
    assert not vessel.is_up


@pytest.mark.parametrize("words", [("plan", "start"), ("plan", "start", "--no-arm"), ("trial", "start", "--no-arm")])
def test_what_somebody_else_has_armed_stays_so(run, capsys, words):
    vessel = FakeVessel(armed=True, error=RuntimeError("plan too far"))
    assert run(vessel, *words) == 1
    assert vessel.is_up
    assert "disarmed again" not in capsys.readouterr().err


def test_a_vessel_that_does_not_answer_the_order_to_disarm_is_told(run, capsys, monkeypatch):
    vessel = FakeVessel(error=RuntimeError("plan too far"))

    def lost(number, params):
        raise link.LinkError(f"command {number}: no answer")

    monkeypatch.setattr(vessel, "_answer", lost)
    assert run(vessel, "plan", "start") == 1
    assert "may still be armed" in capsys.readouterr().err


def test_an_armed_vessel_is_left_with_what_it_does_without_a_station(run, capsys):
    assert run(FakeVessel(), "plan", "start", "--watch") == 0
    told = capsys.readouterr().err
    assert "armed and holds; without a ground station it returns within 65 s" in told
    assert "companion plan disarm" in told
    assert run(FakeVessel(), "plan", "start") == 0
    assert (
        "armed and sails on; without a ground station it holds within 5 s and returns within 65 s"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize("done", [True, False])
def test_a_trial_that_is_over_leaves_an_armed_vessel_and_says_so(run, capsys, monkeypatch, done):
    monkeypatch.setattr(TrialWatch, "stay", lambda watch, keys: done)
    vessel = FakeVessel()
    assert run(vessel, "trial", "start") == (0 if done else 1)
    assert vessel.is_up, "at sea it must hold"
    assert "armed and holds; without a ground station it returns within 65 s" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"GCS_REQUIRED": 0.0}, "without a ground station it goes on so"),
        ({"FS_GCS_THEN": Action.NONE}, "without a ground station it goes on so"),
        ({"FS_GCS_ACTION": Action.WARN, "FS_GCS_THEN_T": 20.0}, "without a ground station it returns within 25 s"),
        ({"FS_GCS_ACTION": Action.STOP}, "without a ground station it stops within 5 s"),
    ],
)
def test_what_follows_is_as_the_vessel_has_it_set(run, capsys, settings, told):
    vessel = FakeVessel(armed=True)
    vessel.settings |= settings
    assert run(vessel, "plan", "pause") == 0
    assert told + ":" in capsys.readouterr().err


def test_settings_that_do_not_come_and_a_disarmed_vessel(run, capsys):
    vessel = FakeVessel(armed=True)
    vessel.settings.clear()
    assert run(vessel, "plan", "pause") == 0
    assert "without a ground station it may set off for home" in capsys.readouterr().err
    assert run(vessel, "plan", "disarm") == 0
    assert not vessel.is_up
    assert run(vessel, "plan", "pause") == 0
    assert "the vessel is armed" not in capsys.readouterr().err


@pytest.mark.parametrize(("counts_home", "said"), [(True, "leg to item 3 is 8 km"), (False, "leg to item 2 is 8 km")])
def test_items_in_a_vessels_texts_count_as_in_the_file_that_was_checked(capsys, counts_home, said):
    vessel = FakeVessel()
    vessel.counts_home = counts_home
    vessel._say(said)
    assert capsys.readouterr().err == "vessel: leg to item 2 is 8 km\n"


@pytest.mark.parametrize("home_item", [True, False])
def test_a_watched_plan_counts_its_items_without_home_and_ends_when_the_vessel_says_so(capsys, home_item):
    watch = PlanWatch(home_item=home_item)
    watch.take({"seq": 3 + home_item, "total": 4, "mission_state": PlanState.COMPLETE})
    assert not watch.is_over, "that was the plan before"
    for seq in (0, 1, 1, 2, 3, 4):  # the last: all are done, and the vessel has not yet said that the plan is
        watch.take({"seq": seq + home_item, "total": 4, "mission_state": PlanState.ACTIVE})
    assert not watch.is_over
    watch.take({"seq": 3 + home_item, "total": 4, "mission_state": PlanState.COMPLETE})
    assert watch.is_over
    shown = capsys.readouterr().out.splitlines()
    assert shown == ["item 0 (last: 3)", "item 1 (last: 3)", "item 2 (last: 3)", "item 3 (last: 3)"]


def test_a_vessel_that_does_not_say_how_its_plan_stands_is_asked_otherwise():
    watch = PlanWatch(home_item=True)
    assert watch.knows_no_state
    watch.take({"seq": 1})
    assert watch.knows_no_state
    watch.take({"seq": 1, "total": 4, "mission_state": PlanState.ACTIVE})
    assert not watch.knows_no_state


class Arming:
    """Refuses so many times, each with its reason, as MAVSDK hears it; then arms."""

    def __init__(self, vessel, refusals):
        self.vessel, self.refusals = vessel, refusals

    def arm(self):
        if self.refusals:
            self.refusals -= 1
            self.vessel._say("No ground station heard; arm with force to insist")
            raise RuntimeError("command denied temporarily")
        self.vessel._say("armed")


@pytest.mark.parametrize(("refusals", "shown"), [(2, ["vessel: armed"]), (10**6, [])])
def test_a_refusal_to_arm_is_shown_only_where_patience_does_not_overcome_it(monkeypatch, capsys, refusals, shown):
    now_s = [0.0]
    monkeypatch.setattr(link.time, "monotonic", lambda: now_s[0])
    monkeypatch.setattr(link.time, "sleep", lambda wait_s: now_s.__setitem__(0, now_s[0] + wait_s))
    vessel = FakeVessel()
    monkeypatch.setattr(action, "Action", lambda system: Arming(vessel, refusals))
    if shown:
        link.Vessel.arm(vessel)
    else:
        with pytest.raises(link.LinkError, match="arm: command denied temporarily"):
            link.Vessel.arm(vessel)
        shown = ["vessel: No ground station heard; arm with force to insist"]
    assert capsys.readouterr().err.splitlines() == shown


@pytest.mark.parametrize(
    ("word", "told"), [("status", "tell of a sea trial"), ("confirm", "whole throttle"), ("stop", "end a sea trial")]
)
def test_without_a_trial_the_refusal_is_told_in_words(run, capsys, monkeypatch, word, told):
    vessel = FakeVessel()
    monkeypatch.setattr(vessel, "_answer", lambda number, params: REFUSED)
    assert run(vessel, "trial", word) == 1
    said = capsys.readouterr()
    assert said.err.startswith("the vessel refuses to ")
    assert told in said.err
    assert "keeps its place" not in said.out
