"""Log downloads over a bad link, by stations that ask as MAVSDK, QGroundControl and MAVProxy do: every byte arrives, in bounded air."""

from __future__ import annotations

import importlib.util
import json
import os
import random
import struct
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from companion.io.recording.log_archive import LogArchive
from companion.logs import Logs
from mavlink_bridge.mavlink.files.logs import LogServer
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer

_spec = importlib.util.spec_from_file_location("lossy", Path(__file__).with_name("lossy.py"))
lossy = sys.modules["lossy"] = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(lossy)

STEP_US = 10_000
FRAMES_A_STEP = 20
BAD = lossy.Weather(loss=0.3, copies=0.2, delay_us=(5_000, 60_000))
SLOW = lossy.Weather(loss=0.1, copies=0.1, delay_us=(100_000, 900_000))
LAN = lossy.Weather(delay_us=(1_000, 1_000))
BEGIN_S = 1_780_000_000


def make_log(folder: Path, name: str, size: int, *, part: str = "", begin_s: int = BEGIN_S) -> bytes:
    (folder / name).mkdir(parents=True, exist_ok=True)
    body = random.Random(size).randbytes(size)
    content = body if part else struct.pack(">Q", begin_s * 1_000_000)[:size] + body[8:]
    (folder / name / f"mavlink{part}.tlog").write_bytes(content)
    return content


OURS = {"vessel_id": "a", "settings": {"system": {"system_id": 1}}}


def say_whose(run_dir: Path, about: object) -> None:
    (run_dir / "run.json").write_text(json.dumps(about))


class Vessel:
    """The service over real files; what it is asked for it has a step later."""

    def __init__(self, folder: Path, first_id: int = 1) -> None:
        self.said: list[str] = []
        (folder / "now").mkdir(exist_ok=True)
        self.logs = Logs(LogArchive(folder, folder / "now"), lambda _, text: self.said.append(text))
        self.server = LogServer(self.logs, first_id, self.said.append, self.erase)
        self.codec, self.deframer = Codec(1, 1), Deframer(datagrams=True)
        self.sent = 0

    def erase(self) -> None:
        self.logs.erase("station 255 over gcs")
        self.server.erase_answered()

    def step(self, raws: list[bytes], now_us: int) -> list[bytes]:
        self.logs.collect()
        for raw in raws:
            for frame in self.deframer.receive(raw, now_us):
                self.server.handle(decode(frame), now_us)
        out = []
        for _ in range(FRAMES_A_STEP):
            packed = self.server.next(now_us)
            if packed is None:
                break
            out.append(self.codec.seal(*packed))
        self.sent += len(out)
        return out


class Station:
    """Lists, then downloads one log. ``ask`` is called for each frame and when nothing has come for a while."""

    patience_us = 500_000

    def __init__(self, which: int) -> None:
        self.codec, self.deframer = Codec(255, 190), Deframer(datagrams=True)
        self.which = which
        self.entries: dict[int, tuple[int, int]] = {}
        self.got: dict[int, bytes] = {}
        self.done, self.heard_us, self.begun = False, 0, False
        self.out: list[bytes] = []

    def send(self, message: object) -> None:
        self.out.append(self.codec.encode(message))

    def want(self, start: int, count: int) -> None:
        self.send(dialect.MAVLink_log_request_data_message(1, 1, self.which, start, count))

    def step(self, raws: list[bytes], now_us: int) -> list[bytes]:
        for raw in raws:
            for frame in self.deframer.receive(raw, now_us):
                self.heard_us = now_us
                self.take(decode(frame))
        if not self.done and (now_us == 0 or now_us - self.heard_us >= self.patience_us):
            self.heard_us = now_us
            self.stalled()
        out, self.out = self.out, []
        return out

    def take(self, message: object) -> None:
        if message.get_type() == "LOG_ENTRY":
            self.entries[message.id] = (message.size, message.time_utc)
            if self.which in self.entries and not self.begun:
                self.begun = True
                self.size = self.entries[self.which][0]
                self.begin()
        elif message.get_type() == "LOG_DATA" and message.id == self.which and not self.done:
            self.got.setdefault(message.ofs, bytes(message.data[: message.count]))
            self.data(message)

    def stalled(self) -> None:
        if self.begun:
            self.again()
        else:
            self.send(dialect.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))

    @property
    def content(self) -> bytes:
        return b"".join(self.got[at] for at in sorted(self.got))


