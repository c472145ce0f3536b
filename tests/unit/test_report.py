"""The report tells what the files tell, holds it against limits, and survives whatever was cut."""

from __future__ import annotations

import dataclasses
import errno
import math
import os
import random
import re
import shutil
import subprocess
import sys

import pytest

import config as shipped
from companion.cli import main
from companion.io.clock import EARLIEST_UTC_US
from companion.report import charts, map_plot, page, story
from companion.report.flight import Event, Flight, FlightTrack, Series, percentile, rms, thin
from companion.report.from_run import bytes_of, read_run
from companion.report.from_tlog import read_tlog
from companion.report.shapes import plan_shapes
from companion.report.verdicts import RunLimits, clock, judge, offset_m
from companion.settings.schema import load
from mavlink_bridge.language.figures import Circle, FigureEight, Hover, LoiterDirection, Racetrack
from mavlink_bridge.language.messages import Loiter
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanItem, PlanKind, StartPlan
from mavlink_bridge.mavlink.missions.plan_export import items_from_maneuvers
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from sitl.world.settings import SimSettings
from sitl.world.world import World

ITEMS = (
    PlanItem(16, 6, 0, 0, 0, 0, 411853000, -87061000, 0),
    PlanItem(18, 6, 0.2, 0, 12.0, 0, 411854500, -87057000, 0),
)


@pytest.fixture(scope="module")
def run_dir(tmp_path_factory):
    """A short mission with a plan that came over no link."""
    path = tmp_path_factory.mktemp("runs") / "mission-7"
    settings = load(shipped.path("sim.toml"), ("operator.gcs_required=false",), SimSettings)
    world = World(settings, 5, run_dir=path, about={"seed": 5, "settings": settings.model_dump(mode="json")})
    plan = load_plan(PlanKind.MISSION, ITEMS)
    assert isinstance(plan, LoadPlan)
    world.app.submit(plan)
    world.run(4.0)
    world.app.submit(Arm(True))
    world.app.submit(StartPlan())
    world.run(40.0)
    world.shutdown(world.now_us)
    return path


def test_a_run_directory_is_read(run_dir):
    flight = read_run(run_dir)
    assert flight.duration_s == pytest.approx(44.0, abs=0.1)
    assert flight.plan == ITEMS
    assert flight.tracks["truth"].t
    assert flight.tracks["estimate"].t
    assert [link.name for link in flight.links][:3] == ["gcs", "sdk", "tcp"]
    assert {span.value for span in flight.spans["armed"]} == {"armed", "disarmed"}
    assert flight.seconds_in("armed", ["armed"]) == pytest.approx(40.0, abs=0.5)
    assert flight.about["start"] == "2026-01-01 12:00:00 UTC"
    assert flight.notes == []


def test_how_far_the_reading_is_goes_to_the_end(run_dir):
    done = []
    read_run(run_dir, done.append)
    assert len(done) > 1000
    assert sum(done) == pytest.approx(bytes_of(run_dir), rel=0.02)


def test_verdicts_hold_figures_against_limits(run_dir):
    flight = read_run(run_dir)
    verdicts = {verdict.name: verdict for verdict in judge(flight, RunLimits())}
    assert verdicts["Position error of the estimate, 95 %"].ok
    assert verdicts["Longest time between ticks"].value == "0.050 s"
    assert verdicts["Position known"].ok
    assert "Depth guard" not in verdicts
    strict = {item.name: item for item in judge(flight, RunLimits(position_p95_m=1e-6))}
    assert strict["Position error of the estimate, 95 %"].ok is False


def test_a_run_without_a_position_is_not_told_as_a_good_one(tmp_path):
    overrides = ("operator.gcs_required=false", "depth.enabled=false")
    settings = load(shipped.path("sim.toml"), overrides, SimSettings)
    world = World(settings, 5, run_dir=tmp_path, about={"settings": settings.model_dump(mode="json")})
    world.surroundings.plant.sensors.faults.set("no_fix", True)
    world.run(5.0)
    world.shutdown(world.now_us)
    verdicts = {verdict.name: verdict for verdict in judge(read_run(tmp_path), RunLimits())}
    assert verdicts["Position known"].value == "0.0 % of the time"
    assert verdicts["Position known"].ok is False
    assert verdicts["Depth guard"].value == "switched off in the settings"


