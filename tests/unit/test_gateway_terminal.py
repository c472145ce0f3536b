"""What the gateway's terminal says: where stations connect, that there is no modem, that it came."""

from __future__ import annotations

import logging
import os
from pathlib import Path

import pytest

import config
from companion.cli import main
from companion.commands.status import Journal
from companion.gateway import HEARD_KEY, Gateway, GatewaySettings
from companion.io.clock import ManualClock
from companion.io.keeping import MemoryStore
from companion.io.keeping.content import SaveValue
from companion.io.keeping.keys import write_key
from companion.io.links import Received
from companion.io.links.mem import pair
from companion.settings.schema import EndpointSettings, load
from mavlink_bridge.language.messages import Severity
from sitl.gateway import with_gateway
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.gateways import gateway_beside


def test_a_missing_modem_is_told_once_and_where_stations_connect(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("companion.commands.gateway.SystemClock", ManualClock)
    caplog.set_level(logging.INFO)
    write_key(tmp_path / "radio.key", os.urandom(32))
    sets = [f"url=serial:{tmp_path}/tty?baud=9600", "store=", 'endpoints=[{name="gcs",url="udp://127.0.0.1:14997"}]']
    words = [word for item in sets for word in ("--set", item)]
    assert main(["gateway", str(config.path("gateway.toml")), "--duration", "60", *words]) == 0
    assert "stations: gcs      udp://127.0.0.1:14997  (ardurover)  MAVSDK: udpin://0.0.0.0:14997" in caplog.messages
    warnings = [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]
    warnings = [text for text in warnings if "modem" in text]  # a busy machine adds its own
    assert len(warnings) == 1
    assert warnings[0].startswith(f"modem is missing, tried again for ever: {tmp_path}/tty")
    assert warnings[0].endswith("No such file or directory)")


def test_no_airtime_is_spent_on_a_modem_that_is_not_there(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    write_key(tmp_path / "radio.key", os.urandom(32))
    modem, air = pair("modem")
    modem.unplug()
    settings = GatewaySettings(
        key_file=str(tmp_path / "radio.key"), endpoints=(EndpointSettings(name="gcs", url="mem:gcs"),)
    )
    gateway = Gateway(settings, modem=modem, make_link=lambda name, url: pair("gcs")[0])
    for tick in range(20 * 60):
        gateway.tick(tick * 50_000)
    spent_us = gateway.twin.link.ledger.used_us(60_000_000)
    assert spent_us < 1_000_000
    assert [text for text in caplog.messages if "modem" in text] == [
        f"modem is missing, tried again for ever: {modem.describe()}"
    ]
    modem.plug()
    for tick in range(20 * 60, 20 * 120):
        gateway.tick(tick * 50_000)
        air.poll(tick * 50_000)
    assert gateway.twin.link.ledger.used_us(120_000_000) > spent_us
    assert caplog.messages[-1].startswith("modem is there: ")


def test_who_waits_for_a_vessel_whose_hour_is_used_is_told_when_within_a_minute(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """On the original's channel; over a restart the gateway knows what it had heard of the vessel."""
    write_key(tmp_path / "radio.key", os.urandom(32))
    station = EndpointSettings(name="gcs", url="mem:gcs", persona="generic")
    settings = GatewaySettings(profile="n-0.1", key_file=str(tmp_path / "radio.key"), endpoints=(station,))
    near, far = pair("gcs")
    store = MemoryStore()
    store.submit(SaveValue(HEARD_KEY, "[[1800,1500000]]"))
    store.completions()
    gateway = Gateway(settings, modem=pair("modem")[0], make_link=lambda name, url: near, store=store)
    heard = b""
    for tick in range(20 * 60):
        gateway.tick(tick * 50_000)
        heard += b"".join(event.data for event in far.poll(tick * 50_000) if isinstance(event, Received))
    told = "Radio: no word of the vessel. If it is on, its airtime of this hour is used: it is shown in 30 min at the latest"
    assert told in caplog.messages
    assert b"no word of the vessel" in heard


def test_the_gateways_journal_has_what_the_vessel_says_over_the_air(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """What comes next and what ends it crosses the radio as a text; mode and arming come with the state."""
    caplog.set_level(logging.INFO)
    settings = with_gateway(load(config.path("sim.toml"), ["radio.profile=o-10"], SimSettings), tmp_path)
    world = World(settings, 1)
    near, _ = pair("gcs")
    gateway = gateway_beside(world, tmp_path, near, seed=2)
    gateway.view = Journal().update
    foretold = "RETURN in 60 s; until ground station is back, then order Auto"
    for number in range(40 * 20):
        world.step()
        if number == 400:
            world.app.controls.voice.say(Severity.WARNING, foretold)
        gateway.tick(world.now_us)
    said = [text for text in caplog.messages if text.startswith("warning: RETURN in 60 s; until ground sta")]
    assert len(said) == 1
    assert said[0].endswith("then order Auto")
    assert "mode Hold, disarmed" in caplog.messages
    world.shutdown(world.now_us)


@pytest.mark.parametrize(("only", "instance"), [([], 40), (["--world-only"], 41)])
def test_the_simulators_gateway_says_where_its_stations_connect(
    only: list[str], instance: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = [
        "--duration",
        "0.3",
        "--run-dir",
        str(tmp_path / "run"),
        "--set",
        "endpoints=[]",
        "--instance",
        str(instance),
    ]
    assert main(["sim", "--gateway", *only, *words]) == 0
    said = capsys.readouterr().out
    port = 14560 + 10 * instance
    assert f"gateway  udp://127.0.0.1:{port}  (ardurover)  MAVSDK: udpin://0.0.0.0:{port}" in said
    assert "or 'companion sim --gateway'" not in said


def test_a_plan_goes_to_the_vessel_and_not_to_its_world(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["sim", "--world-only", "--start", "--plan", "x.plan"]) == 2
    assert "--world-only: --plan goes to the vessel" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
