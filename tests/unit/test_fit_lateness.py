"""A heading that is recorded late: told by what the track shows, never by thrusters that run up slowly, and never twice."""

import numpy as np
import pytest

from companion.commands import tune_vessel
from companion.commands.tune_vessel import late_heading_words
from companion.io.recording.input_recorder import InputRecorder
from companion.replay.sailed_by import heading_latency_of
from companion.settings import load_vessel
from companion.tuning.effects import heading_late_s
from companion.tuning.fit import Fit
from companion.tuning.unknowns import FitUnknown

WIDTH_S = 0.15


def fit_of(rate_late_s, bow_late_s, bow_sd_s, own=True):
    """What a fit found of a trial: how late the rate is after the commands, and the bow more than that."""
    names = ["heading_late", "bow_late", *([] if own else ["sensor_forward"])]
    unknowns = [FitUnknown(name, 0.0, WIDTH_S, relative=False) for name in names]
    values = dict(zip(names, (rate_late_s, bow_late_s, 0.0), strict=False))
    spread = dict(zip(names, (0.015, bow_sd_s, 0.1), strict=False))
    deviation = np.array([spread[name] / WIDTH_S for name in names])
    known = {u.name: bool(u.known(0.0, each)) for u, each in zip(unknowns, deviation, strict=True)}
    return Fit(
        load_vessel("otter"), values, spread, known=known, unknowns=unknowns, covariance=np.diag(deviation**2),
        errors=(0.1, 0.1, 0.1), errors_before=(0.1, 0.1, 0.1),
    )  # fmt: skip


SLOW_THRUSTERS = {
    "a catamaran whose thrusters run up in a second": (0.290, -0.227, 0.038),
    "the next trial, 0.24 s set": (0.252, -0.178, 0.028),
    "the third, 0.48 s set": (0.142, -0.231, 0.044),
    "a round hull": (0.281, -0.232, 0.025),
    "a heavy boat, half a second of slip": (0.121, 0.089, 0.039),
}
"""Trials with a compass that was on time."""


@pytest.mark.parametrize("found", SLOW_THRUSTERS.values(), ids=SLOW_THRUSTERS)
def test_thrusters_that_run_up_slowly_make_no_late_compass(found, capsys):
    """Of one on time it was said three times that 0.24, 0.20 and 0.09 s more be set; with their sum she never finished a leg."""
    fit = fit_of(*found)
    tune_vessel._tell_lateness(fit, [])
    assert "heading" not in capsys.readouterr().out
    assert heading_late_s(fit) == 0.0


LATE = {"otter": (0.300, -0.002, 0.021), "crooked": (0.301, -0.021, 0.029), "two motors": (0.372, 0.031, 0.046)}
"""Trials with a compass that was 0.25 s late, and settings that said nothing of it."""


@pytest.mark.parametrize("found", LATE.values(), ids=LATE)
def test_a_late_compass_is_told_by_no_more_than_it_is(found):
    assert 0.1 < heading_late_s(fit_of(*found)) <= 0.25


@pytest.mark.parametrize("found", [(0.299, -0.166, 0.026), (0.470, -0.186, 0.064)], ids=["otter", "catamaran"])
def test_what_is_set_rightly_is_not_told_again(found):
    """The heading's age is made up for, and the turn rate is as late as ever."""
    assert heading_late_s(fit_of(*found)) == 0.0


def test_a_track_that_tells_nothing_is_no_late_compass():
    assert heading_late_s(fit_of(0.498, 0.008, 0.116)) == 0.0


def test_a_foreign_log_may_tell_rate_and_heading_by_two_sensors():
    assert heading_late_s(fit_of(0.5, 0.0, 0.02, own=False)) == 0.0
    assert heading_late_s(fit_of(0.05, 0.25, 0.02, own=False)) == pytest.approx(0.21)


def test_the_amount_that_was_set_is_named_and_what_comes_of_it_is_bounded():
    assert late_heading_words(0.0, [0.1]) == ""
    once = late_heading_words(0.2, [0.1, 0.1])
    assert "at least 0.20 s late" in once
    assert once.endswith("nmea.heading_latency_s was 0.1; set 0.30")
    assert late_heading_words(0.3, [0.2]).endswith("set 0.40")
    assert "quicker compass" in late_heading_words(0.3, [0.4])
    for unsure in ([None], [0.1, 0.2], [0.1, None]):
        assert "0.20 more than it was then, at most 0.4 in all" in late_heading_words(0.2, unsure)


def test_a_run_knows_what_was_set(tmp_path):
    start = bytearray()
    sensors = [{"nmea": {"heading_latency_s": late_s}} for late_s in (0.0, 0.12)]
    vessel = load_vessel("otter").model_dump(mode="json")
    InputRecorder(start.extend).start({"settings": {"sensors": sensors}, "vessel": vessel})
    (tmp_path / "inputs.bin").write_bytes(start)
    assert heading_latency_of(tmp_path) == heading_latency_of(tmp_path / "control.csv") == 0.12
    assert heading_latency_of(tmp_path / "log.csv") is None
