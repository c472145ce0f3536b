"""The terminal status: plain lines into a pipe, a table on a terminal, never in the way."""

from __future__ import annotations

import dataclasses
import io
import logging
import math
import re
import time

import pytest

import config as shipped
from companion.cli import main
from companion.commands.status import LinkNotes, StatusView, Watched, airtime_of, line as line_of, panel
from companion.io.clock import ManualClock
from companion.settings.schema import load
from companion.status import picture_of
from companion.status.words import doing
from mavlink_bridge.language.messages import (
    Action,
    ActuatorOutput,
    EstimatedState,
    FixType,
    GuardState,
    LogText,
    Mode,
    PathControlState,
    PlanState,
    Severity,
)
from mavlink_bridge.language.snapshot import Health, LinkHealth, Progress, Snapshot
from sitl.world.settings import SimSettings
from sitl.world.world import World


def snapshot(t_us=0, **changes):
    state = EstimatedState(
        t_us,
        lat_rad=math.radians(41.185),
        lon_rad=math.radians(-8.7062),
        x_m=0.0,
        y_m=0.0,
        psi_rad=math.radians(90),
        sog_mps=1.5,
        alt_m=7.25,
        fix_type=FixType.RTK_FIXED,
    )
    made = Snapshot(
        t_us,
        t_us // 50_000,
        state,
        Mode.AUTO,
        True,
        ActuatorOutput(t_us, 0.5, 0.5, 0.1, 0.1, "demand"),
        path=PathControlState(cross_track_m=-0.31, distance_m=42.0),
        progress=Progress(PlanState.ACTIVE, 2, 5),
        guard=GuardState.OK,
        links=(LinkHealth("gcs", "endpoint", True, 1, 1234, 56_000, text="udp://127.0.0.1:14550"),),
    )
    return dataclasses.replace(made, **changes)


def line(shown):
    return line_of(picture_of(shown))


def rows(shown, airtime=""):
    return [tuple(each) for each in panel(picture_of(shown, (), airtime), 200, 40)]


@pytest.mark.parametrize(
    ("mode", "far", "there"),
    [
        (
            Mode.AUTO,
            "Sails the plan, item 2 (last: 4): goes to its circle, 155 m to go",
            "item 2 (last: 4): circles at 20 m",
        ),
        (Mode.CIRCLE, "Goes to its circle, 155 m to go", "Circles at 20 m"),
    ],
)
def test_who_has_not_reached_a_circle_does_not_sail_it(mode, far, there):
    path = PathControlState(cross_track_m=-154.7, distance_m=154.7, orbit_radius_m=-20.0)
    assert doing(snapshot(mode=mode, path=path)) == far
    assert doing(snapshot(mode=mode, path=dataclasses.replace(path, distance_m=0.3, on_path=True))).endswith(there)


def test_plain_lines_come_every_five_seconds_and_texts_at_once():
    out = io.StringIO()
    view = StatusView(out)
    assert view.plain
    for tick in range(300):
        texts = (LogText(1, tick * 50_000, Severity.WARNING, "depth 3.9 m"),) if tick == 30 else ()
        view.update(snapshot(tick * 50_000, texts=texts))
    view.close()
    lines = out.getvalue().splitlines()
    assert [text[:7] for text in lines] == ["0:00:00", "0:00:01", "0:00:05", "0:00:10"]
    assert "depth 3.9 m" in lines[1]
    assert "41.185000°" in lines[0]
    assert "item 2 (last: 4)" in lines[0]


def test_a_line_and_the_rows_say_what_is_unknown():
    bare = snapshot(0, state=EstimatedState(0), armed=False, action=Action.STOP, causes=("gps_lost",), links=())
    assert "no position" in line(bare)
    assert "STOP: gps_lost" in line(bare)
    shown = {label: text for label, text, _ in rows(bare)}
    assert shown["Failsafe"] == "gps_lost"
    assert "–" in shown["Motion"]


def test_rows_name_mode_target_errors_depth_links_and_airtime():
    shown = {label: text for label, text, _ in rows(snapshot(), "12.3 of 360 s this hour")}
    assert shown["0:00:00"] == "Auto, armed"
    assert "42 m to go" in shown["Plan"]
    assert "-0.31 m" in shown["Errors"]
    assert "7.2 m under the keel" in shown["Depth"]
    assert "udp://127.0.0.1:14550" in shown["gcs"]
    assert shown["Airtime"] == "12.3 of 360 s this hour"


@pytest.mark.parametrize(
    ("stop_m", "said"),
    [(4.0, "limit 4.0 m, guard"), (4.93, "limit 4.0 m (stopped at 4.9 m now), guard"), (None, "limit 4.0 m, guard")],
)
def test_the_depth_limit_is_the_one_that_the_texts_name_and_what_stops_her_now_is_told_beside_it(stop_m, said):
    """While the bottom closed "limit 4.9 m" stood beside texts of 4.00 m, once with 4.8 m under the keel and the guard's OK."""
    found = snapshot(altitude_least_m=4.0, altitude_limit_m=stop_m)
    shown = {label: text for label, text, _ in rows(found)}
    assert said in shown["Depth"]


def test_a_terminal_gets_a_live_table():
    out = io.StringIO()
    view = StatusView(out, plain=False)
    for tick in range(20):
        view.update(snapshot(tick * 50_000, texts=(LogText(1, 0, Severity.ERROR, "no fix"),) if tick == 1 else ()))
    view.close()
    view.close()
    assert "Auto, armed" in out.getvalue()
    assert "no fix" in out.getvalue()


