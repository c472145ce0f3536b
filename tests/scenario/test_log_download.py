"""Logs of earlier runs over MAVLink, from the whole vessel: listed, downloaded within the byte budget, and replayed bit for bit."""

from __future__ import annotations

import json
import random
import struct

import pytest

from companion.io.recording.recorder import Recorder
from companion.replay import replay, summary
from companion.worlds import simulated_content
from mavlink_bridge.mavlink.persona.config import EndpointConfig
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from mavlink_bridge.mavlink.wire.tlog import iterate
from tests.fake_vessel import Bench
from tests.world_station import Helm

BEGIN_S = 1_780_000_000


@pytest.fixture
def log(tmp_path):
    folder = tmp_path / "runs" / "earlier"
    folder.mkdir(parents=True)
    about = {"vessel_id": simulated_content(1).vessel}
    (folder / "run.json").write_text(json.dumps(about))
    content = struct.pack(">Q", BEGIN_S * 1_000_000) + random.Random(5).randbytes(150_000)
    (folder / "mavlink.tlog").write_bytes(content)
    return content


def listed(helm):
    helm.send(dialect.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    helm.until(lambda: bool(helm.gcs.all("LOG_ENTRY")), 2.0)
    helm.run(0.2)
    return {entry.id: (entry.size, entry.time_utc) for entry in helm.gcs.all("LOG_ENTRY")}


@pytest.mark.parametrize("persona", ["ardurover", "generic"])
def test_a_log_comes_whole_while_telemetry_flows_and_the_run_replays(tmp_path, log, persona):
    run_dir = tmp_path / "runs" / "now"
    budget = (
        "endpoints.0.budget_bytes_per_s=60000" if persona == "ardurover" else "endpoints.1.budget_bytes_per_s=60000"
    )
    helm = Helm(persona, f"record.directory={tmp_path / 'runs'}", budget, run_dir=run_dir)
    first = helm.shift
    found = listed(helm)
    assert found[first] == (len(log), BEGIN_S)
    assert set(found) == {first, first + 1}, "the earlier run, then this one"
    helm.gcs.clear()
    helm.send(dialect.MAVLink_log_request_data_message(1, 1, first, 0, 0xFFFFFFFF))
    took_s = helm.until(lambda: sum(m.count for m in helm.gcs.all("LOG_DATA")) >= len(log), 30.0)
    pieces = sorted((m.ofs, bytes(m.data[: m.count])) for m in helm.gcs.all("LOG_DATA"))
    assert b"".join(data for _, data in pieces) == log
    assert took_s > len(log) / 60_000 - 1.0, "no faster than the endpoint's budget"
    assert took_s < 2.5 * len(log) / 60_000
    assert len(helm.gcs.all("ATTITUDE")) > 3.0 * took_s, "telemetry takes turns with the download"
    helm.send(dialect.MAVLink_log_erase_message(1, 1))
    helm.until(lambda: "Logs of 1 earlier runs erased by station 255" in helm.texts(), 2.0)
    assert set(listed(helm)) >= {first}
    helm.world.shutdown(helm.world.now_us)
    kept = [record.frame.message_id for record in iterate((run_dir / "mavlink.tlog").read_bytes())]
    assert 118 in kept
    assert 120 not in kept, "a log in a log would push this run's own telemetry out"
    outcome = replay(run_dir)
    assert outcome.identical, summary(outcome, 1.0)


def test_an_armed_boat_keeps_its_logs(tmp_path, log):
    helm = Helm("ardurover", f"record.directory={tmp_path / 'runs'}", run_dir=tmp_path / "runs" / "now")
    helm.run(5.0)
    assert helm.command(400, 1.0) == 0
    helm.send(dialect.MAVLink_log_erase_message(1, 1))
    helm.until(lambda: "not erased while armed" in helm.texts(), 2.0)
    assert (tmp_path / "runs" / "earlier" / "mavlink.tlog").read_bytes() == log
    helm.world.shutdown(helm.world.now_us)


def test_an_erase_is_an_order_like_any_other(tmp_path, log):
    """Whoever was heard erased all logs, and nothing told who it was."""
    run_dir = tmp_path / "runs" / "now"
    helm = Helm("ardurover", f"record.directory={run_dir.parent}", 'operator.ids=["77"]', run_dir=run_dir)
    helm.send(dialect.MAVLink_log_erase_message(1, 1))
    helm.until(lambda: "Station 255 over gcs is no operator here" in helm.texts(), 2.0)
    assert (tmp_path / "runs" / "earlier" / "mavlink.tlog").read_bytes() == log
    helm.gcs.system = 77
    helm.gcs.codec = Codec(77, 190)
    helm.send(dialect.MAVLink_log_erase_message(1, 1))
    helm.until(lambda: "Logs of 1 earlier runs erased by station 77" in helm.texts(), 2.0)
    helm.run(1.0)
    helm.world.shutdown(helm.world.now_us)
    events = [json.loads(line) for line in (run_dir / "events.jsonl").read_text().splitlines()]
    orders = [item for item in events if item["event"] == "order" and item["order"] == "erase logs"]
    assert [(item["system"], item["link"], item["result"]) for item in orders] == [
        (255, "gcs", "REJECTED_NOW"),
        (77, "gcs", "ACCEPTED"),
    ]


def test_a_run_that_is_being_recorded_is_nobodys_to_erase(tmp_path, log):
    """Two vessels that shared a folder erased each other's logs under way."""
    helm = Helm("ardurover", f"record.directory={tmp_path / 'runs'}", run_dir=tmp_path / "runs" / "now")
    earlier = tmp_path / "runs" / "earlier"
    about = json.loads((earlier / "run.json").read_text())
    other = Recorder(tmp_path / "runs" / "other", free_floor_mb=0, about=about)
    other.frames(log)
    other.flush(0)
    helm.send(dialect.MAVLink_log_erase_message(1, 1))
    helm.until(lambda: "Logs of 1 earlier runs erased" in helm.texts(), 2.0)
    assert "1 left" in helm.texts()
    assert (other.run_dir / "mavlink.tlog").read_bytes() == log
    other.close(0)
    helm.send(dialect.MAVLink_log_erase_message(1, 1))
    helm.until(lambda: not (other.run_dir / "mavlink.tlog").exists(), 2.0)
    helm.world.shutdown(helm.world.now_us)


def test_a_list_asked_for_right_behind_an_erase_shows_what_is_left(tmp_path, log):
    helm = Helm("ardurover", f"record.directory={tmp_path / 'runs'}", run_dir=tmp_path / "runs" / "now")
    helm.send(dialect.MAVLink_log_erase_message(1, 1))
    assert set(listed(helm)) == {1}
    helm.world.shutdown(helm.world.now_us)


@pytest.mark.parametrize("profile", ["lora", "high_latency"])
def test_a_slow_link_says_that_there_are_none(profile):
    """An honest empty list ends the station's retries; no log crosses the radio."""

    class Forbidden:
        looked = 1

        def __getattr__(self, name):
            raise AssertionError(name)

    bench = Bench("ardurover", config=EndpointConfig(profile=profile))
    bench.vessel.logs = Forbidden()
    bench.tick()
    bench.send(dialect.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    bench.send(dialect.MAVLink_log_request_data_message(1, 1, 1, 0, 90))
    bench.send(dialect.MAVLink_log_erase_message(1, 1))
    bench.run(30.0)
    assert [entry.num_logs for entry in bench.gcs.all("LOG_ENTRY")] == [0]
    assert not bench.gcs.all("LOG_DATA")
