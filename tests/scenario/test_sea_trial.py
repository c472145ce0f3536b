"""A sea trial of the whole vessel, ordered by a station's command: inside its circle, under fence, failsafe and gate."""

import math

import pytest

from companion.tuning.fitted import vessel_toml
from mavlink_bridge.language.messages import Action, Mode
from mavlink_bridge.language.requests import Arm, SetMode
from mavlink_bridge.language.trials import SeaTrial, TrialOrder
from tests.soaked import in_the_soak
from tests.world_station import Helm
from tools.benches.cells.foreign_hulls import launch
from tools.benches.cells.trial_cells import wrong

SEA = ("world.water.current_mps=0.3", "world.water.wind_mps=4", "depth.enabled=false")


def begun(voyage, radius_m=80.0, seed=1):
    run = voyage(*SEA, seed=seed)
    run.ask(Arm(arm=True))
    assert run.ask(SeaTrial(TrialOrder.BEGIN, radius_m, quick=True)).reason == ""
    return run


def thrust(run):
    return max(abs(value) for value in run.world.surroundings.plant.vessel.thrust_n)


def away_m(run, start):
    return math.hypot(run.truth.north_m - start[0], run.truth.east_m - start[1])


def test_manoeuvres_are_announced_and_sailed_inside_the_circle(voyage):
    run = begun(voyage)
    start, furthest_m, fastest_mps = (run.truth.north_m, run.truth.east_m), 0.0, 0.0
    assert run.ask(SeaTrial(TrialOrder.CONFIRM)).reason == ""
    for _ in range(round(90.0 / 0.05)):
        run.step()
        furthest_m, fastest_mps = max(furthest_m, away_m(run, start)), max(fastest_mps, run.truth.u_mps)
    assert 5.0 < furthest_m < 80.0
    assert fastest_mps > 0.7
    assert run.snapshot.mode is Mode.GUIDED


def test_a_file_wrong_by_half_does_not_break_it_off(voyage, tmp_path):
    """What the trial is for: by such a file a sound thruster had been missed after a minute, and the trial ended."""
    hull = launch()
    (tmp_path / "true.toml").write_text(vessel_toml(hull))
    (tmp_path / "wrong.toml").write_text(vessel_toml(wrong(hull, 1)))
    run = voyage(*SEA, f"vessel='{tmp_path / 'wrong.toml'}'", f"world.vessel='{tmp_path / 'true.toml'}'")
    run.ask(Arm(arm=True))
    assert run.ask(SeaTrial(TrialOrder.BEGIN, 80.0, quick=True)).reason == ""
    assert run.ask(SeaTrial(TrialOrder.CONFIRM)).reason == ""
    run.run(120.0)
    assert not [text for text in run.texts if "gives much less" in text or "Trial ended" in text]
    assert run.ask(SeaTrial(TrialOrder.TELL)).reason == ""


def test_an_order_ends_it_at_once_and_station_is_kept(voyage):
    run = begun(voyage)
    run.run(40.0)
    run.ask(SetMode(Mode.HOLD))
    run.run(5.0)
    here = run.truth.north_m, run.truth.east_m
    run.run(60.0)
    assert away_m(run, here) < 8.0
    assert run.ask(SeaTrial(TrialOrder.CONFIRM)).reason == "no sea trial is under way"


def test_who_stops_it_is_told_whether_there_was_one(voyage):
    run = begun(voyage)
    run.run(10.0)
    assert run.ask(SeaTrial(TrialOrder.END)).reason == ""
    run.step()
    assert any(text.startswith("Trial ended: ordered") for text in run.texts)
    assert run.ask(SeaTrial(TrialOrder.END)).reason == "no sea trial is under way"


def test_it_is_valid_for_one_arming(voyage):
    run = begun(voyage)
    run.run(30.0)
    run.ask(Arm(arm=False))
    run.run(5.0)
    run.ask(Arm(arm=True))
    here = run.truth.north_m, run.truth.east_m
    run.run(60.0)
    assert away_m(run, here) < 8.0


def test_a_disarmed_vessel_and_a_circle_that_leaves_the_fence_are_refused(voyage):
    run = voyage(*SEA)
    assert "disarmed" in run.ask(SeaTrial(TrialOrder.BEGIN, 80.0)).reason
    run.ask(Arm(arm=True))
    assert "outside 25...500 m" in run.ask(SeaTrial(TrialOrder.BEGIN, 10.0)).reason


