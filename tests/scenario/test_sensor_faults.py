"""The whole vessel on a circle when a sensor fails: what the pins do, and that nothing is steered on a lie.

Fault matrix rows 21-27, 30, 31, 33: injected into the simulated sensors, seen at the actuator board's pins and in the truth.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

import config
from companion.core.nmea.line import frame
from companion.settings.schema import load
from mavlink_bridge.language.messages import Action, Mode
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanItem, PlanKind, SetMode, StartPlan
from mavlink_bridge.language.units import wrap_pi
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from sitl.plant.truth import Truth
from sitl.sensors import talkers
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.soaked import in_the_soak

CHANGE_SPEED, LOITER_UNLIMITED = 178, 17
RADIUS_M = 20.0
CENTRE_M = (40.0, 15.0)
NEUTRAL_US = 1500.0


def on_the_circle(*overrides: str, sailed_s: float = 60.0, seed: int = 1) -> World:
    """A vessel that has settled on a circle of 20 m at 1.5 m/s."""
    settings = load(config.path("sim.toml"), ["operator.gcs_required=false", *overrides], SimSettings)
    world = World(settings, seed)
    sail_the_circle(world, sailed_s)
    assert abs(off_circle_m(world)) < 1.0
    return world


def sail_the_circle(world: World, sailed_s: float) -> None:
    """Arm, and sail a circle of 20 m at 1.5 m/s for so long."""
    lat_rad, lon_rad = world.surroundings.plant.frame.to_geodetic(*CENTRE_M)
    x, y = round(math.degrees(lat_rad) * 1e7), round(math.degrees(lon_rad) * 1e7)
    items = [
        PlanItem(CHANGE_SPEED, 2, 1.0, 1.5, -1.0, 0.0, 0, 0, 0.0),
        PlanItem(LOITER_UNLIMITED, 3, 0.0, 0.0, RADIUS_M, 1.0, x, y, 0.0),
    ]
    plan = load_plan(PlanKind.MISSION, items)
    assert isinstance(plan, LoadPlan)
    world.run(2.0)
    for request in (plan, Arm(arm=True), StartPlan(0)):
        replies = []
        world.app.submit(request, replies.append)
        world.run(0.3)
        assert replies[0].reason == ""
    world.run(sailed_s)


def off_circle_m(world: World) -> float:
    truth = world.surroundings.truth
    return math.hypot(truth.north_m - CENTRE_M[0], truth.east_m - CENTRE_M[1]) - RADIUS_M


def faults(world: World):
    return world.surroundings.plant.sensors.faults


def neutral(world: World) -> bool:
    return all(abs(pulse - NEUTRAL_US) <= 10.0 for pulse in world.surroundings.plant.board.pulses_us)


def thrusters_neutral(world: World) -> bool:
    return all(abs(pulse - NEUTRAL_US) <= 10.0 for pulse in world.surroundings.plant.board.pulses_us[:2])


def until(world: World, seconds: float, condition: Callable[[World], bool]) -> float | None:
    """Seconds until the condition holds after a step; None when it never does."""
    start_us = world.now_us
    while world.now_us < start_us + seconds * 1e6:
        world.step()
        if condition(world):
            return (world.now_us - start_us) * 1e-6
    return None


def texts_during(world: World, seconds: float, watch: Callable[[World], None] = lambda world: None) -> list[str]:
    texts: list[str] = []
    end_us = world.now_us + round(seconds * 1e6)
    while world.now_us < end_us:
        world.step()
        watch(world)
        assert world.snapshot is not None
        texts += [text.text for text in world.snapshot.texts]
    return texts


def test_row_21_silent_gnss_neutral_within_200_ms_of_the_position_growing_stale() -> None:
    world = on_the_circle()
    faults(world).set("gnss_silent", True)
    invalid_s = until(world, 3.0, lambda here: not here.snapshot.state.position_valid)
    assert invalid_s is not None
    assert invalid_s <= 1.05
    assert neutral(world) or until(world, 0.2, neutral) is not None
    assert world.snapshot.action >= Action.STOP
    texts_during(world, 20.0)
    assert neutral(world)


@pytest.mark.parametrize("fault", ["no_fix", "dead_reckoning"])
def test_row_22_lost_fix_neutral_at_once(fault: str) -> None:
    world = on_the_circle()
    faults(world).set(fault, True)
    # The first epoch that says so leaves up to 0.2 s later, and 0.15 s after it was measured.
    assert until(world, 2.0, neutral) <= 0.6


def test_a_stopped_boat_that_drifts_is_told_of_as_moving_once() -> None:
    """Wind and current carried her at 0.30 to 0.41 m/s: told, and told to be over, six times in six minutes."""
    world = on_the_circle("depth.enabled=false", "world.water.current_mps=0.3", "world.water.wind_mps=5")
    faults(world).gnss_silent = True
    texts_during(world, 5.0)
    faults(world).gnss_silent = False
    told = [text for text in texts_during(world, 350.0) if "neutral" in text]
    assert told == ["Moving with thrusters in neutral"]


def test_row_23_a_jump_is_never_steered_on() -> None:
    world = on_the_circle()
    faults(world).set("jump_east_m", 200.0)
    worst: list[float] = []
    texts = texts_during(world, 9.0, lambda here: worst.append(abs(off_circle_m(here))))
    # Two seconds on the expected position, then neutral: the vessel drifts off as slowly as it loses way.
    assert max(worst[:40]) < 0.6
    assert neutral(world)
    assert any("jumped" in text for text in texts)
    assert max(worst) < 5.0


def test_row_23_a_short_jump_is_not_even_noticed_by_the_pins() -> None:
    world = on_the_circle()
    faults(world).set("jump_north_m", 500.0)
    worst: list[float] = []
    texts_during(world, 1.0, lambda here: worst.append(abs(off_circle_m(here))))
    faults(world).set("jump_north_m", 0.0)
    texts_during(world, 20.0, lambda here: worst.append(abs(off_circle_m(here))))
    assert max(worst) < 0.6
    assert not thrusters_neutral(world)


@pytest.mark.parametrize(("fault", "value", "seconds"), [("jump_north_m", 100.0, 25.0), ("frozen", True, 14.0)])
def test_a_boat_that_lies_stopped_does_not_drift_when_the_position_leaps(
    fault: str, value: float | bool, seconds: float
) -> None:
    """The alarm came with a boat that lay still, and stayed until the next order."""
    world = on_the_circle("depth.enabled=false")
    faults(world).set(fault, value)
    texts = texts_during(world, seconds)
    assert world.snapshot.action >= Action.STOP
    faults(world).set(fault, type(value)(0))
    texts += texts_during(world, 30.0)
    assert world.snapshot.state.position_valid
    assert any("accepted" in text or "moves again" in text for text in texts)
    assert not any("Drifting" in text for text in texts)


def test_a_stopped_boat_that_a_stream_carries_is_told_of_as_drifting() -> None:
    world = on_the_circle("depth.enabled=false", "world.water.current_mps=0.5")
    faults(world).set("jump_north_m", 100.0)
    texts_during(world, 14.0)
    assert any("Drifting while stopped" in text for text in texts_during(world, 30.0))


def test_row_24_a_frozen_receiver_is_warned_of_and_then_stops_the_vessel() -> None:
    world = on_the_circle()
    faults(world).set("frozen", True)
    texts = texts_during(world, 12.0)
    assert any("repeats one position" in text for text in texts)
    assert neutral(world)


def test_row_25_damaged_lines_cost_accuracy_not_control() -> None:
    world = on_the_circle()
    faults(world).set("flip_share", 0.3)
    worst: list[float] = []
    texts = texts_during(world, 60.0, lambda here: worst.append(abs(off_circle_m(here))))
    assert max(worst) < 1.0
    assert sum("damaged" in text for text in texts) == 1


def test_row_26_and_27_a_tenfold_flood_and_missing_line_ends_change_nothing() -> None:
    world = on_the_circle()
    faults(world).set("flood", 10)
    faults(world).set("no_line_end", True)
    worst: list[float] = []
    ticks: list[int] = []
    texts_during(world, 30.0, lambda here: (worst.append(abs(off_circle_m(here))), ticks.append(here.snapshot.tick)))
    assert max(worst) < 0.6
    assert ticks == list(range(ticks[0], ticks[0] + 600))


@pytest.mark.parametrize(("lost", "limit_m"), [(("heading_silent",), 0.6), (("heading_silent", "rate_silent"), 1.5)])
def test_row_30_course_stands_in_for_a_lost_heading_above_1_mps(lost: tuple[str, ...], limit_m: float) -> None:
    """With the turn rate alive the circle is held as before; with the whole compass gone, roughly."""
    world = on_the_circle()
    for name in lost:
        faults(world).set(name, True)
    fell_back_s = until(world, 3.0, lambda here: here.snapshot.state.heading_from_course)
    assert fell_back_s <= 0.65
    worst: list[float] = []
    texts_during(world, 60.0, lambda here: worst.append(abs(off_circle_m(here))))
    assert world.snapshot.state.heading_from_course
    assert world.snapshot.action < Action.STOP
    assert max(worst) < limit_m


def ask(world: World, request: Arm | SetMode | LoadPlan | StartPlan) -> str:
    """Send a request; return why it was refused."""
    replies = []
    world.app.submit(request, replies.append)
    world.run(0.3)
    return replies[0].reason


@pytest.mark.parametrize("seed", [1, 2])
def test_row_30_a_compass_without_turn_rate_that_is_lost_in_a_stream(seed: int) -> None:
    """The noise of no way passed for a heading: it turned at 8 rad/s, the model ran away, and the vessel's process ended."""
    stream = ("world.sensors.rate_hz=0", "world.water.current_mps=1.2", "world.water.current_to_deg=90")
    overrides = ["operator.gcs_required=false", "depth.enabled=false", *stream]
    world = World(load(config.path("sim.toml"), overrides, SimSettings), seed)
    world.run(2.0)
    assert [ask(world, Arm(arm=True)), ask(world, SetMode(Mode.HOLD))] == ["", ""]
    world.run(60.0)
    faults(world).set("heading_silent", True)
    off_deg: list[float] = []

    def look(here: World) -> None:
        shown = here.snapshot.state.psi_rad
        if shown is not None:
            off_deg.append(abs(math.degrees(wrap_pi(shown - here.surroundings.truth.psi_rad))))

    texts = texts_during(world, 60.0, look)
    ask(world, SetMode(Mode.HOLD))
    texts += texts_during(world, 30.0, look)
    faults(world).set("heading_silent", False)
    texts += texts_during(world, 30.0)
    assert not [text for text in texts if "internal fault" in text]
    assert max(off_deg) < 45.0
    assert [ask(world, Arm(arm=True)), ask(world, SetMode(Mode.HOLD))] == ["", ""]
    texts_during(world, 10.0)
    assert world.snapshot.armed


