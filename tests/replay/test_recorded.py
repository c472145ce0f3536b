"""Every telemetry log that somebody dropped into ``tests/recorded`` (its README is the recipe) is told as it was expected."""

from __future__ import annotations

import difflib
import shutil
from collections import Counter

import pytest

from companion.cli import main
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from tests.replay import recorded
from tests.replay.own_logs import DATA

HOW = "pytest tests/replay/test_recorded.py --update-expected"


@pytest.mark.parametrize("path", recorded.recordings(), ids=lambda path: path.name)
def test_a_recording_is_told_as_it_was(path, request):
    found = recorded.told_of(path)
    expected = recorded.expectation(path)
    if request.config.getoption("--update-expected"):
        expected.write_text(found)
        return
    if not expected.exists():
        pytest.fail(f"{path.name} has no expectation yet: {HOW} writes {expected.name}; read it", pytrace=False)
    if found != expected.read_text():
        diff = difflib.unified_diff(
            expected.read_text().splitlines(), found.splitlines(), "expected", "found", "", "", 0
        )
        shown = "\n".join(list(diff)[:60])
        pytest.fail(f"{path.name} is told differently ({HOW} accepts)\n{shown}", pytrace=False)


LOGS = [path for path in recorded.recordings() if path.is_file()]
ALL_LOGS = pytest.mark.parametrize("path", LOGS, ids=lambda path: path.stem)


def test_each_real_client_persona_fault_and_radio_has_a_recording():
    kinds = {word for path in (*LOGS, *DATA.glob("*.tlog")) for word in path.stem.split("-")}
    assert {"qgc", "mavsdk", "mavproxy", "fault", "radio"} <= kinds
    told = "".join(recorded.expectation(path).read_text() for path in LOGS if path.parent == recorded.HERE)
    assert "surface boat, generic" in told
    assert "surface boat, ardupilotmega" in told
    live = {f"{client}-{face}" for client in ("qgc", "mavsdk", "mavproxy") for face in ("ardurover", "generic")}
    assert live <= {path.stem for path in LOGS}
    assert len({path.stem for path in LOGS if path.stem.startswith("fault-")}) >= 8


@ALL_LOGS
def test_every_field_has_the_value_that_pymavlink_reads(path):
    records = list(tlog.iterate(path.read_bytes()))
    reader = dialect.MAVLink(None)
    reader.robust_parsing = True
    theirs = reader.parse_buffer(b"".join(record.frame.raw for record in records))
    assert len(theirs) == len(records)
    for record, message in zip(records, theirs, strict=True):
        if message.get_type().startswith("UNKNOWN_"):
            continue  # a message that its dialect lacks (COMPONENT_METADATA)
        ours = decode(record.frame).to_dict()  # knows more extension fields
        assert repr({name: ours[name] for name in message.to_dict()}) == repr(message.to_dict())


@ALL_LOGS
def test_the_deframer_finds_the_same_frames_between_the_stamps(path):
    data = path.read_bytes()
    deframer = Deframer()
    frames = [frame for at in range(0, len(data), 1_000) for frame in deframer.receive(data[at : at + 1_000], 0)]
    frames += deframer.receive(b"", 10_000_000)
    assert [frame.raw for frame in frames] == [record.frame.raw for record in tlog.iterate(data)]


@ALL_LOGS
def test_its_plan_and_parameters_can_be_taken_out(path, tmp_path):
    """What is in the log comes out as files; what is not is said, with status 1."""
    counts = Counter(record.frame.message_id for record in tlog.iterate(path.read_bytes()))
    wanted = {"params": dialect.MAVLINK_MSG_ID_PARAM_VALUE, "plan": dialect.MAVLINK_MSG_ID_MISSION_ITEM_INT}
    for ending, kind in wanted.items():
        out = tmp_path / f"out.{ending}"
        taken = main(["plan", "extract", str(path), str(out)]) == 0
        assert out.exists() == taken
        assert taken or not counts[kind], (
            "MAVProxy fetches parameters as a file: there may be more than by this message"
        )


@pytest.mark.parametrize("name", ["flight of tuesday.tlog", "2026-11-22 10-00-00.tlog", "a-mavsdk.tlog", "ünder.tlog"])
def test_any_name_will_do_and_another_folder_too(tmp_path, monkeypatch, name):
    shutil.copy(DATA / "loiter-mavsdk.tlog", tmp_path / name)
    monkeypatch.setenv("RECORDED_LOGS", str(tmp_path))
    (path,) = (path for path in recorded.recordings() if path.parent == tmp_path)
    assert recorded.expectation(path).parent == tmp_path
    assert "verdict" in recorded.told_of(path)


def test_one_flipped_bit_in_a_log_is_told_differently(tmp_path):
    path = tmp_path / "flipped.tlog"
    data = (DATA / "loiter-mavsdk.tlog").read_bytes()
    path.write_bytes(data)
    whole = recorded.told_of(path)
    first = next(iter(tlog.iterate(data)))
    for at in (8 + len(first.frame.raw) // 2, len(data) // 2, len(data) - 3):
        torn = bytearray(data)
        torn[at] ^= 4
        path.write_bytes(torn)
        assert recorded.told_of(path) != whole


def test_what_is_no_log_is_named(tmp_path):
    path = tmp_path / "notes.tlog"
    path.write_text("it was a fine day")
    with pytest.raises(ValueError, match="text: no telemetry log"):
        recorded.told_of(path)
