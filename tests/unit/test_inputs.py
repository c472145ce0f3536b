"""Recorded inputs: transparent while recording, exact when replayed, whole up to a cut at any byte."""

from __future__ import annotations

import random

import pytest

from companion.io.keeping.content import SaveCounter, SaveParam, StoreContent, to_json
from companion.io.keeping.store import MemoryStore
from companion.io.links.link import Received
from companion.io.links.mem import pair
from companion.io.recording import request_json
from companion.io.recording.input_recorder import InputRecorder, RecordingLink, RecordingStore, links_meta
from companion.io.recording.input_replay import ReplayLinks, ReplayStore
from companion.io.recording.inputs import InputReader
from mavlink_bridge.language.figures import FigureEight, Hover
from mavlink_bridge.language.messages import (
    FenceArea,
    Goto,
    Loiter,
    LoiterDirection,
    Mode,
    PlanSpecification,
)
from mavlink_bridge.language.requests import Arm, LoadPlan, Orbit, PlanItem, PlanKind, RtcmData, SetMode, StartPlan
from mavlink_bridge.language.stations import Station
from sitl.scenario.file import library as scenarios, read_scenario


class EchoApp:
    """The smallest app: echoes what it reads, counts steps in the store, and keeps a diary."""

    def __init__(self, links, store):
        self.links, self.store = links, store
        self.diary = []

    def step(self, kind, now_us, utc_us, load):
        self.diary.append((kind, now_us, utc_us, load, self.store.completions()))
        for link in self.links:
            for event in link.poll(now_us):
                self.diary.append(event)
                if isinstance(event, Received):
                    self.diary.append(link.write(event.channel, event.data[::-1]))
        if kind == "tick":
            self.store.submit(SaveCounter("ticks", len(self.diary)))


def record(steps=40, seed=1):
    """Run an EchoApp over two in-memory links with random input; return (recording, diary)."""
    rng = random.Random(seed)
    near, far = zip(pair("one", capacity=64), pair("two", datagrams=True), strict=True)
    store = MemoryStore(StoreContent(params={"A": 0.1}))
    sunk = bytearray()
    recorder = InputRecorder(sunk.extend)
    recorder.start({"links": links_meta(list(near))}, to_json(store.snapshot()))
    links = [RecordingLink(link, recorder, index, keep=index == 0) for index, link in enumerate(near)]
    app = EchoApp(links, RecordingStore(store, recorder))
    for number in range(steps):
        for link in far:
            if rng.random() < 0.1:
                link.unplug("pulled")
            link.plug()
            if rng.random() < 0.3:
                link.poll(0)
            link.write(0, rng.randbytes(rng.randrange(1, 40)))
        kind, load = ("tick", rng.random()) if number % 3 == 0 else ("pump", 0.0)
        utc_us = None if number < 5 else 1_800_000_000_000_000 + number
        recorder.begin(kind, number * 1000, utc_us=utc_us, load=load)
        app.step(kind, number * 1000, utc_us, load)
    recorder.finish()
    return bytes(sunk), app.diary


def replay(path):
    reader = InputReader(path)
    links, store = ReplayLinks(reader), ReplayStore(reader)
    app = EchoApp(links.links, store)
    assert store.snapshot().params == {"A": 0.1}
    for step in reader.steps():
        links.load(step)
        store.load(step)
        app.step(step.kind, step.now_us, step.utc_us, step.load)
        links.finish()
    reader.close()
    return app.diary, links.differences, reader.cut


def test_a_replayed_app_sees_and_does_exactly_the_same(tmp_path):
    data, diary = record()
    path = tmp_path / "inputs.bin"
    path.write_bytes(data)
    again, differences, cut = replay(path)
    assert again == diary
    assert differences == []
    assert not cut


def test_a_cut_at_any_byte_replays_what_was_whole_before_it(tmp_path):
    data, diary = record(steps=8)
    path = tmp_path / "inputs.bin"
    header = data.index(b'"params"') if b'"params"' in data else 200
    seen = set()
    for size in range(header + 100, len(data)):
        path.write_bytes(data[:size])
        again, differences, cut = replay(path)
        assert again == diary[: len(again)]
        assert differences == []
        seen.add(len(again))
        assert cut or len(again) in seen
    assert len(seen) > 4