class Chunks(Station):
    """MAVSDK and QGroundControl: 512 messages at a time, then the first gap, again at every frame that comes."""

    chunk = 0

    def begin(self) -> None:
        self.want(self.chunk * 46080, 46080)

    def bins(self) -> range:
        return range(self.chunk * 46080, min((self.chunk + 1) * 46080, self.size), 90)

    def data(self, message: object) -> None:
        if message.ofs not in self.bins():
            return
        if all(at in self.got for at in self.bins()):
            self.chunk += 1
            self.done = self.chunk * 46080 >= self.size
            if not self.done:
                self.begin()
        elif self.bins()[-1] in self.got:
            self.again()

    def again(self) -> None:
        missing = [at for at in self.bins() if at not in self.got]
        end = next((at for at in range(missing[0], self.bins().stop, 90) if at in self.got), self.bins().stop)
        self.want(missing[0], end - missing[0])


class Whole(Station):
    """MAVProxy: everything at once, after 0.7 s without a frame up to twenty gaps; the end shows by a short message."""

    patience_us = 700_000

    def begin(self) -> None:
        self.want(0, 0xFFFFFFFF)

    def data(self, message: object) -> None:
        short = message.count < 90 and len(self.got) == 1 + message.ofs // 90
        self.done = self.done or message.count == 0 or short

    def again(self) -> None:
        if not self.got:
            self.begin()
            return
        highest = max(self.got) // 90
        missing = [at for at in range(highest) if at * 90 not in self.got]
        if not missing:
            self.want((1 + highest) * 90, 0xFFFFFFFF)
        for at in missing[:20]:
            self.want(at * 90, 90)


