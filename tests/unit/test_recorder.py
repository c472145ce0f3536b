"""The recorder keeps what it is given, says when it cannot, and never raises or waits."""

from __future__ import annotations

import csv
import dataclasses
import errno
import json
import os
import shutil
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

from companion.io.clock import EARLIEST_UTC_US
from companion.io.keeping.store import MemoryStore
from companion.io.links.mem import pair
from companion.io.log_file import LogFile, parts_of
from companion.io.recording.inputs import InputReader
from companion.io.recording.log_archive import log_parts
from companion.io.recording.recorder import CONTROL_COLUMNS, Recorder, drop_oldest_parts
from companion.io.recording.truth import TRUTH_COLUMNS, truth_row
from companion.io.recording.wrap import Recording
from companion.io.writer import Writer
from mavlink_bridge.language.messages import (
    ActuatorDemand,
    ActuatorOutput,
    EstimatedState,
    FixType,
    LogText,
    Mode,
    PathControlState,
    Severity,
)
from mavlink_bridge.language.snapshot import ControlTrace, Progress, Snapshot
from mavlink_bridge.mavlink.wire import tlog


def snapshot(tick: int, **changes) -> Snapshot:
    t_us = tick * 50_000
    state = EstimatedState(
        t_us, lat_rad=0.718, lon_rad=-0.152, psi_rad=1.5, sog_mps=1.25, alt_m=7.5, fix_type=FixType.RTK_FIXED
    )
    made = Snapshot(
        t_us,
        tick,
        state,
        Mode.AUTO,
        True,
        ActuatorOutput(t_us, 0.5, 0.25, 0.1, 0.1, "demand"),
        ActuatorDemand(t_us, 0.5, 0.25, 0.1, 0.1),
        path=PathControlState(cross_track_m=-0.5),
        trace=ControlTrace(heading_error_rad=0.1, heading_p=0.2),
        commanded_us=(1600, 1550, 1500, 1500),
    )
    return dataclasses.replace(made, **changes)


def events(run_dir):
    return [json.loads(line) for line in (run_dir / "events.jsonl").read_text().splitlines()]


