"""A file that is no telemetry log is refused by what it is; what nobody here knows is not lost; time never goes back."""

from __future__ import annotations

import gzip
import random
import struct

import pytest

from companion.cli import main
from companion.io.recording.frame_log import FrameClock, FrameLog
from companion.report.from_tlog import read_tlog
from companion.report.verdicts import RunLimits, judge
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import Codec, dialect

STAMP_US = 1_760_000_000_000_000


def frames(count, *, strange_every=0):
    """Frames of a vehicle one after the other; every so many is one of a message that is not known here, or of another dialect."""
    codec, out = Codec(1, 1), []
    for number in range(count):
        raw = bytearray(codec.encode(dialect.MAVLink_heartbeat_message(11, 3, 81, number % 5, 4, 3)))
        if strange_every and number % strange_every == 1:
            raw[7:10] = (54_321).to_bytes(3, "little")
        elif strange_every and number % strange_every == 2:
            raw[-1] ^= 0x5A  # the checksum of a message with other fields
        out.append(bytes(raw))
    return out


def log(raws, at_us=STAMP_US):
    return b"".join(tlog.pack(at_us + 100_000 * number, 0, raw) for number, raw in enumerate(raws))


def test_what_nobody_here_knows_is_not_called_link_loss(tmp_path):
    path = tmp_path / "strange.tlog"
    path.write_bytes(log(frames(600, strange_every=4)))
    flight = read_tlog(path)
    (link,) = flight.links
    assert link.lost_out == 0
    assert link.frames_out == 600
    assert "54321 (150)" in " ".join(flight.notes)
    assert all(verdict.ok for verdict in judge(flight, RunLimits()) if "missing" in verdict.name)


def test_what_is_missing_is_still_counted(tmp_path):
    path = tmp_path / "lossy.tlog"
    raws = [raw for number, raw in enumerate(frames(600, strange_every=4)) if number % 10]
    path.write_bytes(log(raws))
    (link,) = read_tlog(path).links
    assert link.lost_out == 59


def test_damage_between_records_is_no_frame():
    raws = frames(9)
    data = log(raws)
    torn = data[:60] + data[70:]
    assert all(isinstance(found, tlog.TlogRecord) for found in tlog.scan(torn))
    assert len(list(tlog.iterate(torn))) in (7, 8)


def a_stream():
    return b"".join(frames(200))


KINDS = {
    "flight.tlog.raw": (a_stream, "without time stamps"),
    "flight.bin": (lambda: b"\xa3\x95\x80\x80" + random.Random(1).randbytes(5_000), "ArduPilot data-flash"),
    "flight.ulg": (lambda: b"ULog\x01\x12\x35" + bytes(4_000), "PX4 log"),
    "notes.txt": (lambda: b"it was a fine day\n" * 50, "text"),
    "noise.tlog": (lambda: random.Random(2).randbytes(20_000), "not one MAVLink frame"),
    "empty.tlog": (lambda: b"", "an empty file"),
    "packed.gz": (lambda: gzip.compress(log(frames(50))), "packed archive"),
    "store.db": (lambda: b"SQLite format 3\0" + bytes(4_080), "a database"),
}


@pytest.mark.parametrize("command", ["report", "plan", "params"])
@pytest.mark.parametrize("name", KINDS)
def test_a_file_that_is_no_log_is_refused_by_what_it_is(tmp_path, capsys, name, command):
    make, said = KINDS[name]
    path = tmp_path / name
    path.write_bytes(make())
    outputs = {"plan": "out.plan", "params": "out.params"}
    words = (
        ["report", str(path)]
        if command == "report"
        else ["plan", "extract", str(path), str(tmp_path / outputs[command])]
    )
    assert main(words) == 2
    assert said in capsys.readouterr().err
    assert [item.name for item in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize(
    "data",
    [
        log(frames(1)),
        log(frames(40))[:-7],
        log(frames(40))[11:],
        bytes(500) + log(frames(40)),
        log(frames(40, strange_every=3)),
        log([raw[:7] + b"\x31\xd4\x00" + raw[10:] for raw in frames(40)]),
        log(frames(40), at_us=5_000_000),
    ],
    ids=["one record", "cut at the end", "cut at the start", "behind rubbish", "half known", "none known", "1970"],
)
def test_a_log_is_a_log_whatever_it_went_through(data):
    assert tlog.not_a_log(data) == ""


def test_logs_that_others_made_are_logs_and_a_stream_of_theirs_is_none(shared_data):
    for path in (shared_data / "mavlink").glob("*.tlog"):
        assert tlog.not_a_log(path.read_bytes()) == "", path.name
    raw = (shared_data / "mavlink" / "crawler_real_type10_generic_82s.raw").read_bytes()
    assert "without time stamps" in tlog.not_a_log(raw)


@pytest.mark.parametrize("set_back_s", [0.2, 0.9, 1.1, 60.0, 3_600.0, 86_400.0 * 400])
def test_stamps_never_go_back_when_the_clock_is_set_back(set_back_s):
    clock, records = FrameClock(), []
    frame_log = FrameLog(0, datagrams=True, sink=records.append, clock=clock)
    raw = frames(1)[0]
    for step in range(400):
        now_us = step * 50_000
        utc_us = STAMP_US + now_us - (round(set_back_s * 1e6) if step >= 100 else 0)
        clock.move(None if step < 20 else utc_us, now_us)
        frame_log.said(raw)
    stamps = [struct.unpack(">Q", record[:8])[0] for record in records]
    assert stamps == sorted(stamps)
    assert stamps[20] == STAMP_US + 20 * 50_000, "a clock that is set forward is followed"
    passed_s = (stamps[-1] - stamps[99]) * 1e-6
    assert passed_s == pytest.approx(15.0 - (set_back_s if set_back_s < 1.0 else 0.0), abs=0.1), "and time goes on"