def test_whether_one_may_begin_is_told_without_beginning_and_before_arming(voyage):
    run = voyage(*SEA)
    assert run.ask(SeaTrial(TrialOrder.LOOK, 80.0)).reason == ""
    run.circle_fence(60.0)
    assert "outside the fence" in run.ask(SeaTrial(TrialOrder.LOOK, 80.0)).reason
    assert run.ask(SeaTrial(TrialOrder.LOOK, 80.0, fitted=True)).reason == ""
    run.step()
    assert "A sea trial may begin here: a circle of 80 m" in run.texts
    assert any("to 60 m of free water" in text or "circle of 60 m" in text for text in run.texts)
    assert run.ask(SeaTrial(TrialOrder.TELL)).reason == "no sea trial is under way"
    assert not run.snapshot.armed


def test_a_fence_near_one_side_is_kept_by_a_fitted_trial_and_how_it_stands_is_told(voyage):
    run = voyage(*SEA)
    assert run.circle_fence(80.0, north_m=40.0).reason == ""
    run.ask(Arm(arm=True))
    assert "outside the fence" in run.ask(SeaTrial(TrialOrder.BEGIN, 80.0)).reason
    assert run.ask(SeaTrial(TrialOrder.BEGIN, 80.0, quick=True, fitted=True)).reason == ""
    run.ask(SeaTrial(TrialOrder.CONFIRM))
    furthest_m = 0.0
    for _ in range(round(100.0 / 0.05)):
        run.step()
        furthest_m = max(furthest_m, math.hypot(run.truth.north_m - 40.0, run.truth.east_m))
    assert furthest_m < 80.0
    assert run.ask(SeaTrial(TrialOrder.TELL)).reason == ""
    run.step()
    assert any(text.startswith("Trial: ") and "of 10 done; " in text and "min left" in text for text in run.texts)


@pytest.mark.parametrize("seed", [9])
def test_a_vessel_that_its_law_cannot_hold_is_kept_inside_by_the_sticks(voyage, seed):
    run = begun(voyage, seed=seed)
    start, furthest_m = (run.truth.north_m, run.truth.east_m), 0.0
    run.ask(SeaTrial(TrialOrder.CONFIRM))
    run.run(120.0)
    run.world.surroundings.plant.vessel.thruster_health[1] = 0.0
    for _ in range(round(160.0 / 0.05)):
        run.step()
        furthest_m = max(furthest_m, away_m(run, start))
    assert furthest_m < 60.0
    assert any(text.startswith("Trial ended: a thruster gives too little") for text in run.texts)


def test_who_stops_one_that_is_over_and_still_sails_the_vessel_is_obeyed(voyage):
    """A trial that is broken off without an order keeps the vessel about the middle, by its sticks where the law does not."""
    run = begun(voyage)
    run.run(10.0)
    run.world.app.vehicle.parts.navigator.abandon_trial("the middle is not reached")
    run.run(1.0)
    assert any(text.startswith("Trial ended: the middle is not reached") for text in run.texts)
    assert run.ask(SeaTrial(TrialOrder.END)).reason == ""
    assert run.ask(SeaTrial(TrialOrder.END)).reason == "no sea trial is under way"


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(20))
def test_a_dead_thruster_leaves_the_vessel_inside(voyage, seed):
    run = begun(voyage, seed=seed)
    start, furthest_m = (run.truth.north_m, run.truth.east_m), 0.0
    run.ask(SeaTrial(TrialOrder.CONFIRM))
    run.run(20.0 + 15.0 * seed)
    run.world.surroundings.plant.vessel.thruster_health[seed % 2] = 0.0
    for _ in range(round(240.0 / 0.05)):
        run.step()
        furthest_m = max(furthest_m, away_m(run, start))
    assert furthest_m < 80.0


def lost_station(helm):
    helm.present = False


def battery(helm):
    helm.world.surroundings.plant.board.set_voltage(10.5)


def board(helm):
    helm.world.surroundings.plant.board.reset(helm.world.now_us)


def fence(helm):
    here = helm.at(helm.truth.north_m, helm.truth.east_m)
    assert helm.upload([(0, 5003, 6.0, 0.0, 0.0, 0.0, *here, 0.0)], 1) == 0


def disarm(helm):
    assert helm.command(400, 0.0) == 0


def hold(helm):
    assert helm.command(176, 1.0, 4.0) == 0


