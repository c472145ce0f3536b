"""Design work with python-control: one vessel file, two integrators that agree, margins of every shipped gain set."""

import math
import random
import tomllib
import warnings
from importlib import import_module
from importlib.util import find_spec

import pytest

import config as shipped
from companion.core.steer.law import SteeringConfig
from companion.core.steer.model import ModelController
from companion.core.steer.pid import DiscretePid, PidGains
from companion.core.steer.yaw_loop import LoopJudge, yaw_plant
from companion.tuning.identify import identify, read_columns
from companion.tuning.margins import heading_margins
from companion.tuning.plants import nomoto, vessel_system
from sitl.plant.hull import SimVessel
from sitl.plant.library import load_vessel, vessel_names
from tests.conftest import require
from tools.benches.cells.foreign_hulls import any_hull

numpy = pytest.importorskip("numpy")


@pytest.fixture(autouse=True)
def _needs_control():
    require(find_spec("control") is not None, "python-control")


@pytest.fixture
def control():
    """Read here and not above: it takes seconds, also of the worker that only counts these tests."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return import_module("control")


@pytest.mark.parametrize("name", vessel_names())
def test_both_integrators_agree(control, name):
    """60 s of a manoeuvre by python-control's ODE solver and by the simulator."""
    vessel = load_vessel(name)

    def orders(t):
        port = 0.6 if t < 20 else 0.5
        return port, 0.6, 0.1 if 30 < t < 45 and vessel.rudder.count else 0.0

    times = numpy.linspace(0.0, 60.0, 2401)
    inputs = numpy.array([orders(t) for t in times]).T
    solved = control.input_output_response(
        vessel_system(vessel), times, inputs, [0.0] * 7, solve_ivp_kwargs={"rtol": 1e-6, "atol": 1e-7, "max_step": 0.1}
    )
    hull, turned = SimVessel(vessel), 0.0
    for t in numpy.arange(0.0, 60.0, 0.005):
        port, starboard, rudder = orders(t)
        hull.step(0.005, port, starboard, rudder, rudder)
        turned += hull.r_radps * 0.005
    u, v, r, psi = (solved.states[k][-1] for k in range(4))
    assert hull.u_mps == pytest.approx(u, abs=2e-3)
    assert hull.v_mps == pytest.approx(v, abs=2e-3)
    assert hull.r_radps == pytest.approx(r, abs=2e-3)
    assert turned == pytest.approx(psi, abs=math.radians(0.5))


@pytest.mark.parametrize(("speed", "gain", "lag"), [(0.5, 0.27, 0.51), (1.5, 1.06, 0.32), (2.5, 2.04, 0.26)])
def test_nomoto_of_the_default_vessel(speed, gain, lag):
    assert nomoto(load_vessel("otter"), speed) == pytest.approx((gain, lag), rel=0.05)


def gain_sets():
    sets = [(name, "model", SteeringConfig()) for name in vessel_names()]
    for file in ("boat.toml", "sim.toml"):
        steering = SteeringConfig.model_validate(
            tomllib.loads(shipped.path(file).read_text("utf-8")).get("steering", {})
        )
        if steering.seed.heading_gains is not None:
            shares = {"low_speed_thruster_share": 0.8, "high_speed_thruster_share": 0.2}
            swapped = steering.model_copy(update={"seed": steering.seed.model_copy(update=shares)})
            sets += [("otter", "seed", steering), ("otter", "seed", swapped)]
    return sets


@pytest.mark.parametrize(("vessel", "profile", "steering"), gain_sets())
def test_every_shipped_gain_set_keeps_its_margins(vessel, profile, steering):
    """8 dB and 45° at 0.15 s delay, over the speeds that the vessel can sail."""
    found = heading_margins(steering, load_vessel(vessel), profile)
    assert found
    for margins in found:
        assert margins.holds, margins


OTHER_PROPELLERS = [
    {"exponent": 1.0},
    {"exponent": 3.0, "starboard_share": 0.7},
    {"curve": ((-1.0, -1.0), (0.0, 0.0), (0.5, 0.7), (1.0, 1.0))},
]


@pytest.mark.parametrize("propellers", OTHER_PROPELLERS, ids=str)
def test_margins_are_the_laws_own_whatever_the_propellers_make_of_a_command(propellers):
    """python-control's way round the loop and the steering law's own judge: nothing of the propeller is left out in one."""
    plain = load_vessel("blueboat")
    vessel = plain.model_copy(update={"thruster": plain.thruster.model_copy(update=propellers)})
    law = ModelController(SteeringConfig(), vessel)
    for found in heading_margins(SteeringConfig(), vessel, "model", speeds=(0.5, 1.0, 1.5)):
        judged = LoopJudge(yaw_plant(vessel, found.speed_mps)).margins(*law.heading_gains(found.speed_mps))
        assert found.gain_db == pytest.approx(judged.gain_db, abs=0.5)
        assert found.phase_deg == pytest.approx(judged.phase_deg, abs=1.0)


