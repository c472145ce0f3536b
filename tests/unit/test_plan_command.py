"""``companion plan`` on files: what it writes, prints and returns."""

from __future__ import annotations

import json
import sys

import pytest

from companion.cli import main
from mavlink_bridge.language.requests import PlanItem, PlanKind
from mavlink_bridge.mavlink.missions.plan_mapping import compile_items
from mavlink_bridge.mavlink.missions.wire import item_to_message, with_home
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from mavlink_bridge.plans.files import PlanFile, read_plan, write_plan
from sitl.scenario.file import read_scenario
from sitl.scenario.run import run_scenario

PLACE = "41.1852,-8.7060"


def plan(*words):
    return main(["plan", *map(str, words)])


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (
            ["--radius", "25", "--duration", "600"],
            "circular loiter about 41.1852000 -8.7060000, radius 25 m, cw, 600 s",
        ),
        (["--kind", "hover", "--duration", "60"], "hover loiter"),
        (["--kind", "racetrack", "--length", "80", "--bearing", "40", "--ccw"], "racetrack loiter"),
        (["--kind", "figure-eight", "--length", "80", "--radius", "15"], "figure-eight loiter"),
    ],
)
def test_a_loiter_is_made_and_checked(tmp_path, capsys, words, says):
    out = tmp_path / "made.plan"
    assert plan("make", out, PLACE, "--speed", 1.5, *words) == 0
    assert plan("check", out) == 0
    text = capsys.readouterr().out
    assert says in text
    assert "speed 1.5 m/s" in text
    assert "north up" in text


def test_a_route_is_made_checked_and_drawn(tmp_path, capsys):
    out, picture = tmp_path / "route.plan", tmp_path / "route.svg"
    assert plan("make", out, PLACE, "41.1862,-8.7050", "41.1870,-8.7080") == 0
    assert plan("check", out, "--svg", picture) == 0
    text = capsys.readouterr().out
    assert "139 m on 037" in text
    assert "406 m between the points" in text
    assert picture.read_text().startswith("<svg")


def test_check_lists_everything_that_the_vessel_would_refuse(tmp_path, capsys):
    rows = [(22, 41.1852), (16, 41.1853), (183, 41.1854)]
    lines = ["QGC WPL 110", "0\t1\t0\t16\t0\t0\t0\t0\t41.18\t-8.70\t0\t1"]
    lines += [f"{n}\t0\t3\t{command}\t0\t0\t0\t0\t{lat}\t-8.706\t0\t1" for n, (command, lat) in enumerate(rows, 1)]
    bad = tmp_path / "bad.txt"
    bad.write_text("\n".join(lines))
    assert plan("check", bad) == 1
    refused = capsys.readouterr().err
    assert "item 0 (NAV_TAKEOFF)" in refused
    assert "item 2 (DO_SET_SERVO)" in refused


def test_check_holds_a_plan_against_its_own_fence(tmp_path, capsys):
    points = [PlanItem(16, 3, 0.0, 0.0, 0.0, 0.0, 411_852_000 + n * 5_000, -87_060_000, 0.0) for n in range(3)]
    fence = PlanItem(5003, 0, 70.0, 0.0, 0.0, 0.0, 411_852_000, -87_060_000, 0.0)
    file = tmp_path / "out.plan"
    file.write_text(write_plan(PlanFile(tuple(points), (fence,))))
    assert plan("check", file) == 1
    assert capsys.readouterr().err == "REFUSED item 2 is 41 m outside the fence: it is not started\n"
    file.write_text(write_plan(PlanFile(tuple(points[:2]), (fence,))))
    assert plan("check", file) == 0


def test_plans_convert_between_formats(tmp_path):
    source = tmp_path / "loiter.plan"
    assert plan("make", source, PLACE, "--radius", 20, "--duration", 300, "--speed", 1.5) == 0
    for name in ("again.txt", "again.json", "again.plan"):
        assert plan("convert", source, tmp_path / name) == 0
        found = read_plan((tmp_path / name).read_bytes())
        loiter = compile_items(found.mission).plan.maneuvers[-1]
        assert (loiter.figure.radius_m, loiter.duration_s) == (20.0, 300.0)
    assert json.loads((tmp_path / "again.json").read_text())["speed_kn"] == pytest.approx(2.916, abs=1e-3)
    route = tmp_path / "route.plan"
    plan("make", route, PLACE, "41.19,-8.7")
    assert plan("convert", route, tmp_path / "route.json") == 2


