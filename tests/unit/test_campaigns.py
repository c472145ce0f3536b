"""The campaigns: every line is found, a miss is named, and a fault counts from the moment at which the truth shows it."""

import math
import sys

import pytest

from companion.core.guard.diagnosis import Cause
from companion.core.hull.statics import top_speed_mps
from companion.judge.hulls import hull_mistakes
from tools.benches.cells.control_cells import Case
from tools.benches.cells.drawn_hulls import KINDS, drawn
from tools.benches.cells.fault_cells import SoundTwin, Told, faults, stuck, thrusters, trailing
from tools.campaigns import __main__ as command
from tools.campaigns.campaign import HULLS, Campaign, hull


def doubled(name, seed):
    return {"off_m": 2.0 * seed} if seed else {}


CAMPAIGN = Campaign(
    told="twice the seed",
    jobs=lambda hulls, seeds: ((name, seed) for name in hulls for seed in seeds),
    sail=doubled,
    misses=lambda _, figures: ["too far"] if figures["off_m"] > 5.0 else [],
    share=0.5,
)


def run(monkeypatch, *words):
    monkeypatch.setattr(command, "campaign", lambda line: CAMPAIGN)
    monkeypatch.setattr(sys, "argv", ["campaigns", "hover", "--jobs", "1", *words])
    return command.main()


def test_every_line_is_found_and_has_runs():
    for line in command.LINES:
        found = command.campaign(line)
        assert next(found.jobs(("otter",), range(1, 2)))[0] == ("small" if line == "drawn" else "otter")


@pytest.mark.parametrize("kind", KINDS)
def test_boats_that_are_drawn_could_float_and_are_the_same_each_time(kind):
    for seed in range(30):
        vessel = drawn(kind, seed)
        assert hull_mistakes(vessel) == []
        assert drawn(kind, seed) == vessel
        froude = top_speed_mps(vessel) / math.sqrt(9.81 * vessel.hull.length_m)
        assert 0.2 < froude < 0.6 or (kind == "fast" and 0.65 < froude < 1.4)


def test_a_miss_is_named_and_a_run_without_figures_does_not_count(monkeypatch, capsys):
    assert run(monkeypatch, "--hulls", "otter,launch", "--seeds", "0:3") == 0
    told = capsys.readouterr().out
    assert "NOT launch 3: too far" in told
    assert "all              4 of     6 hold  off_m 4.000 / 6.000" in told
    assert run(monkeypatch, "--seeds", "3") == 1


@pytest.mark.parametrize(("words", "told"), [(("--hulls", "raft"), "no hull 'raft'"), (("--seeds", "a"), "write 1:5")])
def test_a_wrong_word_is_told_with_its_mend(monkeypatch, capsys, words, told):
    with pytest.raises(SystemExit) as ended:
        run(monkeypatch, *words)
    assert ended.value.code == 2
    assert told in capsys.readouterr().err


def test_a_hull_has_the_faults_of_what_it_has():
    counts = {name: len(faults(hull(name))) for name in HULLS}
    assert (counts["otter"], counts["blueboat"], counts["single"]) == (12, 8, 7)


def shown_s(fault, until_s=20.0):
    run = Case(hull("otter")).loop()
    run.place(0.0, 0.0, 0.0, 1.5)
    run.sail(run.goto(200.0, 0.0))
    twin = SoundTwin(run)
    while run.t_s < until_s:
        if 10.0 < run.t_s <= 10.05:
            fault(run.vessel)
        run.tick(1.5)
        if twin.differs():
            return run.t_s
    return None


def test_a_fault_shows_at_once_where_thrust_is_asked_and_never_where_nothing_is():
    assert 10.0 < shown_s(thrusters(0.0, 1.0)) < 10.2
    assert 10.0 < shown_s(stuck(15.0)) < 10.2
    assert shown_s(lambda vessel: None) is None
    assert shown_s(stuck(0.0)) is None
    assert shown_s(trailing) is None


def test_a_cause_counts_when_it_is_the_right_one_in_time():
    told = Told(frozenset({Cause.SLIP}), 0.0, 12.0)
    assert told.within(15.0, Cause.SLIP)
    assert not told.within(10.0, Cause.SLIP)
    assert not told.within(15.0, Cause.WEAK)
    assert Told(frozenset(), 3.0, None).within(15.0, Cause.SLIP) is False
    assert Told(frozenset(), None, None).within(15.0, Cause.SLIP) is None
