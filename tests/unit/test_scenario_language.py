"""The scenario language: every mistake at once, each act does what it says, each expectation can fail."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from companion.cli import main
from companion.settings.schema import ConfigError
from sitl.scenario.expect import QUANTITIES, Expect, Spot
from sitl.scenario.file import ACTS, Act, library, read_scenario
from sitl.scenario.run import run, run_scenario

HEAD = '[scenario]\ntitle = "A test"\nduration_s = {duration}\n'
STILL = "[[expect]]\nstays_neutral = true\n"
LEG = "[[plan.item]]\nspeed_mps = 1.5\n[[plan.item]]\ngoto = { north_m = 100.0, east_m = 0.0 }\n"


@pytest.fixture
def written(tmp_path):
    """Write a scenario and return its path."""

    def write(body, duration=10, head=HEAD):
        path = tmp_path / "test.toml"
        path.write_text(head.format(duration=duration) + body)
        return path

    return write


def mistakes(path):
    with pytest.raises(ConfigError) as caught:
        read_scenario(path)
    return caught.value.mistakes


# ---- mistakes


def test_all_mistakes_at_once(written):
    found = mistakes(
        written(
            """
[settings]
"world.water.wind_mps" = "much"
depth.min_altitude_m = -5
speeed = 1
[[at]]
t_s = 1
sensor = { gnss_silnt = true }
[[at]]
t_s = 2
arm = true
disarm = true
[[at]]
t_s = 3
mode = "Fly"
[[expect]]
final_mode = "Hald"
[[expect]]
radius_eror = 1
"""
        )
    )
    for part in (
        "settings.world.water.wind_mps = 'much'",
        "settings.depth.min_altitude_m",
        "settings.speeed: no such key",
        "no sensor fault 'gnss_silnt'",
        "exactly one act, not arm, disarm",
        "choose one of manual, hold",
        "choose one of Manual, Hold",
        "expect.1.radius_eror: no such key",
    ):
        assert any(part in mistake for mistake in found), (part, found)


@pytest.mark.parametrize(
    ("body", "part"),
    [
        ("", "expect: missing"),
        (STILL + "[[at]]\nt_s = 11\narm = true\n", "after the end at 10 s: at t_s = 11"),
        (STILL + "from_s = 12\n", "after the end at 10 s: expect 12 s"),
        (STILL + "within_s = 2\n", "within_s is for"),
        (STILL + "[[at]]\nt_s = 1\n", "exactly one act, not none"),
        (STILL + '[[at]]\nt_s = 1\nboard = "reset"\nrefused = "no"\n', "nobody can refuse 'board'"),
        (STILL + '[[at]]\nt_s = 1\nunplug = "cable"\n', "no link 'cable'; there are compass, gcs"),
        (STILL + "[[at]]\nt_s = 1\nwater = { wind = 3.0 }\n", "wind: no such key"),
        (STILL + "[[at]]\nt_s = 1\nradio = { loss = 2.0 }\n", "loss = 2.0"),
        (STILL + "[[at]]\nt_s = 1\ngoto = { north_m = 3.0 }\n", "north_m and east_m, or lat_deg and lon_deg"),
        (STILL + "[[plan.item]]\n", "exactly one of speed_mps, goto"),
        (STILL + '[plan]\nfile = "nowhere.plan"\n', "plan: cannot be read"),
        (STILL + "[plan]\nfence = [{ }]\n", "give radius_m with north_m and east_m, or corners"),
        (STILL + '[settings]\nvessel = "barge"\n', "settings.vessel = 'barge': no such file"),
        (STILL + "[[at]\n", "not valid TOML"),
    ],
)
def test_a_mistake_is_named_with_its_mend(written, body, part):
    found = mistakes(written(body))
    assert any(part in mistake for mistake in found), found


def test_a_bad_file_is_status_2_and_options_that_clash_are_named(written, capsys):
    assert main(["sim", "--scenario", str(written("[[at]]\nt_s = 1\n"))]) == 2
    assert main(["sim", "--scenario", "no-such-scenario"]) == 2
    assert main(["sim", "--scenario", str(written(STILL)), "--duration", "3", "--start"]) == 2
    said = capsys.readouterr().err
    assert "shipped: actuator-cable-pulled" in said
    assert "--duration: the scenario says it" in said
    assert "--start: the scenario says it" in said


# ---- acts


def test_orders_are_judged(written):
    outcome = run_scenario(
        written(
            """