def test_a_reader_that_went_away_is_no_fault():
    tried = []

    class Gone(io.StringIO):
        def write(self, text):
            tried.append(text)
            raise BrokenPipeError

    view = StatusView(Gone())
    for tick in range(300):
        view.update(snapshot(tick * 50_000))
    assert tried, "it wrote, and the loop went on"


def test_a_watched_app_shows_its_ticks_and_hides_nothing():
    class App:
        links = ()
        stop_wanted = True
        done = False

        def pump(self, now_us):
            self.done = True

        def tick(self, now_us, *, late_s=0.0, load=0.0):
            return snapshot(now_us)

        def shutdown(self, now_us):
            self.pump(now_us)

    out, app = io.StringIO(), App()
    watched = Watched(app, StatusView(out))
    assert isinstance(watched.tick(0), Snapshot)
    watched.shutdown(0)
    assert app.done
    assert watched.stop_wanted
    assert "item 2 (last: 4)" in out.getvalue()


@pytest.mark.parametrize("protocol", ["mavlink", "compact", "json"])
def test_the_airtime_of_every_kind_of_radio_is_shown(protocol, tmp_path):
    key = tmp_path / "radio.key"
    assert main(["keys", "make", str(key)]) == 0
    wanted = (f"radio.protocol={protocol}", f"radio.key_file={key}", "radio.profile=o-10")
    world = World(load(shipped.path("sim.toml"), wanted, SimSettings), 1)
    world.run(20.0)
    told = airtime_of(world.app.grounds)(world.now_us)
    assert re.fullmatch(r"\d+\.\d of 360 s in this hour", told)
    assert airtime_of([])(0) == ""


def test_a_station_whose_name_nobody_knows_is_missing_and_one_that_may_come_is_not(caplog):
    caplog.set_level(logging.INFO)
    world = World(load(shipped.path("sim.toml"), model=SimSettings), 1)
    kinds = {port.name: port.kind for port in world.app.grounds}
    notes = LinkNotes()
    for second in range(9):
        links = (
            LinkHealth("gcs", kinds["gcs"], False, text="udp://x (no address)"),
            LinkHealth("tcp", kinds["tcp"], False),
        )
        notes.update(snapshot(second * 1_000_000, links=links))
    assert caplog.messages == ["gcs is missing, tried again for ever: udp://x (no address)"]
    shown = rows(snapshot(links=links))
    assert [colour for name, _, colour in shown if name in ("gcs", "tcp")] == ["red", "dim"]


def test_a_missing_device_is_named_once_and_again_when_it_is_back(caplog):
    caplog.set_level(logging.INFO)
    notes = LinkNotes()
    for second in range(60):
        board = LinkHealth("actuators", "actuators", second >= 30, text="serial:/dev/ttyACM0 (No such file)")
        nobody = LinkHealth("tcp", "endpoint", False, text="tcp-listen://0.0.0.0:5760")
        notes.update(snapshot(second * 1_000_000, links=(board, nobody)))
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]
    assert all("actuators" in text and "/dev/ttyACM0" in text for text in caplog.messages)


class Patient(ManualClock):
    """Virtual time that gives the writer's thread room in real time, as much as it needs, until all has been said."""

    def __init__(self, has_said):
        super().__init__()
        self._has_said = has_said

    def sleep_until_us(self, t_us, filenos=()):
        if not self._has_said():
            time.sleep(0.01)
        return super().sleep_until_us(t_us, filenos)


@pytest.mark.parametrize("view", [[], ["--status"]])
def test_a_recording_that_is_not_made_is_no_recording(view, tmp_path, monkeypatch, caplog, capsys):
    monkeypatch.chdir(tmp_path)
    caplog.set_level(logging.INFO)
    (tmp_path / "file").write_text("in the way")
    nothing = f"serial:{tmp_path}/nothing"
    door = '[{name="gcs",url="tcp-listen://127.0.0.1:0"}]'
    sets = [f"endpoints={door}", f"sensors.0.url={nothing}", "actuators.url=", "store=file/x.db"]
    words = [word for item in sets for word in ("--set", item)]
    boat = str(shipped.path("boat.toml"))
    wanted = ("Store x.db: ", "tried again every 30 s", "Recorder: control.csv: ")
    printed = []

    def said():
        printed.append(capsys.readouterr().out)
        return "\n".join(caplog.messages) + "".join(printed)

    clock = Patient(lambda: all(text in said() for text in wanted))
    monkeypatch.setattr("companion.commands.run.SystemClock", lambda: clock)
    assert main(["run", boat, "--duration", "60", "--run-dir", "file/run", *words, *view]) == 0
    assert "; NOT recorded in file/run: Recorder: " in said()
    for text in wanted:
        assert said().count(text) == 1


@pytest.mark.parametrize("action", [Action.NONE, Action.DISARM])
def test_every_reason_for_not_arming_is_shown(action):
    reasons = ("no position", "no heading", "actuator board: no status", "no ground station heard")
    shown = snapshot(armed=False, health=Health(prearm_reasons=reasons), action=action)
    assert line(shown).endswith(f"not ready: {'; '.join(reasons)}")
    assert ("Not ready", "; ".join(reasons), "yellow") in rows(shown)
    assert "not ready" not in line(snapshot(health=Health(prearm_reasons=reasons)))


def test_a_depth_guard_that_is_switched_off_is_said_in_red():
    """ "Unknown" reads as a sounder that finds no bottom just now."""
    on, off = (snapshot(health=Health(depth=depth)) for depth in (True, None))
    assert (picture_of(on).guard, picture_of(off).guard) == ("ok", "off")
    depth = next(each for each in rows(off) if each[0] == "Depth")
    assert depth[1].endswith("guard OFF: no shoal stops her")
    assert depth[2] == "red"
