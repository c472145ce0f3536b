"""What the first release wrote opens today: stores, run folders, and what real ground stations said to it."""

from __future__ import annotations

import pytest

from companion.core.board.health import Agreement
from companion.io.keeping.keys import write_key
from companion.io.keeping.store import Store
from companion.replay import replay
from companion.report.from_run import read_run
from companion.report.from_tlog import read_tlog
from mavlink_bridge.language.requests import PlanKind
from mavlink_bridge.radio.shore.memory import read as read_picture
from sitl.gateway import simulation_key
from tests.replay.first_release import DATA, OVER_THE_RADIO, RUNS, states, unpack

LONG = ("home/run", "mavproxy-generic", "qgc-generic")


def kept(name):
    return pytest.param(name, marks=pytest.mark.soak) if name in LONG else name


def test_the_store_of_a_boat_opens_and_nothing_in_it_is_lost(tmp_path):
    store = Store(unpack("home/companion.db", tmp_path))
    content = store.snapshot()
    store.close()
    assert len(store.warnings) == 1, "plans and soundings wait to be adopted"
    assert content.params == {"CRUISE_SPEED": 1.25, "DEPTH_MIN": 1.75, "FS_GCS_TIMEOUT": 45.0}
    assert {kind: len(items) for kind, items in content.old_plans.items()} == {
        PlanKind.FENCE: 4,
        PlanKind.MISSION: 3,
        PlanKind.RALLY: 2,
    }
    assert len(content.old_depth) == 3
    assert content.stamps["own"] == content.stamps["1/1/0"] > content.stamps["255/190/9"] > content.stamps["floor"] > 0
    assert {"radio", "radio-airtime"} <= set(content.values)


def test_the_store_of_a_gateway_opens(tmp_path):
    store = Store(unpack("home/gateway.db", tmp_path))
    content = store.snapshot()
    store.close()
    assert store.warnings == ()
    picture = read_picture(content.values["gateway-twin"])
    assert picture is not None
    assert len(picture.plans[PlanKind.FENCE]) == 4


@pytest.mark.parametrize("name", RUNS)
def test_a_run_folder_opens(name, tmp_path):
    """Of the live runs the tables are not kept; events, links and plan are."""
    flight = read_run(unpack(name, tmp_path))
    assert flight.links
    assert len(flight.plan) >= 2 or name == "gateway", "a plan that crossed the compact link is in no telemetry log"
    assert [event for event in flight.events if "armed" in event.text]
    if name == "home/run":
        assert flight.duration_s > 20.0
        assert {"armed", "disarmed"} == {span.value for span in flight.spans["armed"]}


@pytest.mark.parametrize("name", RUNS)
def test_a_telemetry_log_opens(name, tmp_path):
    assert read_tlog(unpack(name, tmp_path) / "mavlink.tlog").duration_s > 20.0


@pytest.mark.parametrize("name", [kept(name) for name in RUNS if name not in OVER_THE_RADIO])
def test_what_real_stations_said_brings_today_what_it_brought_then(name, tmp_path, monkeypatch):
    # the recorded board tells what the first release told it; today's law steers by other figures
    monkeypatch.setattr(Agreement, "disagrees", lambda self, now_us: False)
    run_dir = unpack(name, tmp_path)
    seen: list[str] = []
    last: dict[str, str] = {}

    def note(snapshot):
        now = {"mode": snapshot.mode.name, "armed": snapshot.armed, "plan": snapshot.progress.state.name}
        seen.extend(f"{key} {value}" for key, value in now.items() if last.get(key) != value)
        seen.extend(f"reached {seq}" for seq in snapshot.progress.reached)
        last.update(now)

    outcome = replay(run_dir, on_tick=note)
    assert not outcome.fault
    assert not outcome.cut
    assert seen == states(run_dir)


@pytest.mark.parametrize("name", [kept(name) for name in OVER_THE_RADIO])
def test_a_run_over_the_radio_of_then_is_replayed_to_its_end(name, tmp_path):
    """The keys are the recorder's: one that it wrote, and the simulator's."""
    write_key(tmp_path / "signing.key", bytes(range(32)))
    keys = [f"radio.key_file={simulation_key(tmp_path)}"] if name != "radio" else []
    keys += [f"security.key_file={tmp_path / 'signing.key'}"] if name == "home/run" else []
    outcome = replay(unpack(name, tmp_path), changes=keys)
    assert not outcome.fault
    assert not outcome.cut
    assert outcome.ticks > 500


def test_every_client_under_both_faces_a_fault_the_radio_and_the_gateway_are_there_and_small():
    wanted = {f"{client}-{face}" for client in ("mavsdk", "mavproxy", "qgc") for face in ("generic", "ardurover")}
    assert wanted | {"guard-stop", "radio", "gateway", "home/run"} == set(RUNS)
    assert sum(path.stat().st_size for path in DATA.rglob("*.xz")) < 1_500_000