[[at]]
t_s = 2
mode = "Auto"
[[at]]
t_s = 3
mode = "Auto"
refused = "no mission"
[[at]]
t_s = 4
arm = true
refused = "never"
"""
            + STILL,
            duration=6,
        )
    )
    found = {finding.what: finding for finding in outcome.findings}
    assert not outcome.passed
    assert str(found["mode at 2 s"].found).startswith("refused: ")
    assert found["arm at 4 s"].found == "accepted"


BOTH = """
[plan]
start = false
[[plan.item]]
goto = { north_m = 100.0, east_m = 0.0 }
[[at]]
t_s = 2
arm = true
"""


@pytest.mark.parametrize(
    ("acts", "expect"),
    [
        ("[[at]]\nt_s = 3\nstart = true\n", 'final_mode = "Auto"'),
        ("[[at]]\nt_s = 3\nstart = true\n[[at]]\nt_s = 6\npause = true\n", 'plan_state = "PAUSED"'),
        ("[[at]]\nt_s = 3\ngoto = { north_m = 30.0, east_m = 0.0, speed_mps = 2.0 }\n", 'final_mode = "Guided"'),
        (
            "[[at]]\nt_s = 3\norbit = { north_m = 30.0, east_m = 0.0, radius_m = 15.0 }\n",
            "under_way = true\nfrom_s = 5",
        ),
        ("[[at]]\nt_s = 3\ndisarm = true\n", "final_armed = false"),
        ("[[at]]\nt_s = 3\nstart = true\n[[at]]\nt_s = 7\nabort = true\n", "neutral_within_s = 0.2\nfrom_s = 7"),
        ("[[at]]\nt_s = 3\nstart = true\n[[at]]\nt_s = 4\nparam = { DEPTH_MIN = 30.0 }\n", 'final_guard = "LOCKED"'),
        (
            '[[at]]\nt_s = 3\nmode = "Manual"\n[[at]]\nt_s = 3.5\nsticks = { surge = 0.5, for_s = 6.0 }\n',
            "speed_mps_min = 0.5",
        ),
        ('[[at]]\nt_s = 3\nstart = true\n[[at]]\nt_s = 7\nboard = "stop"\n', "final_armed = false"),
        (
            "[[at]]\nt_s = 2.5\ndisarm = true\n[[at]]\nt_s = 3\nwater = { current_mps = 1.0, current_to_deg = 90.0 }\n",
            "distance_from_start_m_min = 4.0",
        ),
        (
            "[[at]]\nt_s = 3\nstart = true\n[[at]]\nt_s = 3\nthruster_health = [0.0, 0.0]\n",
            "distance_from_start_m_max = 0.5",
        ),
        ('[[at]]\nt_s = 3\nstation = "back"\n', "final_armed = true"),
    ],
)
def test_an_act_does_what_it_says(written, acts, expect):
    outcome = run_scenario(written(f"{BOTH}{acts}[[expect]]\n{expect}\n", duration=10))
    assert outcome.passed, (outcome.findings, outcome.texts)


def test_a_plan_that_cannot_start_is_a_finding(written):
    outcome = run_scenario(
        written("[settings]\ndepth.required = true\nworld.sensors.depth_hz = 0.0\n" + LEG + STILL, 35)
    )
    assert not outcome.passed
    assert outcome.findings[0].what == "plan starts"


# ---- expectations


def test_every_quantity_can_fail(written):
    """A judge that always agrees would be found here: each limit is one that a vessel at rest, or on a leg, cannot hold."""
    impossible = {
        "cross_track_rms_m_max": -1.0,
        "lowest_altitude_m_min": 50.0,
        "distance_from_start_m_max": 0.5,
        "distance_from_start_m_min": 900.0,
        "distance_sailed_m_min": 900.0,
        "stays_out_of": Spot(north_m=0.0, east_m=0.0, m=1.0),
        "stays_within": Spot(north_m=0.0, east_m=0.0, m=1.0),
        "comes_to": Spot(north_m=500.0, east_m=0.0, m=1.0),
        "ends_within": Spot(north_m=500.0, east_m=0.0, m=1.0),
        "speed_mps_max": 0.1,
        "speed_mps_min": 9.0,
        "final_speed_mps_max": 0.1,
        "clearance_m_min": 900.0,
        "role": "overtaken",
        "danger": "close",
        "no_danger": True,
        "neutral_within_s": 0.1,
        "final_mode": "Return",
        "final_armed": False,
        "final_guard": "LOCKED",
        "final_pulses": {"thruster_port": 1000.0},
        "guard": "LOCKED",
        "never_guard": "OK",
        "mode": "Return",
        "plan_state": "COMPLETE",
        "item_reached": 7,
        "text": "nobody says this",
        "no_text": "armed",
        "cause": "battery_low",
        "action": "TERMINATE",
        "action_max": "NONE",
        "no_failsafe": True,
        "stays_neutral": True,
        "under_way": True,
    }
    impossible |= {name: -1.0 for name in QUANTITIES if name.endswith("m_max") and name not in impossible}
    impossible["turns_min"] = 1.0
    assert set(impossible) == set(QUANTITIES)
    # bows on, 300 m off: the risk is told, and nothing is close yet
    near = '[[vessel]]\nais = "A"\nnorth_m = 400.0\neast_m = 5.0\ncourse_deg = 180.0\nspeed_mps = 4.0\n'
    path = written(LEG + near + '[[at]]\nt_s = 9\nboard = "stop"\n' + STILL, duration=12)
    windows = {"under_way": (10.0, 12.0), "neutral_within_s": (2.0, 8.0), "final_speed_mps_max": (None, 8.0)}
    windows["final_armed"] = (None, 8.0)
    scenario = read_scenario(path)
    expects = tuple(
        Expect(**{name: limit, "from_s": windows.get(name, (None,))[0], "to_s": windows.get(name, (None, None))[1]})
        for name, limit in impossible.items()
    )
    outcome = run(replace(scenario, text=scenario.text.model_copy(update={"expect": expects})))
    held = [finding for finding in outcome.findings if finding.passed]
    assert not held


def test_the_manual_names_every_act_and_every_quantity():
    text = (Path(__file__).resolve().parents[2] / "docs" / "SCENARIOS.md").read_text()
    assert not [name for name in (*ACTS, *QUANTITIES) if f"`{name}`" not in text]


def test_every_shipped_scenario_says_what_it_shows():
    for path in library():
        about = read_scenario(path).text.scenario
        assert about.title
        assert about.shows, path.stem


def test_acts_are_one_at_a_time():
    assert Act(t_s=1, arm=True).name == "arm"
    assert "refused" not in ACTS


# ---- nothing is ignored


def test_a_store_is_refused(written):
    assert any("settings.store" in mistake for mistake in mistakes(written(f'[settings]\nstore = "a.db"\n{STILL}')))


@pytest.mark.parametrize("shape", ["slope = { gradient = 0.1 }", "mounds = [{ north_m = 9.0, height_m = 1.0 }]"])
def test_a_flat_bottom_has_no_shapes(written, shape):
    (mistake,) = mistakes(written(f'[settings.world.bottom]\nkind = "flat"\n{shape}\n{STILL}'))
    assert "kind = 'flat' has no" in mistake


def test_the_path_error_of_a_hover_is_its_distance(written):
    plan = '[[plan.item]]\nloiter = { kind = "hover", north_m = 12.0, east_m = 0.0, duration_s = 60.0 }\n'
    body = f"{plan}[[at]]\nt_s = 4\nstart = true\n[[expect]]\nfrom_s = 30.0\npath_error_max_m_max = 1.0\n"
    outcome = run(read_scenario(written(body, duration=60)))
    assert outcome.passed, outcome.findings
    (found,) = (finding for finding in outcome.findings if finding.what.startswith("path_error"))
    assert 0.0 < float(found.found) < 1.0