def test_a_flipped_byte_ends_the_recording_there(tmp_path):
    data, diary = record(steps=8)
    path = tmp_path / "inputs.bin"
    for at in range(300, len(data)):
        path.write_bytes(data[:at] + bytes([data[at] ^ 0x10]) + data[at + 1 :])
        again, _, cut = replay(path)
        assert cut
        assert again == diary[: len(again)]


def test_other_output_is_reported_with_step_link_before_and_after(tmp_path):
    data, _ = record()
    path = tmp_path / "inputs.bin"
    path.write_bytes(data)
    reader = InputReader(path)
    links = ReplayLinks(reader)
    written = []
    for step in reader.steps():
        links.load(step)
        for link in links.links:
            for event in link.poll(step.now_us):
                if isinstance(event, Received):
                    written.append((step.number, link.name))
                    link.write(event.channel, event.data)
        links.finish()
    reader.close()
    first = links.differences[0]
    assert (first.step, first.link) == written[0]
    assert "bytes" in str(first)
    assert str(first).splitlines()[1] != str(first).splitlines()[2]


def test_a_missing_write_is_a_difference(tmp_path):
    data, _ = record()
    path = tmp_path / "inputs.bin"
    path.write_bytes(data)
    reader = InputReader(path)
    links = ReplayLinks(reader)
    for step in reader.steps():
        links.load(step)
        links.finish()
    reader.close()
    assert links.differences[0].after == "nothing written"


def test_two_polls_in_one_step_are_told_apart(tmp_path):
    near, far = pair("one")
    sunk = bytearray()
    recorder = InputRecorder(sunk.extend)
    recorder.start({"links": links_meta([near])})
    link = RecordingLink(near, recorder, 0)
    far.poll(0)
    recorder.begin("tick", 0)
    first = link.poll(0)
    far.write(0, b"late")
    second = link.poll(0)
    recorder.finish()
    path = tmp_path / "inputs.bin"
    path.write_bytes(bytes(sunk))
    reader = InputReader(path)
    links = ReplayLinks(reader)
    (step,) = reader.steps()
    reader.close()
    links.load(step)
    assert (links.links[0].poll(0), links.links[0].poll(0), links.links[0].poll(0)) == (first, second, [])


def test_a_change_finishes_in_the_same_step_as_recorded(tmp_path):
    """The memory store finishes at the next drain; the replayed one when the recording says so."""
    store = MemoryStore()
    store.submit(SaveParam("X", 1.5))
    assert store.snapshot().params == {}
    assert [done.ok for done in store.completions()] == [True]
    assert store.snapshot().params == {"X": 1.5}


@pytest.mark.parametrize(
    "body",
    [
        StartPlan(),
        Arm(True),
        SetMode(Mode.RTL),
        Orbit(0.7, -0.15, FigureEight(radius_m=15.0, direction=LoiterDirection.INTO_DRIFT)),
        LoadPlan(
            PlanKind.MISSION,
            (PlanItem(16, 6, 0, 2.0, 0, 0, 1, 2, 3.5),),
            PlanSpecification((Goto(0, 0.7, -0.15), Loiter(1, 0.7, -0.15, figure=Hover(), duration_s=3.0)), 77),
            (FenceArea(True, ((0.1, 0.2), (0.3, 0.4), (0.5, 0.6))),),
        ),
        RtcmData(b"\xd3\x00"),
    ],
)
def test_requests_of_the_vessels_own_people_survive_json(body):
    assert request_json.loads(request_json.dumps(body)) == (body, None)
    page = Station(0, 0, "page", "10.0.0.7", bystander=True)
    assert request_json.loads(request_json.dumps(body, page)) == (body, page)


@pytest.mark.parametrize("name", [path.stem for path in scenarios()])
def test_the_plans_of_every_scenario_survive_json(name):
    for body in read_scenario(name).plans:
        assert repr(request_json.loads(request_json.dumps(body))[0]) == repr(body)


@pytest.mark.parametrize("text", ['{"class": "Popen", "fields": {}}', '{"class": "Arm", "fields": {"leg": 1}}', "{}"])
def test_what_is_no_request_is_refused(text):
    with pytest.raises(ValueError, match="not a request"):
        request_json.loads(text)