@pytest.mark.parametrize(
    ("happens", "author", "planned"),
    [
        (lost_station, "ground station lost", True),
        (battery, "battery critical", False),
        (board, "disarmed (actuator board restarted", True),
        (fence, "fence ahead", False),
        (disarm, "disarmed (by the operator)", True),
        (hold, "Hold ordered", False),
    ],
)
def test_who_ended_a_trial_is_told_and_that_no_order_goes_on(happens, author, planned):
    """Told "Hold ordered" or "Return ordered" where nobody had, and to "order Guided to go on": a trial never goes on."""
    helm = Helm("ardurover", "depth.enabled=false", "monitors.battery_critical_v=11")
    helm.world.surroundings.plant.board.set_voltage(13.0)
    if planned:
        assert helm.upload([(3, 16, 0.0, 0.0, 0.0, math.nan, *helm.at(60.0, 0.0), 0.0)]) == 0
    helm.command(176, 1.0, 4.0)
    assert helm.command(400, 1.0) == 0
    assert helm.command(31012, 1.0, 60.0, 1.0) == 0
    assert helm.command(31012, 2.0) == 0
    helm.until(lambda: helm.world.snapshot.state.sog_mps > 0.8, 60.0)
    helm.gcs.clear()
    told = []
    happens(helm)
    for _ in range(500):
        told += [text.text for text in helm.world.snapshot.texts]
        helm.step()
    said = helm.texts().replace("\n", "")
    assert f"Trial ended: {author}" in said
    assert said.count("Trial ended: ") == 1
    assert not [text for text in told if "order Guided" in text or "order Auto" in text]
    assert happens in (board, disarm, hold) or [text for text in told if "then order Hold" in text]


def low_battery(after_s):
    """A quick trial at full throttle whose battery gets low after so long, and is told as low."""
    helm = Helm("ardurover", "depth.enabled=false", "monitors.battery_low_v=12")
    helm.world.surroundings.plant.board.set_voltage(13.0)
    assert helm.command(400, 1.0) == 0
    assert helm.command(31012, 1.0, 60.0, 1.0) == 0
    assert helm.command(31012, 2.0) == 0
    helm.run(after_s)
    helm.world.surroundings.plant.board.set_voltage(11.5)
    helm.until(lambda: "Battery low" in helm.texts(), 30.0)
    return helm


@pytest.mark.parametrize("after_s", [*in_the_soak(25.0, 55.0), 40.0])
def test_a_battery_that_gets_low_ends_a_trial_before_the_next_run(after_s):
    """One with such a battery is not begun; but the next run at 95 % was sailed, six seconds after the warning."""
    helm = low_battery(after_s)
    helm.until(lambda: "Trial ended: " in helm.texts(), 90.0)
    helm.run(60.0)
    said = helm.texts().replace("\n", "")
    assert "Trial ended: the battery is low, and the next run asks for full thrust" in said
    after = said[said.index("Battery low") :]
    assert after.count(" in 5 s: ") <= 1, "no further run is announced"
    assert helm.world.snapshot.action is Action.WARN
    assert helm.world.snapshot.armed, "she is kept about the middle"


def test_a_battery_that_sags_under_full_thrust_alone_does_not_end_a_trial():
    """Sound at rest, below the warning at each run: what is judged is whether it is low when the next one is to begin."""
    helm = Helm("ardurover", "depth.enabled=false", "monitors.battery_low_v=12")
    board = helm.world.surroundings.plant.board
    board.set_voltage(13.0)
    assert helm.command(400, 1.0) == 0
    assert helm.command(31012, 1.0, 60.0, 1.0) == 0
    assert helm.command(31012, 2.0) == 0
    for _ in range(round(150.0 / 0.05)):
        board.set_voltage(11.0 if max(abs(pulse - 1500.0) for pulse in helm.pulses_us[:2]) > 300.0 else 13.0)
        helm.step()
    assert "Battery low" in helm.texts()
    assert "Trial ended" not in helm.texts()


def test_a_second_start_does_not_end_the_first(voyage):
    """It did: three manoeuvres were lost, and the circle lay where the boat happened to be. One might begin, the vessel had said."""
    run = begun(voyage)
    run.run(60.0)
    assert "under way: stop it first" in run.ask(SeaTrial(TrialOrder.LOOK, 80.0)).reason
    assert "under way: stop it first" in run.ask(SeaTrial(TrialOrder.BEGIN, 80.0)).reason
    run.run(5.0)
    assert not [text for text in run.texts if "Trial ended" in text]
    assert run.ask(SeaTrial(TrialOrder.TELL)).reason == ""


def test_a_boat_that_turns_against_her_helm_is_not_sailed_away(voyage):
    """Leads changed over: the trial ended by itself after 4 min, and its sticks for the way back took her 550 m off in 20 min."""
    run = voyage(*SEA, "vessel='blueboat'")
    hull = run.world.surroundings.plant.vessel
    as_wired = hull.step

    def changed_over(dt_s, thruster_port, thruster_starboard, **others):
        as_wired(dt_s, thruster_starboard, thruster_port, **others)

    hull.step = changed_over
    run.ask(Arm(arm=True))
    assert run.ask(SeaTrial(TrialOrder.BEGIN, 60.0, quick=True)).reason == ""
    assert run.ask(SeaTrial(TrialOrder.CONFIRM)).reason == ""
    run.run(40.0)
    assert any("leads changed over, or a rudder mirrored. Thrust off, she drifts" in text for text in run.texts)
    run.run(20.0)
    assert thrust(run) < 1e-6