def needs_network(text):
    marks = ("src=", "@import", "url(http", "<link", "fetch(", "XMLHttpRequest", "WebSocket", "import(", 'href="http')
    return any(mark in text for mark in marks) or "default-src 'none'" not in text


def test_the_page_is_one_file_without_network(run_dir):
    text = page.make_page(read_run(run_dir))
    assert not needs_network(text)
    assert len(text) < 1_500_000
    for title in ("Track", "States", "Path", "Heading and speed", "Actuators", "Depth", "Links", "Events"):
        assert f"<h2>{title}</h2>" in text
    assert "mission-7" in text


def test_the_command_writes_the_report_beside_the_run(run_dir, tmp_path, capsys):
    copy = tmp_path / "run"
    shutil.copytree(run_dir, copy)
    picture = tmp_path / "map.png"
    assert main(["report", str(copy), "--picture", str(picture)]) == 0
    assert (copy / "report.html").stat().st_size > 50_000
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert "Distance sailed" in capsys.readouterr().out


def test_a_wrong_limit_or_source_says_so(tmp_path, capsys):
    assert main(["report", str(tmp_path), "--limit", "speed=1", "--limit", "gap_s=x"]) == 2
    shown = capsys.readouterr().err
    assert "no such limit" in shown
    assert "name=number" in shown
    assert main(["report", str(tmp_path)]) == 2
    assert "holds no run" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["noise.bin", "empty.tlog", "route.plan", "nowhere.tlog"])
def test_what_holds_no_frame_gives_no_report(name, tmp_path, capsys):
    noise = random.Random(5).randbytes(300_000)
    content = {"noise.bin": noise, "empty.tlog": b"", "route.plan": b'{"fileType": "Plan"}' * 100}.get(name)
    if content is not None:
        (tmp_path / name).write_bytes(content)
    before = sorted(tmp_path.iterdir())
    assert main(["report", str(tmp_path / name)]) == 2
    said = capsys.readouterr()
    assert ("No such file" if content is None else "no telemetry log") in said.err
    assert said.out == ""
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("share", [0.0, 0.3, 0.77, 0.999])
def test_a_run_that_was_cut_anywhere_is_reported(run_dir, tmp_path, share):
    for path in run_dir.iterdir():
        data = path.read_bytes()
        (tmp_path / path.name).write_bytes(data[: int(len(data) * share)])
    text = page.make_page(read_run(tmp_path))
    assert "Summary" in text
    assert "Note:" in text


@pytest.mark.parametrize(
    "missing", ["control.csv", "truth.csv", "events.jsonl", "run.json", "mavlink.tlog", "inputs.bin"]
)
def test_a_missing_file_leaves_the_rest(run_dir, tmp_path, missing):
    for path in run_dir.iterdir():
        if path.name != missing:
            shutil.copy(path, tmp_path)
    assert "Summary" in page.make_page(read_run(tmp_path))


@pytest.mark.parametrize("stood_s", [0.0, 2.0])
def test_rows_that_a_full_disk_did_not_take_are_no_ticks_that_were_not(run_dir, tmp_path, stood_s):
    """The report had called a loop late that ran on, and the files "never kept". One that stood meanwhile is still told."""
    shutil.copytree(run_dir, tmp_path, dirs_exist_ok=True)
    header, *rows = (run_dir / "control.csv").read_text().splitlines(keepends=True)
    kept = [header]
    for row in rows:
        t_s, rest = float(row.partition(",")[0]), row.partition(",")[2]
        if not 10.01 < t_s < 24.99:
            kept.append(f"{t_s + (stood_s if t_s > 20.0 else 0.0):.3f},{rest}")
    (tmp_path / "control.csv").write_text("".join(kept))
    flight = read_run(tmp_path)
    assert flight.gap_s == pytest.approx(0.05 + stood_s, abs=0.005)
    assert f"nothing in control.csv from 0:00:10 to 0:00:{25 + stood_s:.0f}" in flight.not_whole


def test_text_from_outside_is_not_markup():
    flight = Flight("<script>x</script>", "file", 10.0)
    flight.events.append(Event(1.0, "text", "<img src=x>", "ERROR"))
    text = page.make_page(flight)
    assert "<script>" not in text
    assert "<img" not in text


