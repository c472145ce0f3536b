"""Every telemetry log that somebody dropped into ``tests/recorded`` (its README is the recipe) is told as it was expected."""

from __future__ import annotations

import difflib
import shutil

import pytest

from mavlink_bridge.mavlink.wire import tlog
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


def test_the_folder_is_not_empty():
    assert recorded.recordings()


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
