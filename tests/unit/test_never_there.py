"""What never was there raises no alarm, and what is unplugged is told once: a vessel without board and compass, and with them pulled."""

from __future__ import annotations

from pathlib import Path

import config
from companion.build import build_app
from companion.commands.status import panel
from companion.settings.schema import Settings, load
from companion.status import picture_of
from mavlink_bridge.language.messages import LogText, Severity
from tests.world_station import Helm

TICK_US = 50_000


def texts_of_a_start(tmp_path: Path, seconds: float = 20.0) -> list[LogText]:
    """What an operator reads when a boat is started with nothing plugged in."""
    settings = load(
        config.path("boat.toml"),
        [
            f'actuators.url="serial:{tmp_path}/no-board"',
            f'sensors=[{{name="compass",url="serial:{tmp_path}/no-compass"}}]',
            'store=""',
            "endpoints=[]",
        ],
        Settings,
    )
    app = build_app(settings)
    found: list[LogText] = []
    for now_us in range(TICK_US, round(seconds * 1e6), TICK_US):
        snapshot = app.tick(now_us)
        assert snapshot is not None
        found += snapshot.texts
    app.shutdown(round(seconds * 1e6))
    return found


def test_a_start_with_nothing_plugged_in_raises_no_alarm(tmp_path: Path) -> None:
    alarms = [text.text for text in texts_of_a_start(tmp_path) if text.severity <= Severity.ERROR]
    assert alarms == []


def test_a_start_with_nothing_plugged_in_says_why_it_cannot_be_armed(tmp_path: Path) -> None:
    settings = load(
        config.path("boat.toml"), [f'actuators.url="serial:{tmp_path}/no"', 'store=""', "endpoints=[]"], Settings
    )
    app = build_app(settings)
    for now_us in range(TICK_US, 3_000_000, TICK_US):
        snapshot = app.tick(now_us)
    assert snapshot is not None
    assert not snapshot.health.prearm_ok
    assert any("actuator" in reason for reason in snapshot.health.prearm_reasons)
    app.shutdown(3_000_000)


def test_an_unplugged_compass_is_one_text() -> None:
    helm = Helm("ardurover", "operator.gcs_required=false")
    helm.run(8.0)
    helm.gcs.inbox.clear()
    sensors = helm.world.surroundings.plant.sensors
    real, sensors.step = sensors.step, lambda now_us, truth: []
    helm.run(12.0)
    about = [text for text in helm.texts().splitlines() if "compass" in text.lower() or "nmea" in text.lower()]
    assert len(about) == 1, about
    assert "nothing heard" in about[0]
    sensors.step = real
    helm.run(5.0)
    again = [text for text in helm.texts().splitlines() if "sentences again" in text]
    assert len(again) == 1


def test_no_row_of_the_panel_contradicts_another() -> None:
    helm = Helm("ardurover", "operator.gcs_required=false")
    helm.run(8.0)
    shown = {label: text for label, text, _ in panel(picture_of(helm.world.app.snapshot), 120, 40)}
    assert "RTK FIXED" in shown["Position"]
    sensors = helm.world.surroundings.plant.sensors
    sensors.step = lambda now_us, truth: []
    helm.run(5.0)
    shown = {label: text for label, text, _ in panel(picture_of(helm.world.app.snapshot), 120, 40)}
    assert "no position" in shown["Position"]
    assert "RTK" not in shown["Position"]
    assert "no receiver heard" in shown["Position"]