@pytest.mark.parametrize(
    ("t_s", "shown"), [(30.85, "0:00:30.8"), (30.45, "0:00:30.4"), (59.95, "0:00:59.9"), (0.3, "0:00:00.3")]
)
def test_events_orders_and_turning_points_stand_at_the_time_when_they_were(t_s, shown):
    flight = Flight("a run", "file", 100.0)
    flight.events += [Event(t_s, "text", "stopped", "ERROR"), Event(t_s, "order", "Hold ordered", "INFO")]
    text = page.make_page(flight)
    assert text.count(f"<td class=n>{shown}<td>") == 3
    assert f"<td class=n>{shown[:-2]}<td>stopped" in text


def foreign_log() -> bytes:
    """A few seconds of another vehicle: a PX4 boat, as its own log would show it."""
    codec = Codec(7, 1)
    station = Codec(255, 190)
    out = bytearray()
    for second in range(20):
        stamp = EARLIEST_UTC_US + second * 1_000_000
        messages = [
            dialect.MAVLink_heartbeat_message(11, 12, 0x81, 0x04040000, 4, 3),
            dialect.MAVLink_global_position_int_message(
                second * 1000, 411800000 + second * 100, -87000000, 0, 0, 0, 0, 0, 0
            ),
            dialect.MAVLink_vfr_hud_message(0.0, 1.5, 90, 50, 0.0, 0.0),
            dialect.MAVLink_water_depth_message(second * 1000, 0, 1, 0, 0, 0.0, 0, 0, 0, 5.0 + second, 20.0),
        ]
        for message in messages:
            out += tlog.pack(stamp, 0, codec.encode(message))
        out += tlog.pack(stamp, 0, station.encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)))
    return bytes(out)


def test_another_vehicles_log_gets_what_applies(tmp_path):
    path = tmp_path / "boat.tlog"
    path.write_bytes(foreign_log())
    flight = read_tlog(path)
    assert flight.about["vehicle"] == "surface boat, px4"
    assert {span.value for span in flight.spans["mode"]} == {"Auto"}
    assert flight.series["speed_mps"].v[0] == pytest.approx(1.5)
    assert flight.series["depth_m"].v[-1] == pytest.approx(24.0)
    assert len(flight.tracks["estimate"].t) == 20
    assert (flight.links[0].frames_out, flight.links[0].frames_in) == (80, 20)
    assert "Track" in page.make_page(flight)


def test_an_empty_or_foreign_file_is_a_note_not_an_error(tmp_path):
    path = tmp_path / "x.tlog"
    path.write_bytes(b"\xfd" * 500)
    flight = read_tlog(path)
    assert flight.notes
    assert "Summary" in page.make_page(flight)


def test_every_log_from_elsewhere_is_reported(shared_data, tmp_path):
    """Fault-ridden real logs: MAVLink 1 and 2, other vehicles, damaged."""
    for path in sorted((shared_data / "mavlink").glob("*.tlog")):
        flight = read_tlog(path)
        assert flight.duration_s > 10
        assert flight.series
        text = page.make_page(flight)
        assert len(text) < 5_000_000, path.name
        assert not needs_network(text)


def test_thinning_keeps_the_extremes():
    t = [number / 20 for number in range(20_000)]
    v = [math.sin(value) for value in t]
    v[12_345] = 9.0
    v[17_000] = math.nan
    thin_t, thin_v = thin(t, v, 1000)
    assert len(thin_t) <= 1100
    assert max(value for value in thin_v if not math.isnan(value)) == 9.0
    assert thin_t == sorted(thin_t)


def test_headings_break_instead_of_crossing_the_picture():
    _, v = charts.broken([0, 1, 2, 3], [350.0, 359.0, 1.0, 5.0])
    assert v[:2] == [350.0, 359.0]
    assert math.isnan(v[2])
    assert v[3:] == [1.0, 5.0]


def test_small_helpers():
    assert clock(3725.4) == "1:02:05"
    assert percentile([5.0, 1.0, 3.0], 0.5) == 3.0
    assert rms([3.0, 4.0]) == pytest.approx(math.sqrt(12.5))
    assert not Series([0.0], [math.nan])
    north, east = offset_m(41.0, -8.0, 41.001, -7.999)
    assert north == pytest.approx(111.05, abs=0.1)
    assert east == pytest.approx(84.12, abs=0.2)
    assert dataclasses.asdict(RunLimits())