def download(vessel: Vessel, station: Station, weather: object, seed: int, limit_s: float = 600.0) -> float:
    rng = random.Random(seed)
    up, down = lossy.Air(weather, rng), lossy.Air(weather, rng)
    now_us = 0
    while not station.done and now_us < limit_s * 1e6:
        for raw in station.step(down.take(now_us), now_us):
            up.put(raw, now_us)
        for raw in vessel.step(up.take(now_us), now_us):
            down.put(raw, now_us)
        now_us += STEP_US
    return now_us / 1e6


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.integers(0, 10**6),
    st.sampled_from([1, 89, 90, 91, 16200, 16201, 46080, 60_000]),
    st.sampled_from([Chunks, Whole]),
    st.sampled_from([BAD, SLOW]),
)
def test_a_log_over_a_bad_link_is_whole_when_the_station_says_it_is(tmp_path, seed, size, kind, weather):
    content = make_log(tmp_path, "earlier", size)
    vessel, station = Vessel(tmp_path), kind(1)
    download(vessel, station, weather, seed)
    assert station.done
    assert station.content == content
    assert vessel.sent < 40 * (size // 90 + 25)


@pytest.mark.parametrize("kind", [Chunks, Whole])
def test_a_good_link_carries_each_byte_once(tmp_path, kind):
    content = make_log(tmp_path, "earlier", 200_000)
    vessel, station = Vessel(tmp_path), kind(1)
    seconds = download(vessel, station, LAN, 0)
    assert station.content == content
    assert vessel.sent == 1 + 2223
    assert seconds < 2223 / FRAMES_A_STEP * 0.01 * 1.5


def test_parts_of_a_run_come_as_one_log_and_other_folders_not_at_all(tmp_path):
    first = make_log(tmp_path, "b", 40_000)
    second = make_log(tmp_path, "b", 30_000, part="-001")
    make_log(tmp_path, "a", 500, begin_s=BEGIN_S + 9)
    make_log(tmp_path, "empty", 0)
    (tmp_path / "no log").mkdir()
    (tmp_path / "b" / "events.jsonl").write_text("{}")
    (tmp_path / "link").mkdir()
    (tmp_path / "link" / "mavlink.tlog").symlink_to(tmp_path / "a" / "mavlink.tlog")
    vessel, station = Vessel(tmp_path, first_id=0), Chunks(0)
    download(vessel, station, LAN, 0)
    assert station.entries == {0: (70_000, BEGIN_S), 1: (500, BEGIN_S + 9)}, "oldest first, from 0 as MAVSDK counts"
    assert station.content == first + second


def locked(monkeypatch, folder):
    """A folder that gives nothing, as lost+found to anybody but root."""
    for name in ("stat", "scandir", "listdir"):
        real = getattr(os, name)

        def refuse(path=".", *more, real=real, **options):
            if isinstance(path, (str, Path)) and Path(path).is_relative_to(folder):
                raise PermissionError(13, "Permission denied")
            return real(path, *more, **options)

        monkeypatch.setattr(os, name, refuse)


def test_a_folder_that_cannot_be_read_hides_no_other(tmp_path, monkeypatch):
    content = make_log(tmp_path, "b", 4000)
    make_log(tmp_path, "lost+found", 4000)
    locked(monkeypatch, tmp_path / "lost+found" / "mavlink.tlog")
    vessel, station = Vessel(tmp_path), Chunks(1)
    download(vessel, station, LAN, 0)
    assert station.content == content
    assert vessel.said == []


def test_logs_that_cannot_be_looked_up_are_told(tmp_path, monkeypatch):
    make_log(tmp_path, "b", 4000)
    vessel = Vessel(tmp_path)
    locked(monkeypatch, tmp_path)
    vessel.logs.look()
    vessel.logs.collect()
    assert vessel.said == ["Logs not looked up: Permission denied"]


def test_the_present_run_is_the_last_and_survives_an_erase(tmp_path):
    make_log(tmp_path, "zz-earlier", 500, begin_s=BEGIN_S + 5)
    vessel = Vessel(tmp_path)
    now = make_log(tmp_path, "now", 300)
    say_whose(tmp_path / "zz-earlier", OURS)
    say_whose(tmp_path / "now", OURS)
    station = Chunks(2)
    download(vessel, station, LAN, 0)
    assert station.content == now
    vessel.server.handle(dialect.MAVLink_log_erase_message(1, 1), 0)
    again = Chunks(1)
    download(vessel, again, LAN, 0)
    assert vessel.said == ["Logs of 1 earlier runs erased by station 255 over gcs"]
    assert not (tmp_path / "zz-earlier" / "mavlink.tlog").exists()
    assert again.entries == {1: (300, BEGIN_S)}, "a list asked for right after the erase shows what is left"


WHOSE = {
    "another vessel's": {**OURS, "vessel_id": "b"},
    "of another number": {**OURS, "settings": {"system": {"system_id": 2}}},
    "nobody's": {},
    "of the first release": {"settings": OURS["settings"]},
    "no object": [],
    "of no shape": {**OURS, "settings": []},
    "nested without end": None,
}


NO_STORE = {
    "vessel_id": "drawn at this start",
    "world_kind": "real",
    "settings": {"store": "", "system": {"name": "heron", "system_id": 1}},
}


@pytest.mark.parametrize(
    ("earlier", "is_ours"),
    [
        ({"vessel_id": "drawn at that start"}, True),
        ({"world_kind": "simulated"}, False),
        ({"vessel_id": None}, False),
        ({"settings": {"store": "", "system": {"name": "egret", "system_id": 1}}}, False),
        ({"settings": {"store": "", "system": {"name": "heron", "system_id": 2}}}, False),
        ({"settings": {"store": "", "system": {"name": ["heron"], "system_id": 1}}}, False),
        ({"settings": {"store": "a.db", "system": {"name": "heron", "system_id": 1}}}, False),
    ],
)
def test_without_a_store_a_vessels_earlier_runs_are_known_by_her_name_and_number(tmp_path, earlier, is_ours):
    """Her id is drawn at each start: an erase deleted none of her runs and called them another vessel's."""
    make_log(tmp_path, "earlier", 500)
    make_log(tmp_path, "now", 300)
    say_whose(tmp_path / "earlier", {**NO_STORE, **earlier})
    say_whose(tmp_path / "now", NO_STORE)
    vessel = Vessel(tmp_path)
    vessel.erase()
    vessel.step([], 0)
    assert (tmp_path / "earlier" / "mavlink.tlog").exists() is not is_ours


@pytest.mark.parametrize("whose", WHOSE)
def test_an_erase_leaves_what_is_not_known_to_be_this_vessels(tmp_path, whose):
    """It unlinked whatever lay in the folder."""
    make_log(tmp_path, "ours", 500)
    make_log(tmp_path, "other", 500)
    vessel = Vessel(tmp_path)
    for name in ("ours", "now"):
        say_whose(tmp_path / name, OURS)
    if WHOSE[whose] is None:
        (tmp_path / "other" / "run.json").write_text("[" * 200_000)
    else:
        say_whose(tmp_path / "other", WHOSE[whose])
    vessel.erase()
    vessel.step([], 0)
    assert vessel.said == [
        "Logs of 1 earlier runs erased by station 255 over gcs; 1 left: another vessel's, unknown, or in use"
    ]
    assert (tmp_path / "other" / "mavlink.tlog").exists()
    assert not (tmp_path / "ours" / "mavlink.tlog").exists()


def test_nothing_is_erased_while_nobody_knows_whose_the_present_run_is(tmp_path):
    make_log(tmp_path, "ours", 500)
    vessel = Vessel(tmp_path)
    say_whose(tmp_path / "ours", OURS)
    vessel.erase()
    vessel.step([], 0)
    assert (tmp_path / "ours" / "mavlink.tlog").exists()


def test_what_is_gone_is_said_and_other_logs_go_on(tmp_path):
    make_log(tmp_path, "a", 100_000)
    content = make_log(tmp_path, "b", 100_000, begin_s=BEGIN_S + 1)
    vessel, station = Vessel(tmp_path), Chunks(1)
    download(vessel, station, LAN, 0, limit_s=0.1)
    (tmp_path / "a" / "mavlink.tlog").unlink()
    download(vessel, station, LAN, 0, limit_s=5)
    assert not station.done
    assert any(text.startswith("log 1: ") for text in vessel.said)
    other = Chunks(2)
    other.begun, other.size = True, 100_000
    other.begin()
    download(vessel, other, LAN, 0)
    assert other.content == content
    vessel.server.handle(dialect.MAVLink_log_request_data_message(1, 1, 77, 0, 90), 0)
    assert vessel.said[-1] == "there is no log 77: list the logs first"


def test_entries_and_data_stop_when_the_station_says_so(tmp_path):
    make_log(tmp_path, "a", 100_000)
    vessel = Vessel(tmp_path)
    vessel.server.handle(dialect.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF), 0)
    vessel.step([], 0)
    vessel.server.handle(dialect.MAVLink_log_request_data_message(1, 1, 1, 0, 0xFFFFFFFF), 0)
    vessel.step([], 0)
    assert vessel.step([], 0)
    vessel.server.handle(dialect.MAVLink_log_request_end_message(1, 1), 0)
    assert not vessel.server.busy
    assert vessel.step([], 0) == []


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("list"), st.integers(0, 0xFFFF), st.integers(0, 0xFFFF)),
            st.tuples(st.just("data"), st.integers(0, 5), st.integers(0, 0xFFFFFFFF), st.integers(0, 0xFFFFFFFF)),
            st.tuples(st.just("data"), st.integers(0, 3), st.integers(0, 9000), st.integers(0, 9000)),
            st.tuples(st.just("erase")),
            st.tuples(st.just("end")),
        ),
        max_size=30,
    )
)
def test_any_requests_leave_memory_bounded_and_every_message_within_its_log(tmp_path, asked):
    contents = {1: make_log(tmp_path, "a", 20_000), 2: make_log(tmp_path, "b", 7_001, begin_s=BEGIN_S + 3)}
    vessel = Vessel(tmp_path)
    deframer = Deframer()
    for what, *numbers in asked:
        maker = {
            "list": lambda first, last: dialect.MAVLink_log_request_list_message(1, 1, first, last),
            "data": lambda log, at, count: dialect.MAVLink_log_request_data_message(1, 1, log, at, count),
            "erase": lambda: dialect.MAVLink_log_erase_message(1, 1),
            "end": lambda: dialect.MAVLink_log_request_end_message(1, 1),
        }[what]
        vessel.server.handle(maker(*numbers), 0)
        for raw in vessel.step([], 0):
            for frame in deframer.receive(raw, 0):
                message = decode(frame)
                if message.get_type() == "LOG_DATA":
                    assert bytes(message.data[: message.count]) == contents[message.id][message.ofs :][: message.count]
        assert len(vessel.server._ranges) <= 64
        assert len(vessel.logs._pieces) <= 32