def test_a_run_directory_holds_everything(tmp_path):
    recorder = Recorder(tmp_path / "run", about={"seed": 7})
    truth = recorder.extra("truth.csv", TRUTH_COLUMNS.encode() + b"\n")
    for tick in range(40):
        recorder.tick(snapshot(tick))
        truth.add(truth_row((tick / 20, 41.1, -8.7, 1.0, 2.0, 90, 1, 0, 0, 1, 0.5, 0.5, 0, 0, 10, 9, b"Auto", 1, 0)))
    recorder.close(2_000_000, result="done")
    about = json.loads((tmp_path / "run/run.json").read_text())
    assert set(about.pop("crc32")) == {"control.csv", "events.jsonl", "run.json", "truth.csv"}
    assert about == {"seed": 7, "result": "done"}
    with (tmp_path / "run/control.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 40
    assert rows[10]["t_s"] == "0.500"
    assert rows[10]["cross_track_m"] == "-0.5"
    assert rows[10]["speed_mps"] == ""
    assert float(rows[10]["heading_error_deg"]) == pytest.approx(5.72958, abs=1e-4)
    assert rows[10]["us_thruster_port"] == "1600"
    assert None not in rows[10]
    with (tmp_path / "run/truth.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 40
    assert recorder.drain_texts() == []


def test_control_rows_have_as_many_fields_as_the_header(tmp_path):
    recorder = Recorder(tmp_path)
    recorder.tick(snapshot(0, demand=None, commanded_us=None, state=EstimatedState(0)))
    recorder.close(0)
    header, row = (tmp_path / "control.csv").read_text().splitlines()
    assert header == CONTROL_COLUMNS
    assert row.count(",") == header.count(",")


def test_a_fix_is_kept_as_its_receiver_told_it_in_the_row_after_it_and_in_no_other(tmp_path):
    recorder = Recorder(tmp_path)
    recorder.tick(snapshot(0, state=EstimatedState(0, position_age_s=0.95)))
    recorder.tick(snapshot(1, state=EstimatedState(50_000, fix_n_mps=1.25, fix_e_mps=-0.5, position_age_s=0.12)))
    recorder.close(100_000)
    with (tmp_path / "control.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [[row[name] for name in ("fix_n_mps", "fix_e_mps", "fix_age_s")] for row in rows] == [
        ["", "", ""],
        ["1.2500", "-0.5000", "0.120"],
    ]


def test_events_tell_what_changed_and_nothing_of_this_machine(tmp_path):
    recorder = Recorder(tmp_path)
    recorder.tick(snapshot(0, armed=False))
    recorder.tick(snapshot(1, armed=True))
    recorder.tick(snapshot(2))
    text = LogText(1, 150_000, Severity.WARNING, "depth 3.9 m")
    recorder.tick(snapshot(3, texts=(text,), progress=Progress(seq=1, reached=(0,))))
    recorder.close(200_000)
    found = events(tmp_path)
    assert {"t_s": 0.05, "event": "armed", "value": True, "before": False} in found
    assert {"t_s": 0.15, "event": "text", "severity": "WARNING", "text": "depth 3.9 m"} in found
    assert {"t_s": 0.15, "event": "reached", "item": 0} in found
    assert not [event for event in found if event["t_s"] == 0.1]
    assert str(tmp_path) not in (tmp_path / "events.jsonl").read_text()


def test_nothing_older_than_a_second_waits_in_memory(tmp_path):
    recorder = Recorder(tmp_path)
    for tick in range(101):
        recorder.tick(snapshot(tick))
        if tick % 20 == 0:
            assert len((tmp_path / "control.csv").read_text().splitlines()) >= tick + 1 - 20


def test_row_56_a_full_disk_is_told_once_and_tried_again(tmp_path):
    (tmp_path / "control.csv").symlink_to("/dev/full")
    recorder = Recorder(tmp_path)
    for tick in range(2000):
        recorder.tick(snapshot(tick))
        if tick == 700:
            (tmp_path / "control.csv").unlink()
    texts = [text for _, text in recorder.drain_texts()]
    assert texts == ["Recorder: control.csv: no space on the disk", "Recorder: control.csv: writing again"]
    assert len((tmp_path / "control.csv").read_text().splitlines()) > 300


def test_row_56_the_free_space_floor_pauses_recording(tmp_path):
    recorder = Recorder(tmp_path, free_floor_mb=1 << 40)
    for tick in range(200):
        recorder.tick(snapshot(tick))
    assert not recorder.healthy
    assert any("recording paused" in text for _, text in recorder.drain_texts())
    assert not (tmp_path / "control.csv").exists() or (tmp_path / "control.csv").stat().st_size < 10_000


def test_row_57_a_hanging_disk_neither_delays_a_tick_nor_fills_the_memory(tmp_path):
    writer = Writer(max_jobs=4)
    gate = threading.Event()
    writer.post(gate.wait)
    recorder = Recorder(tmp_path, writer=writer)
    inputs = recorder.inputs
    inputs.start({})
    near, _ = pair("x")
    near.poll(0)
    for tick in range(200):
        inputs.begin("tick", tick * 50_000)
        inputs.wrote(0, 0, bytes(100_000), 100_000, True)
        recorder.tick(snapshot(tick))
    assert recorder._inputs.waiting < 9 << 20
    assert recorder._inputs.dropped > 0
    gate.set()
    recorder.close(10_000_000)
    assert writer.close()
    reader = InputReader(tmp_path / "inputs.bin")
    assert 10 < len(list(reader.steps())) < 200
    reader.close()


def test_row_57_no_tick_looks_at_a_disk_that_hangs(tmp_path, monkeypatch):
    lookers = []

    def statvfs(path):
        lookers.append(threading.current_thread().name)
        raise OSError(5, "Input/output error")

    monkeypatch.setattr("os.statvfs", statvfs)
    writer = Writer(max_jobs=4)
    gate = threading.Event()
    writer.post(gate.wait)
    recorder = Recorder(tmp_path, writer=writer)
    for tick in range(400):
        recorder.tick(snapshot(tick))
    assert lookers == []
    gate.set()
    recorder.close(20_000_000)
    assert writer.close()
    assert set(lookers) == {"writer"}


def steps_of(run_dir):
    reader = InputReader(run_dir / "inputs.bin")
    steps = list(reader.steps())
    reader.close()
    assert reader.meta == {"boat": "x"}
    assert not reader.cut
    return len(steps)


def record_steps(recorder, numbers):
    for number in numbers:
        recorder.inputs.begin("tick", number * 1_000_000)
        recorder.flush(number * 1_000_000)


@pytest.mark.parametrize(("first", "last", "readable"), [(0, 10, 0), (20, 30, 19)])
def test_row_56_the_inputs_end_where_a_pause_begins_and_can_be_read_to_there(
    tmp_path, monkeypatch, first, last, readable
):
    real, now_s = os.statvfs, 0

    def statvfs(path):
        return SimpleNamespace(f_frsize=1, f_bavail=0 if first <= now_s < last else real(path).f_bavail << 32)

    monkeypatch.setattr(os, "statvfs", statvfs)
    recorder = Recorder(tmp_path)
    recorder.inputs.start({"boat": "x"})
    for now_s in range(60):
        record_steps(recorder, [now_s])
    size = (tmp_path / "inputs.bin").stat().st_size
    for now_s in range(60, 90):
        record_steps(recorder, [now_s])
    recorder.close(90_000_000)
    assert (tmp_path / "inputs.bin").stat().st_size == size, "what no replay can use does not fill the disk"
    assert steps_of(tmp_path) == readable
    texts = [text for _, text in recorder.drain_texts()]
    assert texts.count("Recorder: inputs.bin: it ends here, a replay goes no further") == 1


@pytest.mark.parametrize(("full_from", "readable"), [(0, 0), (20, 19)])
def test_row_56_the_inputs_end_where_the_disk_is_full_and_can_be_read_to_there(
    tmp_path, monkeypatch, full_from, readable
):
    real, now_s = os.write, 0

    def write(fd, data):
        if full_from <= now_s < full_from + 5:
            if len(data) < 8:
                raise OSError(errno.ENOSPC, "No space left on device")
            return real(fd, data[:7])  # the last bytes that there was room for
        return real(fd, data)

    monkeypatch.setattr("companion.io.log_file.os.write", write)
    recorder = Recorder(tmp_path, free_floor_mb=0)
    recorder.inputs.start({"boat": "x"})
    for now_s in range(90):
        record_steps(recorder, [now_s])
    recorder.close(90_000_000)
    assert steps_of(tmp_path) == readable
    texts = [text for _, text in recorder.drain_texts()]
    assert texts == ["Recorder: inputs.bin: no space on the disk; it ends here, a replay goes no further"]


def test_row_56_half_a_row_is_taken_back_before_the_next(tmp_path, monkeypatch):
    real, writes = os.write, iter(range(99))

    def write(fd, data):
        number = next(writes)
        if number == 2:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(fd, data[:5] if number == 1 else data)

    monkeypatch.setattr("companion.io.log_file.os.write", write)
    texts = []
    file = LogFile(tmp_path / "events.jsonl", None, texts.append)
    for now_s, row in [(0, b'{"a":1}\n'), (1, b'{"lost":1}\n'), (2, b'{"lost":2}\n'), (40, b'{"b":2}\n')]:
        file.add(row)
        file.flush(now_s * 1_000_000)
    file.close(41_000_000)
    assert events(tmp_path) == [{"a": 1}, {"b": 2}]
    assert texts == ["events.jsonl: no space on the disk", "events.jsonl: writing again"]


@pytest.mark.parametrize("threaded", [False, True])
def test_a_run_directory_that_is_deleted_is_told_and_begun_anew(tmp_path, threaded):
    run_dir, writer = tmp_path / "run", Writer() if threaded else None
    recorder = Recorder(run_dir, free_floor_mb=0, writer=writer, about={"boat": "x"})
    recorder.inputs.start({"boat": "x"})
    for tick in range(1000):
        if tick == 300:
            settle(writer)
            shutil.rmtree(run_dir)
        recorder.inputs.begin("tick", tick * 50_000)
        recorder.tick(snapshot(tick))
        if tick % 20 == 0:
            settle(writer)
    recorder.close(50_000_000)
    assert writer is None or writer.close()
    assert [text for _, text in recorder.drain_texts()] == [
        "Recorder: files of this run are gone: begun anew",
        "Recorder: inputs.bin: it ends here, a replay goes no further",
    ]
    lines = (run_dir / "control.csv").read_text().splitlines()
    assert lines[0] == CONTROL_COLUMNS
    assert lines[-1].split(",")[1] == "999"
    assert len(lines) > 580, "five seconds may pass until it is seen"
    assert json.loads((run_dir / "run.json").read_text())["boat"] == "x"
    assert steps_of(run_dir) == 0


def settle(writer):
    if writer is not None:
        done = threading.Event()
        writer.post(done.set)
        assert done.wait(10)


def test_an_unwritable_place_is_a_text_and_no_exception(tmp_path):
    (tmp_path / "file").write_text("in the way")
    recorder = Recorder(tmp_path / "file" / "run")
    for tick in range(100):
        recorder.tick(snapshot(tick))
    recorder.close(5_000_000, result="done")
    assert recorder.drain_texts()
    assert not recorder.healthy


def test_a_place_where_nobody_may_write_is_told_as_that(tmp_path, monkeypatch):
    """ "No such file or directory" was told of each file: the folder that could not be made was missing."""
    real, base = os.mkdir, tmp_path / "runs"
    base.mkdir()

    def refuse(path, *more, **options):
        if Path(path).is_relative_to(base):
            raise PermissionError(13, "Permission denied", str(path))
        return real(path, *more, **options)

    monkeypatch.setattr(os, "mkdir", refuse)
    recorder = Recorder(base / "now", free_floor_mb=0)
    for tick in range(100):
        recorder.tick(snapshot(tick))
    texts = [text for _, text in recorder.drain_texts()]
    assert "Recorder: control.csv: Permission denied" in texts
    assert not [text for text in texts if "No such file" in text]
    monkeypatch.undo()
    for tick in range(100, 1_000):
        recorder.tick(snapshot(tick))
    recorder.close(50_000_000)
    assert (base / "now" / "control.csv").stat().st_size > 0, "and once it may be written, it is"
    assert (base / "now").stat().st_mode & 0o777 == 0o750


def test_the_folders_that_lead_to_a_run_are_its_owners_too(tmp_path):
    Recorder(tmp_path / "boat" / "runs" / "now", free_floor_mb=0).close(0)
    made = (tmp_path / "boat", tmp_path / "boat" / "runs", tmp_path / "boat" / "runs" / "now")
    assert [folder.stat().st_mode & 0o777 for folder in made] == [0o750] * 3


@pytest.mark.parametrize(
    ("ahead_s", "told"),
    [(0.9, []), (90.0, ["90 s"]), (3_600.0, ["60 min"]), (7_300.0, ["2 h"]), (86_400.0 * 7_300, ["7300 days"])],
)
def test_a_clock_that_was_ahead_and_comes_back_is_told_once_each_time(tmp_path, ahead_s, told):
    """The log's stamps stay ahead to the end of the run, and nobody knew."""
    utc_us = [EARLIEST_UTC_US]
    recording = Recording(Recorder(tmp_path, free_floor_mb=0), lambda: utc_us[0])
    for step in range(40):
        now_us = step * 50_000
        utc_us[0] = EARLIEST_UTC_US + 10**9 + now_us + (round(ahead_s * 1e6) if 10 <= step < 20 else 0)
        recording.begin("tick", now_us)
    recording.close(2_000_000)
    assert [text for _, text in recording.drain_texts()] == [
        f"Recorder: clock set back by {each}: times in mavlink.tlog run on ahead of it in this run" for each in told
    ]


def test_parts_rotate_and_the_oldest_go(tmp_path):
    recorder = Recorder(tmp_path, max_mb=1)
    for tick in range(20_000):
        recorder.tick(snapshot(tick))
    recorder.close(10**9)
    total = sum(path.stat().st_size for path in tmp_path.iterdir())
    assert total < 1.3 * 2**20
    assert (tmp_path / "control.csv").exists()
    newest = max(tmp_path.glob("control-*.csv"))
    lines = newest.read_text().splitlines()
    assert lines[0] == CONTROL_COLUMNS
    assert lines[-1].split(",")[1] == "19999"


def test_an_earlier_run_in_the_same_directory_is_set_aside(tmp_path):
    for number in range(3):
        recorder = Recorder(tmp_path, about={"number": number})
        recorder.tick(snapshot(number + 1))
        recorder.close(1_000_000)
    assert [
        json.loads((tmp_path / place / "run.json").read_text())["number"] for place in ("earlier-1", "earlier-2", ".")
    ] == [
        0,
        1,
        2,
    ]
    for place in ("earlier-1", "earlier-2", "."):
        assert (tmp_path / place / "control.csv").read_text().count("t_s,") == 1


def test_first_parts_are_never_deleted(tmp_path):
    for name in ("control.csv", "control-001.csv", "inputs.bin"):
        (tmp_path / name).write_bytes(bytes(1000))
    drop_oldest_parts(tmp_path, 1)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["control.csv", "inputs.bin"]


def test_a_part_that_is_being_written_is_never_deleted(tmp_path):
    """It had been, each five seconds: "files of this run are gone: begun anew", 376 times an hour, and nothing was kept."""
    recorder = Recorder(tmp_path, max_mb=1)
    (tmp_path / "truth.csv").write_bytes(bytes(1 << 20))
    for second in range(1, 41):
        recorder.frames(bytes(3_000))
        recorder.flush(second * 1_000_000)
    assert recorder.drain_texts() == []
    recorder.close(41_000_000)
    assert sum(path.stat().st_size for path in tmp_path.glob("mavlink*.tlog")) == 120_000


def test_after_a_thousand_parts_the_order_and_the_limit_are_kept(tmp_path):
    names = ["mavlink.tlog", "mavlink-998.tlog", "mavlink-999.tlog", "mavlink-1000.tlog", "mavlink-1001.tlog"]
    for number, name in enumerate(names):
        (tmp_path / name).write_bytes(bytes(1000 + number))
    (tmp_path / "mavlink-copy.tlog").write_bytes(b"somebody's own")
    assert [path.name for path in parts_of(tmp_path / "mavlink.tlog")] == names
    assert [(path.name, size) for path, size in log_parts(tmp_path)] == [
        (name, 1000 + number) for number, name in enumerate(names)
    ]
    drop_oldest_parts(tmp_path, 1)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mavlink-copy.tlog", "mavlink.tlog"]


def heartbeat() -> bytes:
    from pymavlink.dialects.v20 import all as dialect

    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    return mav.heartbeat_encode(11, 3, 0, 0, 3).pack(mav)


class Echo:
    """An app that sends back what it hears."""

    def __init__(self, link):
        self.links = (link,)

    def pump(self, now_us):
        for event in self.links[0].poll(now_us):
            if hasattr(event, "data"):
                self.links[0].write(event.channel, event.data * 2)

    def tick(self, now_us, *, late_s=0.0, load=0.0):
        self.pump(now_us)
        return self

    def shutdown(self, now_us):
        self.links[0].close()


def test_frames_of_both_directions_are_in_the_telemetry_log_and_inputs_replay(tmp_path):
    near, far = pair("gcs")
    recorder = Recorder(tmp_path)
    utc_us = EARLIEST_UTC_US + 123_456_789
    recording = Recording(recorder, lambda: utc_us)
    recording.link(pair("sensor")[0])
    recording.link(pair("other")[0], mavlink=True)
    link = recording.link(near, mavlink=True)
    recording.store(MemoryStore())
    recording.start({"version": "x"})
    app = recording.app(Echo(link))
    frame = heartbeat()
    far.poll(0)
    app.tick(0)
    far.write(0, frame[:5])
    app.pump(10_000)
    far.write(0, frame[5:])
    app.tick(50_000, late_s=0.001, load=0.25)
    app.shutdown(60_000)
    records = list(tlog.iterate((tmp_path / "mavlink.tlog").read_bytes()))
    assert [record.link for record in records] == [1]
    assert records[0].frame.raw == frame
    assert records[0].t_us == utc_us & ~3
    reader = InputReader(tmp_path / "inputs.bin")
    assert [entry["name"] for entry in reader.meta["links"]] == ["sensor", "other", "gcs"]
    steps = list(reader.steps())
    reader.close()
    assert [(step.kind, step.now_us, step.load, step.late_s) for step in steps] == [
        ("tick", 0, 0.0, 0.0),
        ("pump", 10_000, 0.0, 0.0),
        ("tick", 50_000, 0.25, 0.001),
        ("stop", 60_000, 0.0, 0.0),
    ]
    assert not reader.cut


@pytest.mark.parametrize(
    ("run_dir", "url"),
    [(".", "./mirror"), ("x", "x/mirror"), ("radio", "radio/mirror"), ("links", "links/mirror"), ('a"b', 'a"b/mirror')],
)
def test_a_run_in_a_directory_of_any_name_can_be_described(tmp_path, monkeypatch, run_dir, url):
    monkeypatch.chdir(tmp_path)
    about = {
        "settings": {"radio": {"url": f"serial:{url}?baud=9600"}, "name": "x", "text": "a x. 1.5 radio, links"},
        "where": [f"{tmp_path}/{run_dir}-2/boat.toml", "/max/x/y", "../x", f"file://{tmp_path}/{run_dir}/log.nmea"],
    }
    recording = Recording(Recorder(Path(run_dir)), lambda: None)
    recording.start(about)
    recording.close(0)
    reader = InputReader(tmp_path / run_dir / "inputs.bin")
    reader.close()
    about["settings"]["radio"]["url"] = "serial:RUN_DIR/mirror?baud=9600"
    if run_dir != ".":
        about["where"][-1] = "file://RUN_DIR/log.nmea"
    assert reader.meta == {**about, "links": [], "store_warnings": []}


def test_our_own_output_is_cut_into_frames():
    frame = heartbeat()
    assert tlog.split_frames(frame * 3) == [frame] * 3
    assert tlog.split_frames(frame + frame[:7]) == [frame]
    assert tlog.split_frames(b"") == []
