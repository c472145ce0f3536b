"""Every order stands in the run's events with its sender, link, proof and outcome, and the report shows it."""

from __future__ import annotations

import html
import json
from pathlib import Path

import pytest

from companion.cli import main
from companion.replay import replay, summary
from mavlink_bridge.mavlink.wire.codec import dialect
from sitl.world import World
from tests.scenario.test_signed_links import ARM_BY_FORCE, DISARM_BY_FORCE, HEARTBEAT, Station, order, settings

STICKS = dialect.MAVLink_manual_control_message(1, 500, 0, 500, 0, 0)


def orders(run_dir: Path) -> list[dict[str, object]]:
    found = [json.loads(line) for line in (run_dir / "events.jsonl").read_text().splitlines()]
    return [item for item in found if item["event"] == "order"]


@pytest.fixture
def run_dir(tmp_path: Path) -> Path:
    """A signed station arms, steers and sets a parameter; an unsigned one on a trusted link orders too; a stranger is not heard."""
    found = settings(tmp_path, "record.enabled=true")
    mixed = tuple(
        item.model_copy(update={"link_class": "trusted" if item.name == "sdk" else "signed"})
        for item in found.endpoints
    )
    world = World(found.model_copy(update={"endpoints": mixed}), seed=3, run_dir=tmp_path / "run")
    world.run(5.0)
    genuine, plain = Station(world, "gcs"), Station(world, "sdk", key=None)
    stranger = Station(world, "tcp", key=None)
    order(genuine, ARM_BY_FORCE)
    genuine.send(dialect.MAVLink_set_mode_message(1, 1, 0))
    for _ in range(30):
        genuine.send(STICKS)
        genuine.send(HEARTBEAT)
        genuine.tick(2)
    stranger.send(DISARM_BY_FORCE)
    stranger.tick(5)
    genuine.send(dialect.MAVLink_param_set_message(1, 1, b"LOIT_RADIUS", 25.0, 9))
    genuine.send(dialect.MAVLink_mission_count_message(1, 1, 1, 1))
    genuine.tick(20)
    order(plain, dialect.MAVLink_command_long_message(1, 1, 176, 0, 1, 10, 0, 0, 0, 0, 0))
    order(plain, DISARM_BY_FORCE)
    world.run(1.0)
    world.shutdown(world.now_us)
    return tmp_path / "run"


def test_who_ordered_what_over_which_link_with_what_proof_and_what_came_of_it(run_dir: Path) -> None:
    found = orders(run_dir)
    first, last = found[0], found[-1]
    assert first | {"t_s": 0} == {
        "t_s": 0,
        "event": "order",
        "order": "arm by force",
        "result": "ACCEPTED",
        "system": 255,
        "component": 190,
        "link": "gcs",
        "host": first["host"],
        "proof": "signed",
    }
    assert 5.0 < float(str(first["t_s"])) < 6.0
    assert (last["order"], last["link"], last["proof"]) == ("disarm by force", "sdk", "unsigned")
    refused = next(item for item in found if str(item["order"]).startswith("set mode mode auto"))
    assert refused["result"] != "ACCEPTED"
    assert refused["reason"]
    assert [item["order"] for item in found if "set mode" in str(item["order"])][:1] == ["set mode mode manual"]
    parameter = next(item for item in found if "parameter" in str(item["order"]))
    assert "LOIT_RADIUS" in str(parameter["order"])
    assert all(item["link"] != "tcp" for item in found), "a stranger orders nothing"


def test_sticks_are_noted_when_they_begin_and_not_at_each_message(run_dir: Path) -> None:
    assert sum("manual" in str(item["order"]) and "mode" not in str(item["order"]) for item in orders(run_dir)) in (
        1,
        2,
    )


def test_the_report_shows_who_ordered_what(run_dir: Path) -> None:
    assert main(["report", str(run_dir)]) == 0
    page = html.unescape((run_dir / "report.html").read_text())
    assert "<h2>Orders</h2>" in page
    assert "station 255/190 over gcs" in page
    assert "(signed): arm by force - accepted" in page
    assert "(unsigned): disarm by force - accepted" in page


def test_the_run_replays(run_dir: Path) -> None:
    outcome = replay(run_dir)
    assert outcome.identical, summary(outcome, 1.0)