@pytest.mark.parametrize("ardupilot", [False, True])
def test_a_plan_is_taken_out_of_a_log(tmp_path, ardupilot):
    items = tuple(PlanItem(16, 3, 0.0, 0.0, 0.0, 0.0, 411_850_000 + n, -87_060_000, 0.0) for n in range(3))
    wire = with_home(items, (0.7, -0.15)) if ardupilot else items
    vessel, station = Codec(1, 1), Codec(255, 190)
    frames = [vessel.encode(dialect.MAVLink_heartbeat_message(11, 3 if ardupilot else 0, 81, 0, 4, 3))]
    frames.append(station.encode(dialect.MAVLink_mission_count_message(1, 1, len(wire), 0)))
    order = (*range(len(wire)), 0)
    frames += [station.encode(item_to_message(wire[seq], seq, 1, 1, PlanKind.MISSION)) for seq in order]
    log = tmp_path / "run.tlog"
    log.write_bytes(b"".join(tlog.pack(1_000_000 * n, 0, raw) for n, raw in enumerate(frames)))
    assert plan("extract", log, tmp_path / "out.plan") == 0
    found = read_plan((tmp_path / "out.plan").read_bytes())
    assert [item.x for item in found.mission] == [item.x for item in items]
    assert (found.home_rad is not None) == ardupilot
    log.write_bytes(log.read_bytes()[:200])
    assert plan("extract", log, tmp_path / "none.plan") == 1


def test_a_run_gives_the_plan_that_its_own_people_loaded(tmp_path):
    run_scenario("sounder-drop-out", run_dir=tmp_path / "run")
    assert plan("extract", tmp_path / "run", tmp_path / "out.plan") == 0
    scenario = read_scenario("sounder-drop-out")
    found = read_plan((tmp_path / "out.plan").read_bytes())
    assert [item.x for item in found.mission] == [item.x for item in scenario.plans[0].items]
    assert plan("extract", tmp_path / "run", tmp_path / "none.params") == 1


@pytest.mark.parametrize(
    "words",
    [
        ["check", "no-such-file.plan"],
        ["make", "x.plan", PLACE, "--kind", "racetrack"],
        ["make", "x.plan", PLACE, "--speed", "900"],
        ["convert", __file__, "x.plan"],
    ],
)
def test_wrong_use_ends_with_status_2_and_a_reason(tmp_path, monkeypatch, capsys, words):
    monkeypatch.chdir(tmp_path)
    assert plan(*words) == 2
    assert len(capsys.readouterr().err) > 20
    assert not (tmp_path / "x.plan").exists()


def test_a_bad_position_is_wrong_usage(capsys):
    with pytest.raises(SystemExit) as ended:
        plan("make", "x.plan", "95.0,0.0")
    assert ended.value.code == 2
    assert "outside" in capsys.readouterr().err


def test_without_mavsdk_the_install_line_is_told(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "mavsdk", None)
    assert plan("pause") == 2
    assert "pip install" in capsys.readouterr().err


def test_commands_on_files_do_not_load_mavsdk(tmp_path):
    before = set(sys.modules)
    assert plan("make", tmp_path / "a.plan", PLACE) == 0
    assert not any(name.startswith("mavsdk") for name in set(sys.modules) - before)


@pytest.mark.parametrize("point", ["-41.5,8.7", "-0.5,-8.7", "-.5,8.7"])
def test_a_place_south_of_the_equator_is_a_place(point, tmp_path, capsys):
    out = tmp_path / "south.plan"
    assert main(["plan", "make", str(out), point, "--radius", "30", "--speed", "1.5"]) == 0
    assert read_plan(out.read_bytes()).mission[-1].x == round(float(point.partition(",")[0]) * 1e7)
    assert main(["plan", "make", "--speed", "1", str(out), "41.2,8.7", point, "-41.6,-8.7", "--far"]) == 0
    assert len(read_plan(out.read_bytes()).mission) >= 3


def test_a_loiters_options_are_refused_for_a_route(tmp_path, capsys):
    words = ["plan", "make", str(tmp_path / "r.plan"), "41.5,-8.7", "41.6,-8.7"]
    assert main([*words, "--kind", "racetrack", "--radius", "5", "--ccw"]) == 2
    told = capsys.readouterr().err
    assert all(
        f"{name}: is for a loiter; leave it out, or give one point" in told for name in ("--kind", "--radius", "--ccw")
    )
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "said"), [([PLACE, "--radius", "20"], "needs a speed"), ([PLACE, "41.19,-8.7"], "no loiter")]
)
def test_a_plan_that_the_seeds_json_cannot_hold_is_told_and_not_written(tmp_path, capsys, words, said):
    """``plan make`` ended with a traceback; ``plan convert`` told it."""
    out = tmp_path / "r.json"
    assert plan("make", out, *words) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"{out}: 1 mistake")
    assert said in told
    assert "end it in .plan" in told
    assert not out.exists()