def test_row_30_lost_heading_at_low_speed_is_neutral() -> None:
    world = on_the_circle()
    faults(world).set("heading_silent", True)
    texts_during(world, 1.0)
    # A current-free stop: with the way lost, there is neither course nor heading.
    faults(world).set("gnss_silent", True)
    texts_during(world, 15.0)
    faults(world).set("gnss_silent", False)
    texts_during(world, 3.0)
    assert not world.snapshot.state.heading_valid
    assert neutral(world)


def test_row_31_a_flipped_compass_is_not_followed() -> None:
    world = on_the_circle()
    faults(world).set("heading_bias_deg", 180.0)
    worst: list[float] = []
    texts = texts_during(world, 30.0, lambda here: worst.append(abs(off_circle_m(here))))
    assert any("Heading jumped" in text for text in texts)
    assert max(worst) < 2.5


def on_a_line(*overrides: str) -> World:
    """A vessel under way to the north at 1.5 m/s."""
    settings = load(config.path("sim.toml"), ["operator.gcs_required=false", *overrides], SimSettings)
    world = World(settings, 1)
    lat_rad, lon_rad = world.surroundings.plant.frame.to_geodetic(300.0, 15.0)
    x, y = round(math.degrees(lat_rad) * 1e7), round(math.degrees(lon_rad) * 1e7)
    items = [
        PlanItem(CHANGE_SPEED, 2, 1.0, 1.5, -1.0, 0.0, 0, 0, 0.0),
        PlanItem(16, 3, 0.0, 0.0, 0.0, 0.0, x, y, 0.0),
    ]
    plan = load_plan(PlanKind.MISSION, items)
    assert isinstance(plan, LoadPlan)
    world.run(2.0)
    for request in (plan, Arm(arm=True), StartPlan(0)):
        assert ask(world, request) == ""
    world.run(40.0)
    return world


