"""The bandwidth that a fitted file is given: what is not known lowers it only where that helps."""

import contextlib
import io
from dataclasses import replace

import numpy as np
import pytest

from companion.cli import main
from companion.commands import tune_vessel
from companion.commands.tune_vessel import margin_words
from companion.core.hull import VesselConfig
from companion.core.hull.blown import off_rad
from companion.core.hull.vessel_file import WindageConfig
from companion.core.steer import SteeringConfig
from companion.core.steer.yaw_loop import LoopMargins
from companion.settings import load_vessel
from companion.tuning import fit as fitting, fit_page
from companion.tuning.fit import Fit
from companion.tuning.fitted import Gains, as_toml, care, doubt, fitted_vessel, gains_for, interval, strayed
from companion.tuning.hull_arrays import coefficients
from companion.tuning.unknowns import FitUnknown
from tools.benches.cells.foreign_hulls import bare, rudderless, single_screw


def fit_of(vessel: VesselConfig, name: str, deviation: float) -> Fit:
    """A fit that found the file right, one coefficient so unsure (relative)."""
    start = coefficients(vessel)[name]
    unknown = FitUnknown(name, start, 0.5, relative=True)
    return Fit(
        vessel, {name: start}, {name: deviation * start},
        known={name: True}, unknowns=[unknown], covariance=np.array([[(deviation / 0.5) ** 2]]),
        errors=(0.1, 0.1, 0.1), errors_before=(0.1, 0.1, 0.1), seconds=600.0,
    )  # fmt: skip


def test_a_rudder_that_turns_nothing_at_rest_costs_no_bandwidth():
    gains = gains_for(fit_of(single_screw(), "m33", 0.1), single_screw(), SteeringConfig())
    assert gains.holds
    assert not gains.lowered
    assert gains.speeds[0] > 0.0


def test_a_hull_that_turns_away_by_itself_is_not_given_the_slowest_law():
    """Nothing holds at the worst corner at speed; slow gains would let it go, as they did with 0.37 rad/s."""
    vessel = bare("otter", 1.0)
    gains = gains_for(fit_of(vessel, "m33", 0.3), vessel, SteeringConfig())
    assert not gains.holds
    assert not gains.lowered
    assert gains.up_to_mps < gains.speeds[-1]


def test_what_is_unsure_lowers_the_bandwidth_where_that_holds():
    vessel = rudderless()
    sure, unsure = (gains_for(fit_of(vessel, "lag", d), vessel, SteeringConfig()) for d in (0.02, 0.2))
    assert sure.holds
    assert unsure.holds
    assert unsure.bandwidth <= sure.bandwidth
    assert unsure.up_to_mps == pytest.approx(unsure.speeds[-1])


@pytest.mark.parametrize("windage", [load_vessel("otter").windage, WindageConfig()], ids=["told", "untold"])
def test_no_bandwidth_is_told_by_which_wind_would_turn_her_away(windage):
    """Margins held with 0.51 rad/s, and with 0.43 on a catamaran: in 8 m/s she was blown 44 m off her leg, and never done with it."""
    vessel = load_vessel("otter").model_copy(update={"windage": windage})
    gains = gains_for(fit_of(vessel, "m33", 0.5), vessel, SteeringConfig())
    assert not gains.lowered
    assert gains.blown
    told = margin_words(gains)
    assert "margins MISS" in told
    assert "record more" in told
    assert "set STEER_BW" not in told


def test_a_bandwidth_that_bears_the_wind_is_told_as_before():
    vessel = load_vessel("otter")
    gains = gains_for(fit_of(vessel, "lag", 0.4), vessel, SteeringConfig())
    assert gains.holds
    assert gains.lowered
    assert not gains.blown
    assert max(gains.off_rad) < 0.2


def test_the_slower_the_loop_the_farther_wind_turns_her():
    vessel = load_vessel("otter")
    fast, slow = off_rad(vessel, 1.0, 100.0), off_rad(vessel, 1.0, 25.0)
    assert slow == pytest.approx(4.0 * fast)
    larger = vessel.windage.model_copy(update={"lateral_m2": 3.0 * vessel.windage.lateral_m2})
    assert off_rad(vessel.model_copy(update={"windage": larger}), 1.0, 100.0) > 2.0 * fast


def test_a_boat_that_waves_turn_more_than_her_helm_gets_a_file_that_says_so():
    vessel = single_screw()
    good = fit_of(vessel, "m33", 0.1)
    thrown = replace(good, errors=(0.18, 0.46, 0.99))
    assert doubt(good) == ""
    assert "waves turned her more than her helm" in doubt(thrown)
    assert "DO NOT adopt" in as_toml(thrown, vessel, "run-1", "2026-11-25").split("[hull]")[0]
    assert "DO NOT adopt" not in as_toml(good, vessel, "run-1", "2026-11-25")
    less = replace(good, errors=(0.14, 0.19, 0.52), wider=2.2)
    assert doubt(less) == care(good) == care(thrown) == ""
    assert "intervals are 2.2 times as wide" in as_toml(less, vessel, "run-1", "2026-11-25").split("[hull]")[0]


def test_a_sideways_motion_that_nothing_explains_is_doubted_unless_it_is_noise():
    """The sign of sway was wrong: m22 of 515 kg on a boat of 30, and the file was offered for adoption."""
    vessel = single_screw()
    sway = np.resize([0.3, -0.3], (50, 4))
    swung = replace(
        fit_of(vessel, "m22", 0.1), errors=(0.09, 0.64, 0.05), samples={"measured": np.stack([sway] * 3, axis=1)}
    )
    assert "sideways motion is hardly explained (error 0.64): the sign of sway is wrong" in doubt(swung)
    assert doubt(replace(swung, errors=(0.09, 0.4, 0.05))) == ""
    # a boat that hardly drifts: what her receiver scatters by is all the sway there is
    assert (
        doubt(replace(swung, errors=(0.09, 0.95, 0.05), samples={"measured": np.stack([0.2 * sway] * 3, axis=1)})) == ""
    )