def test_a_conversion_tells_what_the_new_file_holds(tmp_path, capsys):
    """ "fence 3, rally 0" was told of a .txt without them; of a fence alone it made a plan of nothing."""
    fence = tuple(PlanItem(5001, 3, 3.0, 0.0, 0.0, 0.0, 411_850_000 + n, -87_060_000 + n * n, 0.0) for n in range(3))
    mission = (PlanItem(16, 3, 0.0, 0.0, 0.0, 0.0, 411_850_000, -87_060_000, 0.0),)
    both, alone, out = tmp_path / "both.plan", tmp_path / "alone.plan", tmp_path / "out.txt"
    both.write_text(write_plan(PlanFile(mission, fence)))
    alone.write_text(write_plan(PlanFile((), fence)))
    assert plan("convert", both, out) == 0
    told = capsys.readouterr()
    assert told.out == f"{out}: 1 items, fence 0, rally 0\n"
    assert "fence and rally points are left out" in told.err
    out.unlink()
    assert plan("convert", alone, out) == 2
    assert "a plan without a mission" in capsys.readouterr().err
    assert not out.exists()
    assert plan("convert", alone, tmp_path / "out.plan") == 0
    assert "0 items, fence 3, rally 0" in capsys.readouterr().out


def test_an_ending_that_says_no_format_is_refused_before_anything_is_done(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["plan", "make", "good.plan", "41.5,-8.7"]) == 0
    for words in (
        ["make", "x.foo", "41.5,-8.7"],
        ["convert", "good.plan", "x.foo"],
        ["extract", "good.plan", "x.foo"],
        ["download", "x.foo"],
    ):
        assert main(["plan", *words]) == 2
        assert "x.foo: 1 mistake(s)\n  .foo: no plan format; end it in .plan" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["good.plan"]


def test_a_plan_is_read_before_the_vessel_is_looked_for(tmp_path, capsys):
    assert main(["plan", "upload", str(tmp_path / "none.plan"), "--wait", "5"]) == 2
    said = capsys.readouterr().err
    assert "No such file" in said
    assert len(said.splitlines()) == 2, "nothing is said of a vessel"


def test_an_absent_port_is_told_while_it_is_waited_for(tmp_path, capsys):
    seed = tmp_path / "seed.json"
    seed.write_text(
        '{"ID":"loiter-1","Latitude":41.1852,"Longitude":-8.706,"Duration":600,"Loiter type":"Circular","Speed":3.0,"Length":0,"Radius":20}'
    )
    assert main(["plan", "send-json", str(seed), str(tmp_path / "tty"), "--wait", "2"]) == 1
    told = capsys.readouterr().err.splitlines()
    assert told == [
        f"{tmp_path}/tty 9600 8N1 (waiting: No such file or directory); tried again for 2 s",
        "the port never took the plan",
    ]


def test_a_module_that_is_not_there_is_told_once(tmp_path, capsys):
    assert main(["lora", "show", str(tmp_path / "tty")]) == 1
    assert capsys.readouterr().err == f"companion lora: {tmp_path}/tty: No such file or directory\n"


@pytest.mark.parametrize("points", [["41,18", "-8,7"], ["41,18"], ["41,1854,-8,7060"], ["41,-8"]])
def test_a_decimal_comma_is_not_taken_for_a_place(tmp_path, capsys, points):
    out = tmp_path / "r.plan"
    with pytest.raises(SystemExit) as ended:
        plan("make", out, *points)
    assert ended.value.code == 2
    assert "41.18,-8.70" in capsys.readouterr().err
    assert not out.exists()


def test_a_leg_that_cannot_be_meant_is_written_only_with_the_word(tmp_path, capsys):
    out = tmp_path / "r.plan"
    assert plan("make", out, "41.18,-8.70", "4.118,-8.70") == 2
    said = capsys.readouterr().err
    assert "4105 km" in said
    assert "limit 5000 m (MIS_DIST_WPS)" in said
    assert "--far" in said
    assert not out.exists()
    assert plan("make", out, "41.18,-8.70", "4.118,-8.70", "--far") == 0
    assert plan("check", out) == 0
    assert "leg to item 1 is 4105 km" in capsys.readouterr().err