@pytest.mark.parametrize("without_rate", [False, True])
@pytest.mark.parametrize("begin", [on_the_circle, on_a_line])
def test_row_65_a_compass_that_repeats_one_heading_is_named_and_not_steered_by(
    begin: Callable[..., World], without_rate: bool
) -> None:
    """It swung by 45 degrees to both sides for ever, or spun at full thrust, and thrusters, rudders and water were blamed."""
    world = begin("depth.enabled=false", *(["world.sensors.rate_hz=0"] if without_rate else []))
    turned: list[float] = []
    last = [world.surroundings.truth.psi_rad]

    def watch(here: World) -> None:
        psi_rad = here.surroundings.truth.psi_rad
        turned.append(abs(wrap_pi(psi_rad - last[0])))
        last[0] = psi_rad

    faults(world).set("heading_frozen", True)
    texts = texts_during(world, 16.0, watch)
    assert any("compass GPHDT repeats one heading" in text for text in texts)
    turned.clear()
    later = texts_during(world, 40.0, watch)
    # A circle of 20 m at 1.5 m/s is 4.3 degrees a second; a line is none.
    sailed_rad = 40.0 * 1.5 / RADIUS_M if begin is on_the_circle else 0.0
    assert math.fsum(turned) < sailed_rad + math.radians(80.0)
    assert world.snapshot.state.heading_from_course or neutral(world)
    for blamed in ("water is faster", "Suspected", "carried", "thruster", "cannot go on"):
        assert not any(blamed in text for text in [*texts, *later])
    faults(world).set("heading_frozen", False)
    assert any("no longer repeats one heading" in text for text in texts_during(world, 8.0))
    assert not world.snapshot.state.heading_from_course
    assert world.snapshot.state.heading_valid