def test_margins_are_the_laws_own_behind_a_slow_servo():
    """They knew its lag alone, and told 7 dB, below the bar, of a boat that the law sails with 17."""
    quick = any_hull("single")
    vessel = quick.model_copy(update={"rudder": quick.rudder.model_copy(update={"rate_dps": 8.0})})
    law = ModelController(SteeringConfig(), vessel)
    for found in heading_margins(SteeringConfig(), vessel, "model", speeds=(0.5, 1.5)):
        judged = LoopJudge(yaw_plant(vessel, found.speed_mps)).margins(*law.heading_gains(found.speed_mps))
        assert found.gain_db == pytest.approx(judged.gain_db, abs=0.5)
        assert found.phase_deg == pytest.approx(judged.phase_deg, abs=1.0)
        assert found.holds


def test_gains_tuned_on_error_only_are_caught():
    """The study's trap: Kp 6.55, Kd 0.8 looks well in simulation and has next to no margin."""
    from companion.core.steer.law import SeedConfig

    trap = SteeringConfig(seed=SeedConfig(heading_gains=PidGains(kp=6.55, kd=0.8), speed_gains=PidGains(kp=0.6)))
    assert any(not margins.holds for margins in heading_margins(trap, load_vessel("otter"), "seed"))


def test_discrete_pid_against_c2d(control):
    """Our PI against the Tustin transfer function of kp + ki/s, to within the half step by which they differ."""
    gains, dt = PidGains(kp=1.5, ki=0.4), 0.05
    errors = [math.sin(0.3 * k * dt) for k in range(400)]
    law = control.c2d(gains.kp + gains.ki / control.tf("s"), dt, "tustin")
    expected = control.forced_response(law, numpy.arange(400) * dt, numpy.array(errors)).outputs
    pid = DiscretePid(gains)
    got = [pid.step(dt, error).output for error in errors]
    # ours uses the integral before this step's share: half a step behind the trapezium
    assert max(abs(a - b) for a, b in zip(got, expected, strict=True)) < gains.ki * dt


def test_identification_of_a_simulated_zigzag():
    vessel, speed = load_vessel("otter"), 1.5
    hull = SimVessel(vessel)
    hull.place(surge_mps=speed)
    times, inputs, rates = [], [], []
    order = math.radians(4.0)
    for k in range(6000):
        if hull.psi_rad > math.radians(5.0):
            order = -math.radians(4.0)
        elif hull.psi_rad < -math.radians(5.0):
            order = math.radians(4.0)
        hull.step(0.01, 0.562, 0.562, order, order)
        times.append(k * 0.01)
        inputs.append(hull.rudder_rad[0])
        rates.append(hull.r_radps)
    found = identify(times, inputs, rates)
    gain, lag = nomoto(vessel, speed)
    assert found.gain == pytest.approx(gain, rel=0.2)
    assert found.lag_s == pytest.approx(lag, rel=0.35)
    assert found.fit > 0.9


def test_identification_of_measured_zigzags(shared_data):
    """The 3 m ship model: turning gain and lag of a plausible size, and more than half of the motion explained."""
    files = sorted((shared_data / "trajectories" / "esso_osaka_model").glob("zigzag_*.csv"))
    assert files
    for file in files:
        record = read_columns(file)
        found = identify(record.times_s, record.inputs, record.rates)
        assert 0.05 < found.gain < 0.5
        assert 3.0 < found.lag_s < 40.0
        assert found.fit > 0.5


def test_a_record_without_manoeuvre_is_refused():
    with pytest.raises(ValueError, match="no manoeuvre"):
        identify([k * 0.1 for k in range(100)], [0.0] * 100, [0.0] * 100)


def test_the_command_checks_and_writes(tmp_path, capsys):
    from companion.cli import main

    assert main(["tune", "margins", "--vessel", "plant_b"]) == 0
    assert "bars 8 dB, 45 deg" in capsys.readouterr().out
    assert main(["tune", "margins", "--delay", "0.6"]) == 1
    assert main(["tune", "nomoto"]) == 0
    written = tmp_path / "gains.toml"
    assert main(["tune", "gains", "-o", str(written)]) == 0
    steering = SteeringConfig.model_validate(tomllib.loads(written.read_text("utf-8"))["steering"])
    assert all(margins.holds for margins in heading_margins(steering, load_vessel("otter"), "seed"))


def test_a_run_directory_is_its_truth_or_a_real_vessels_control(tmp_path):
    (tmp_path / "control.csv").write_text("t_s,rudder_port_deg,yaw_rate_dps\n1.0,10.0,2.0\n")
    assert read_columns(tmp_path).times_s == [1.0]
    (tmp_path / "truth.csv").write_text("t_s,rudder_port_deg,yaw_rate_dps\n2.0,10.0,2.0\n")
    assert read_columns(tmp_path).times_s == [2.0]