def test_a_browser_shows_it(run_dir, tmp_path):
    """Headless Chromium renders the page: the picture is neither empty nor the browser's own error page."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        if os.environ.get("REQUIRE_ALL") == "1":
            pytest.fail("chromium is missing, and REQUIRE_ALL=1 makes that a failure", pytrace=False)
        pytest.skip("chromium is missing")
    report = tmp_path / "report.html"
    report.write_text(page.make_page(read_run(run_dir)), encoding="utf-8")
    dom = subprocess.run(
        [
            chromium,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            f"--user-data-dir={tmp_path}/profile",
            "--dump-dom",
            report.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    ).stdout
    assert dom.count("<svg") >= 6, "the page has drawn its charts"
    assert "Cross-track" in dom or "Radius" in dom
    shot = tmp_path / "shot.png"
    subprocess.run(
        [
            chromium,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            f"--user-data-dir={tmp_path}/profile",
            "--window-size=1100,2400",
            f"--screenshot={shot}",
            report.as_uri(),
        ],
        capture_output=True,
        timeout=60,
        check=True,
    )
    from PIL import Image

    with Image.open(shot) as image:
        colours = image.convert("RGB").getcolors(1 << 24)
    assert colours is not None
    assert len(colours) > 500


def test_airtime_of_the_radio_is_counted_against_the_band(run_dir):
    flight = read_run(run_dir)
    assert flight.airtime_limit_s == 360.0
    spent = flight.series["airtime_hour_s"].known()
    assert spent == sorted(spent)
    assert 0.1 < spent[-1] < 44.0
    verdicts = {verdict.name: verdict for verdict in judge(flight, RunLimits())}
    assert verdicts["Airtime in the fullest hour"].ok
    assert "<h2>Airtime</h2>" in page.make_page(flight)


def test_a_damaged_stamp_and_a_clock_that_is_set_do_not_stretch_the_run(tmp_path):
    path = tmp_path / "boat.tlog"
    records = list(tlog.iterate(foreign_log()))
    raw = [tlog.pack(record.t_us, 0, record.frame.raw) for record in records]
    raw[7] = b"\xff\xff\xff\xff\xff\xff\xff\xf0" + raw[7][8:]
    raw[0] = bytes(8) + raw[0][8:]
    path.write_bytes(b"".join(raw))
    assert read_tlog(path).duration_s == pytest.approx(19.0)
    year_us = 365 * 86_400_000_000
    for number, record in enumerate(records):
        raw[number] = tlog.pack(record.t_us + (year_us if number > 40 else 0), 0, record.frame.raw)
    path.write_bytes(b"".join(raw))
    flight = read_tlog(path)
    assert 17.0 <= flight.duration_s <= 19.0
    assert "Links" in page.make_page(flight)


def test_a_clock_that_is_set_back_does_not_stop_the_time_of_the_report(tmp_path):
    path = tmp_path / "boat.tlog"
    records = list(tlog.iterate(foreign_log()))
    hours_us = 2 * 3_600_000_000

    def log(is_back):
        stamps = [record.t_us - (hours_us if is_back(number) else 0) for number, record in enumerate(records)]
        path.write_bytes(b"".join(tlog.pack(t_us, 0, r.frame.raw) for t_us, r in zip(stamps, records, strict=True)))
        return read_tlog(path)

    flight = log(lambda number: number > 60)
    assert 17.0 <= flight.duration_s <= 19.0
    assert len(flight.tracks["estimate"].t) >= 18
    assert log(lambda number: False).about["start"] != flight.about["start"], "by the clock that was right in the end"
    assert log(lambda number: number == 60).duration_s == pytest.approx(19.0), "one stamp alone is damage"


@pytest.mark.parametrize("t_us", [2**64 - 4, 300_000_000_000_000_000, 1_780_000_000_000_000_000])
def test_stamps_beyond_every_calendar_are_a_note(tmp_path, t_us):
    path = tmp_path / "boat.tlog"
    raw = next(tlog.iterate(foreign_log())).frame.raw
    path.write_bytes(tlog.pack(t_us, 0, raw) * 3)
    flight = read_tlog(path)
    assert "start" not in flight.about
    assert any("stamps" in note for note in flight.notes)
    assert "Links" in page.make_page(flight)


def test_a_damaged_line_costs_only_itself(run_dir, tmp_path):
    shutil.copytree(run_dir, tmp_path / "run")
    path = tmp_path / "run" / "control.csv"
    lines = path.read_text().splitlines(keepends=True)
    lines[200] = lines[200].replace(",", ",inf,", 1)
    lines[300] = "9e99" + lines[300]
    lines[400] = lines[400].replace("41.", "4e1853.", 1)
    lines[500] = "\0" * 300_000 + "\n"
    path.write_text("".join(lines))
    flight = read_run(tmp_path / "run")
    assert flight.duration_s == pytest.approx(44.0, abs=0.1)
    assert "Summary" in page.make_page(flight)


def test_a_long_run_is_read_with_all_its_parts(run_dir, tmp_path):
    shutil.copytree(run_dir, tmp_path / "run")
    for name in ("control.csv", "truth.csv"):
        path = tmp_path / "run" / name
        lines = path.read_text().splitlines(keepends=True)
        path.write_text("".join(lines[:300]))
        path.with_name(f"{path.stem}-001.csv").write_text("".join([lines[0], *lines[300:]]))
    log = tmp_path / "run" / "mavlink.tlog"
    data = log.read_bytes()
    at = next(at for at in range(len(data) // 2, len(data)) if data[at + 8] == 0xFD and data[at : at + 2] == data[:2])
    log.write_bytes(data[:at])
    log.with_name("mavlink-001.tlog").write_bytes(data[at:])
    whole, parts = read_run(run_dir), read_run(tmp_path / "run")
    assert parts.tracks == whole.tracks
    assert parts.series == whole.series
    assert [link.frames_out for link in parts.links] == [link.frames_out for link in whole.links]


def test_the_story_tells_each_moment_in_a_line(run_dir):
    moments = story.tell(read_run(run_dir).events)
    assert any("armed" in moment.text and "plan not started → active" in moment.text for moment in moments)
    assert "What happened" in page.make_page(read_run(run_dir))


def test_the_story_keeps_what_weighs_most_in_its_order():
    events = [Event(float(second), "text", f"said {second}", "NOTICE") for second in range(100)]
    events += [Event(50.2, "text", "Position lost: STOP", "CRITICAL"), Event(50.2, "action", "NONE → STOP")]
    events.append(Event(20.0, "text", "of no weight", "INFO"))
    moments = story.tell(events)
    assert len(moments) == 100
    assert moments[50] == story.Moment(50.0, "said 50; Position lost: STOP; failsafe action none → stop", "CRITICAL")
    kept = story.weightiest(moments, 3)
    assert [moment.t_s for moment in kept] == [0.0, 1.0, 50.0]


def test_the_map_shows_where_a_failsafe_acted_and_is_not_lost_in_a_wide_fence():
    flight = Flight("x", "file", 100.0)
    for second in range(100):
        flight.tracks.setdefault("estimate", FlightTrack()).add(float(second), 41.0 + second * 1e-5, -8.0)
        flight.say("action", float(second), "NONE" if second < 50 else "STOP")
    flight.fence = (PlanItem(5003, 0, 20_000.0, 0, 0, 0, 410000000, -80000000, 0),)
    made = map_plot.draw_map(flight)
    ax = made.axes[0]
    assert "STOP, 1 min" in [text.get_text() for text in ax.texts]
    assert ax.get_ylim()[1] - ax.get_ylim()[0] < 300.0


def test_our_own_log_is_read_by_its_links(run_dir, tmp_path, capsys):
    copy = tmp_path / "run"
    shutil.copytree(run_dir, copy)
    assert main(["report", str(copy / "mavlink.tlog"), "-o", str(tmp_path / "a.html")]) == 0
    ours = capsys.readouterr().out
    assert "missing on link 1" in ours
    assert all("0.00 %" in line and line.endswith(" ok") for line in ours.splitlines() if "missing on" in line)


def test_the_map_shows_every_figure_of_a_loiter():
    """A racetrack, an eight and a circle whose direction is chosen on the water; a hover is a point."""
    frame = (1.0, 0.5)
    figures = [
        Racetrack(length_m=60.0, radius_m=10.0, bearing_rad=0.0),
        FigureEight(length_m=40.0, radius_m=10.0, bearing_rad=1.0),
        Circle(radius_m=15.0, direction=LoiterDirection.INTO_DRIFT),
        Hover(),
    ]
    items = items_from_maneuvers([Loiter(seq, *frame, figure=figure) for seq, figure in enumerate(figures)])
    shapes = plan_shapes(Flight("", "", plan=tuple(items)))
    assert len(shapes.points) == 4
    sizes_m = [
        6_371_000.0 * math.radians(max(lat for lat, _ in line) - min(lat for lat, _ in line)) for line in shapes.loiters
    ]
    assert sizes_m == pytest.approx([80.0, 20.0 + 40.0 * math.cos(1.0), 30.0], rel=0.02)


@pytest.mark.parametrize(("encoding", "shown"), [("ascii", "<= 3 deg"), ("latin-1", "<= 3 °"), ("utf-8", "≤ 3 °")])
def test_a_terminal_of_any_encoding_gets_the_summary_and_the_files_name(run_dir, tmp_path, encoding, shown):
    """The report was written, and then a traceback told of a sign instead of where it is."""
    out = tmp_path / "r.html"
    words = [
        sys.executable,
        "-m",
        "companion.cli",
        "report",
        str(run_dir),
        "-o",
        str(out),
        "--limit",
        "heading_rms_deg=3",
    ]
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    done = subprocess.run(words, capture_output=True, check=True, env=environment)
    lines = done.stdout.decode(encoding).splitlines()
    assert lines[-1] == str(out)
    assert any(line.startswith("  Heading error, RMS") and shown in line for line in lines)


def test_what_is_damaged_since_it_was_recorded_is_the_first_line_of_the_summary(run_dir, tmp_path, capsys):
    """Of a run cut to its first second "Duration 0:00:01, Failsafe actions none ok" was told, and nothing else."""
    assert main(["report", str(run_dir), "-o", str(tmp_path / "r.html")]) == 0
    assert "Recording" not in capsys.readouterr().out
    copy = shutil.copytree(run_dir, tmp_path / "copy")
    for name in ("control.csv", "events.jsonl"):
        (copy / name).write_bytes((copy / name).read_bytes()[:500])
    assert main(["report", str(copy), "-o", str(tmp_path / "r.html")]) == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert first.split()[:2] == ["Recording", "damaged:"]
    assert set(re.findall(r"[a-z]+\.[a-z]+", first)) == {"control.csv", "events.jsonl"}
    assert first.endswith("NOT OK")
    assert " ".join(first.split()[1:4]) in (tmp_path / "r.html").read_text()


def test_a_run_that_went_on_after_the_disk_was_full_says_so(tmp_path, capsys, monkeypatch):
    """Its summary gave the length of what was kept for the length of the run, and a replay said "identical"."""
    settings = load(shipped.path("sim.toml"), ("operator.gcs_required=false",), SimSettings)
    world = World(settings, 5, run_dir=tmp_path / "run", about={"settings": settings.model_dump(mode="json")})
    world.run(3.0)

    def full(fd, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("companion.io.log_file.os.write", full)
    world.run(5.0)
    world.shutdown(world.now_us)
    assert main(["report", str(tmp_path / "run")]) == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert first.split()[:4] == ["Recording", "not", "all", "kept:"]
    assert {"control.csv", "inputs.bin"} <= set(re.findall(r"[a-z]+\.[a-z]+", first))
    assert main(["replay", str(tmp_path / "run")]) == 0
    told = capsys.readouterr().out
    assert "the run may have gone on; it was not all kept: " in told
    assert "identical" in told, "as far as it goes"


@pytest.mark.parametrize("about", ["[]", "[" * 100_000, '{"crc32": [1]}', "7"])
def test_a_description_that_is_none_is_told_and_the_rest_is_shown(run_dir, tmp_path, about):
    shutil.copytree(run_dir, tmp_path / "run")
    (tmp_path / "run" / "run.json").write_text(about)
    with (tmp_path / "run" / "events.jsonl").open("a") as file:
        file.write('{"t_s": 1e400, "event": "mode", "value": "HOLD"}\n' + "\0" * 200_000 + "\n" + "[" * 50_000 + "\n")
    flight = read_run(tmp_path / "run")
    assert "run.json" in flight.not_whole
    assert "Summary" in page.make_page(flight)