@pytest.mark.parametrize("speed_mps", [0.0, 8.0])
def test_row_65_a_live_compass_of_whole_degrees_on_station_is_believed(
    speed_mps: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In calm and in a steady wind that thrusters and rudders hold against, with a compass that says nothing finer."""
    fine = talkers.SensorSuite._heading

    def whole(suite: talkers.SensorSuite, now_us: int, truth: Truth) -> float:
        return math.radians(round(math.degrees(fine(suite, now_us, truth))))

    monkeypatch.setattr(talkers.SensorSuite, "_heading", whole)
    world = on_a_line("world.sensors.rate_hz=0", "world.sensors.grade=ideal", f"world.water.wind_mps={speed_mps}")
    assert ask(world, SetMode(Mode.HOLD)) == ""
    texts = texts_during(world, 90.0)
    assert not any("repeats" in text for text in texts)
    assert world.snapshot.state.compass_rad is not None


SELDOM = ("world.sensors.heading_hz=1", "world.sensors.rate_hz=0", "world.sensors.fix_hz=1")
BREEZE = ("world.water.current_mps=0.3", "world.water.wind_mps=5", "world.water.wave_height_m=0.2")


@pytest.mark.parametrize(("seed", "armed_after_s"), [(1, 12.0), (2, 3.0)])
def test_a_nimble_boat_sails_by_a_compass_that_is_heard_each_second(seed: int, armed_after_s: float) -> None:
    """Her heading loop knew of the compass's delay, not of its rhythm: she swung until the compass was doubted, and was stopped.
    Its rhythm was learnt before arming only: who armed at once after the start never steered by it.
    """
    overrides = ["operator.gcs_required=false", "depth.enabled=false", 'vessel="blueboat"', *SELDOM, *BREEZE]
    world = World(load(config.path("sim.toml"), overrides, SimSettings), seed)
    texts: list[str] = []

    def run(seconds: float) -> None:
        end_us = world.now_us + round(seconds * 1e6)
        while world.now_us < end_us:
            world.step()
            texts.extend(text.text for text in world.snapshot.texts)

    run(armed_after_s)
    world.app.submit(Arm(arm=True), lambda reply: None)
    world.app.submit(SetMode(Mode.HOLD), lambda reply: None)
    run(90.0)
    truth = world.surroundings.truth
    assert math.hypot(truth.north_m, truth.east_m) < 7.0
    assert not [text for text in texts if "jumped" in text or "lost" in text]
    assert any(text.startswith("Compass is heard each 0.") and "steered more gently" in text for text in texts)


def test_row_33_a_date_1024_weeks_off_is_not_used_and_the_circle_goes_on() -> None:
    world = on_the_circle()
    faults(world).set("weeks_off", 1024)
    before_us = world.snapshot.utc_us
    worst: list[float] = []
    start_us = world.now_us
    texts = texts_during(world, 20.0, lambda here: worst.append(abs(off_circle_m(here))))
    assert any("date" in text for text in texts)
    assert max(worst) < 0.6
    assert world.snapshot.utc_us is not None
    assert abs(world.snapshot.utc_us - before_us - (world.now_us - start_us)) < 50_000


@pytest.mark.parametrize(("seed", "rms_m", "worst_m"), [(1, 0.05, 0.2), (2, 0.05, 0.2)])
def test_rtk_class_circle_in_truth(seed: int, rms_m: float, worst_m: float) -> None:
    world = on_the_circle(seed=seed)
    off: list[float] = []
    texts_during(world, 120.0, lambda here: off.append(off_circle_m(here)))
    assert math.sqrt(sum(value * value for value in off) / len(off)) < rms_m
    assert max(abs(value) for value in off) < worst_m


@pytest.mark.parametrize(
    "off_deg", [20.0, pytest.param(5.0, marks=pytest.mark.soak), pytest.param(120.0, marks=pytest.mark.soak)]
)
def test_a_second_compass_on_the_line_changes_nothing_at_sea(off_deg: float) -> None:
    """HEHDT beside the GNSS compass, as far off as it may be: the circle is sailed as before, and one text tells."""
    settings = load(config.path("sim.toml"), ["operator.gcs_required=false"], SimSettings)
    world = World(settings, 1)
    sensors = world.surroundings.plant.sensors
    step = sensors.step

    def beside(now_us: int, truth: Truth) -> list[bytes]:
        sent = step(now_us, truth)
        deg = (math.degrees(truth.psi_rad) + off_deg) % 360.0
        return [*sent, *(frame(f"HEHDT,{deg:.2f},T") for line in sent[:1] if line[3:6] == b"HDT")]

    sensors.step = beside
    sail_the_circle(world, 60.0)
    assert abs(off_circle_m(world)) < 1.0
    off_m, texts = [], []
    for _ in range(600):
        world.step()
        off_m.append(abs(off_circle_m(world)))
        texts += [text.text for text in world.app.snapshot.texts]
    assert max(off_m) < 1.0
    assert len([text for text in texts if "HEHDT" in text]) <= 1


@pytest.mark.parametrize(
    ("order", "fault", "what"),
    [
        (Arm(arm=False), "heading_silent", "heading"),
        (SetMode(Mode.MANUAL), "gnss_silent", "position"),
        *in_the_soak((SetMode(Mode.MANUAL), "heading_silent", "heading"), (Arm(arm=False), "gnss_silent", "position")),
    ],
)
def test_what_is_lost_is_not_back_because_nobody_steers_by_it(fault: str, what: str, order: Arm | SetMode) -> None:
    """ "Heading is back: order Hold to go on" was told of a compass that was silent all the time, and arming refused right after it."""
    world = on_the_circle("world.sensors.rate_hz=0")
    assert ask(world, SetMode(Mode.HOLD)) == ""
    world.run(30.0)
    faults(world).set(fault, True)
    texts = texts_during(world, 20.0)
    assert any(f"{what.capitalize()} lost" in text for text in texts)
    assert ask(world, order) == ""
    texts = texts_during(world, 30.0)
    assert not [text for text in texts if "is back" in text or text.startswith("Over: ")]
    faults(world).set(fault, False)
    assert any("is back" in text or f"Over: {what} lost" in text for text in texts_during(world, 30.0))