def sailed_zigzag(name, path, delay_ticks=0):
    """A zig-zag by the operator's sticks; what steers is recorded as it was commanded, or some ticks later."""
    vessel = load_vessel(name)
    hull, draw, heading, order = SimVessel(vessel), random.Random(2), 0.0, 1.0
    rows = ["t_s,thruster_port,thruster_starboard,rudder_port_deg,yaw_rate_dps"]
    hull.place(surge_mps=1.2)
    said = []
    for k in range(2400):
        order = -1.0 if heading > 0.25 else 1.0 if heading < -0.25 else order
        rudder = 0.1 * order if vessel.rudder.count else 0.0
        half = 0.0 if vessel.rudder.count else 0.1 * order
        for _ in range(5):
            hull.step(0.01, 0.5 + half, 0.5 - half, rudder, rudder)
            heading += 0.01 * hull.r_radps
        said.append((0.5 + half, 0.5 - half, math.degrees(rudder)))
        port, starboard, angle = said[max(0, k - delay_ticks)]
        rate = math.degrees(hull.r_radps) + draw.gauss(0.0, 0.3)
        rows.append(f"{k * 0.05:.2f},{port},{starboard},{angle},{rate:.4f}")
    path.write_text("\n".join(rows) + "\n")


@pytest.mark.parametrize("name", ["blueboat", "wamv"])
def test_a_boat_without_rudders_is_identified_by_its_thrusters(name, tmp_path, capsys):
    from companion.cli import main

    sailed_zigzag(name, tmp_path / "control.csv")
    assert main(["tune", "identify", str(tmp_path)]) == 0
    assert "of thrust's difference" in capsys.readouterr().out


def test_one_run_tells_one_lag_from_commands_and_from_what_followed_them(tmp_path):
    lags = []
    for delay_ticks in (0, 2):  # the servo follows within 0.1 s
        sailed_zigzag("otter", tmp_path / "truth.csv", delay_ticks)
        record = read_columns(tmp_path)
        lags.append(identify(record.times_s, record.inputs, record.rates).lag_s)
    assert lags[1] == pytest.approx(lags[0], rel=0.3)
    assert 0.15 < lags[0] < 0.8


def zigzag(path, noise=0.0):
    """A record of a first-order hull, its rate with noise."""
    draw, rate, rows = random.Random(1), 0.0, ["t_s,rudder_port_deg,yaw_rate_dps"]
    for k in range(1200):
        order = 10.0 if k // 100 % 2 else -10.0
        rate += 0.1 * (0.5 * order - rate) / 2.0
        rows.append(f"{k * 0.1:.1f},{order},{rate + draw.gauss(0.0, noise):.4f}")
    path.write_text("\n".join(rows) + "\n")


def test_a_record_that_tells_nothing_of_the_hull_is_no_success(tmp_path, capsys):
    from companion.cli import main

    record = tmp_path / "record.csv"
    zigzag(record)
    assert main(["tune", "identify", str(record)]) == 0
    assert "T = 1.8" in capsys.readouterr().out
    zigzag(record, noise=8.0)
    assert main(["tune", "identify", str(record)]) == 1
    said = capsys.readouterr()
    assert "fit " in said.out
    assert "no usable manoeuvre; sail a zig-zag" in said.err
    record.write_text("t_s,rudder_port_deg,yaw_rate_dps\n")
    assert main(["tune", "identify", str(record)]) == 2
    assert "holds no row with t_s, rudder_port_deg, yaw_rate_dps" in capsys.readouterr().err


def test_figures_show_the_loop_with_its_delay_around_its_poles(control, tmp_path, caplog):
    from companion.cli import main
    from companion.tuning.figures import delayed, view_radps
    from companion.tuning.margins import loop_margins, model_loop

    loop = model_loop(SteeringConfig(), load_vessel("otter"), 1.5)
    late = delayed(loop, 0.15)
    gain, phase_deg, *_ = control.margin(late)
    expected = loop_margins(loop, 1.5, 0.15)
    assert 20.0 * math.log10(gain) == pytest.approx(expected.gain_db, abs=0.2)
    assert phase_deg == pytest.approx(expected.phase_deg, abs=1.0)
    assert view_radps(control.feedback(late, 1).poles()) < 20.0
    for delay in ("0.15", "0.5"):
        assert main(["tune", "figures", "-o", str(tmp_path / delay), "--delay", delay]) == 0
    names = ["bode.png", "rootlocus.png", "sisotool.png"]
    assert sorted(file.name for file in (tmp_path / "0.15").iterdir()) == names
    for name in names:
        assert (tmp_path / "0.15" / name).read_bytes() != (tmp_path / "0.5" / name).read_bytes()
    assert not caplog.records