def test_what_came_out_far_from_the_file_is_named_with_its_factor():
    """Speeds in km/h made thrust 3.6 times the bollard pull, without a word."""
    vessel = single_screw()
    fit = fit_of(vessel, "ahead", 0.1)
    pull = coefficients(vessel)["ahead"]
    fast = replace(fit, values={"ahead": 3.6 * pull})
    assert strayed(fast) == "far from the file: ahead 3.6 times: are units, signs and mass right?"
    assert strayed(replace(fit, values={"ahead": pull / 3.6})).startswith("far from the file: ahead 0.28 times")
    assert strayed(replace(fit, values={"ahead": 2.0 * pull})) == strayed(fit) == ""
    for said in (as_toml(fast, vessel, "run-1", "2026-11-25").split("[hull]")[0], told(fast)):
        assert "far from the file: ahead 3.6 times" in said


def test_a_record_in_gusts_says_that_the_way_to_rest_is_told_longer():
    vessel = single_screw()
    gusty = replace(fit_of(vessel, "xu", 0.1), unsteady=3.0)
    assert "thrust and drag are told 3.0 times as wide" in care(gusty)
    both = care(replace(gusty, wider=1.5, errors=(0.1, 0.1, 0.45)))
    assert both.count("take care") == 1
    assert "waves turned her" in both
    assert "gave and took way" in both
    assert care(replace(gusty, errors=(0.9, 0.1, 0.1))) == ""


def test_an_interval_holds_nothing_that_can_not_be():
    """Drag stood as "-4.8 to 52.9", and sway damping as "-241 to 2651"."""
    vessel = single_screw()
    drag = coefficients(vessel)["xu"]
    wide = fit_of(vessel, "xu", 0.55)
    low, high = interval("xu", wide)
    assert (low, high) == (pytest.approx(drag / np.exp(1.1)), pytest.approx(drag * np.exp(1.1)))
    assert f"# {low:.4g} to {high:.4g} N/(m/s)" in as_toml(wide, vessel, "run-1", "2026-11-25")
    lost = FitUnknown("speed_loss", 0.02, 0.08, relative=False, low=-0.25, high=5.0)
    unsure = replace(wide, values={"speed_loss": 0.02}, spread={"speed_loss": 0.05}, unknowns=[lost])
    assert interval("speed_loss", unsure) == (pytest.approx(0.0), pytest.approx(0.12))


def told(fit):
    """What the command prints of a fit."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        tune_vessel._tell(fit, [], gains_of((9.0, 50.0)))
    return out.getvalue()


def test_the_way_to_rest_is_no_longer_for_each_trial_that_is_sailed():
    """The file before was told longer for what was not known then; that is not doubt of this fit."""
    once = fitted_vessel(fit_of(load_vessel("otter"), "xu", 0.15))
    assert once.stopping_factor > 1.05
    assert fitted_vessel(fit_of(once, "xu", 0.15)).stopping_factor == once.stopping_factor


def gains_of(*worst: tuple[float, float], lowered: bool = False) -> Gains:
    """At 0, 0.98, 1.96 ... m/s."""
    speeds = tuple(0.98 * k for k in range(len(worst)))
    margins = tuple(LoopMargins(*each) for each in worst)
    return Gains(1.8, lowered, speeds, ((1.0, 0.0, 1.0),) * len(worst), best=margins, worst=margins)


def test_the_margin_that_misses_is_named_with_its_speed_and_bar():
    told = margin_words(gains_of((12.7, 42.97), (14.0, 60.0)))
    assert "phase 42.9 deg at 0.0 m/s (bar 45)" in told
    assert "gain" not in told
    assert "no faster" not in told, "nothing holds at rest, and no speed is named"
    assert "record more" in told


def test_where_some_speed_holds_it_is_named_and_not_rounded_up():
    told = margin_words(gains_of((9.0, 50.0), (8.5, 46.0), (6.04, 44.0), (7.0, 30.0)))
    assert "gain 6.0 dB at 2.0 m/s (bar 8), phase 30.0 deg at 2.9 m/s (bar 45)" in told
    assert "sail no faster than 0.9 m/s" in told


def test_margins_that_hold_are_told_with_the_bandwidth_that_they_need():
    assert "set STEER_BW 1.80" in margin_words(gains_of((9.0, 50.0), (8.5, 46.0), lowered=True))
    told = margin_words(gains_of((9.0, 50.0), (8.5, 46.0)))
    assert told == "margins hold at the worst corner of what is known: at least 8.5 dB (bar 8) and 46 deg (bar 45)"


def test_a_fitted_file_is_told_from_the_one_that_it_was_fitted_from(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(tune_vessel, "_stretches", lambda runs, columns: [])
    monkeypatch.setattr(fitting, "fit_vessel", lambda start, stretches, say: fit_of(start, "m33", 0.1))
    monkeypatch.setattr(fit_page, "page", lambda *_, **__: "")
    monkeypatch.chdir(tmp_path)
    assert main(["tune", "vessel", "run", "--vessel", "otter"]) == 0
    first = load_vessel("otter-fitted.toml").name
    assert first.startswith("otter fitted 20")
    assert main(["tune", "vessel", "run", "--vessel", "otter-fitted.toml", "-o", "again.toml"]) == 0
    assert load_vessel("again.toml").name.count("fitted") == 1
