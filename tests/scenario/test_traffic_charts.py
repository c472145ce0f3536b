"""Other vessels on ground stations' charts: AIS bytes of simulated ships, the whole boat, MAVProxy's module and QGroundControl's list."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest

import config
from companion.io.links.link import Received
from companion.settings.schema import load
from mavlink_bridge.mavlink.wire.codec import decode
from mavlink_bridge.mavlink.wire.framing import Deframer
from sitl.traffic import VesselText
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.traffic_stations import MavProxyChart, QgcChart

ANCHORED, SLOW, SHIP, SILENT = 244_000_001, 265_000_002, 244_000_003, 244_000_004
SILENT_FROM_S = 30.0
VESSELS = (
    VesselText(mmsi=ANCHORED, name="AT ANCHOR", status=1, north_m=500, east_m=200, length_m=60),
    VesselText(mmsi=SLOW, name="DRIFTER", ais="B", north_m=-400, east_m=300, speed_mps=0.4),
    VesselText(mmsi=SHIP, name="MV EXAMPLE", north_m=1500, east_m=-600, course_deg=180, speed_mps=2.0, length_m=90),
    VesselText(
        mmsi=SILENT,
        name="GONE DARK",
        north_m=800,
        east_m=800,
        course_deg=45,
        speed_mps=4,
        silent=({"from_s": SILENT_FROM_S, "to_s": 1e6},),
    ),
)
LIFE_S, WATCHED_S = 200.0, 370.0
"""A track's life, shorter than by default, and long enough a time for a chart to forget after it."""


class Watch:
    """One boat at its place, four others, three charts; time goes on in ticks of 50 ms."""

    def __init__(self, monkeypatch: Any) -> None:
        settings = load(config.path("sim.toml"), [f"traffic.track_life_s={LIFE_S}"], SimSettings)
        settings = settings.model_copy(update={"world": settings.world.model_copy(update={"vessels": VESSELS})})
        self.world = World(settings, 1)
        self.link = self.world.ground("gcs")
        self.charts: dict[str, Any] = {
            "mavproxy": MavProxyChart(monkeypatch),
            "qgc": QgcChart(server_setting=False),
            "qgc with its server setting": QgcChart(server_setting=True),
        }
        self.places: dict[str, list[tuple[float, int, tuple[int, int]]]] = {"AIS_VESSEL": [], "ADSB_VEHICLE": []}
        """When whose place came, by message."""
        self.on_chart: dict[str, dict[int, list[float]]] = {name: {} for name in self.charts}
        """First and last moment at which a chart showed a vessel."""
        self.blinked: list[tuple[str, int, float]] = []

    @property
    def now_s(self) -> float:
        return self.world.now_us * 1e-6

    def reports_s(self, mmsi: int) -> list[float]:
        """When a vessel's reports were on the boat's wire."""
        (air,) = (air for air in self.world.surroundings.fleet.air if air._target.mmsi == mmsi)
        return [at_s for at_s in air.heard_s if at_s <= self.now_s]

    def run(self, seconds: float) -> None:
        deframer = Deframer()
        while self.now_s < seconds:
            self.world.step()
            for event in self.link.poll(self.world.now_us):
                for frame in deframer.receive(event.data, self.world.now_us) if isinstance(event, Received) else ():
                    message = decode(frame)
                    if message is not None and message.get_type() in self.places:
                        self._hear(message)
            for name, chart in self.charts.items():
                chart.turn(self.now_s)
                self._look(name, chart)

    def _hear(self, message: Any) -> None:
        who = message.MMSI if message.get_type() == "AIS_VESSEL" else message.ICAO_address
        self.places[message.get_type()].append((self.now_s, who, (message.lat, message.lon)))
        for chart in self.charts.values():
            chart.hear(message)

    def _look(self, name: str, chart: Any) -> None:
        for mmsi in chart.shown:
            seen = self.on_chart[name].setdefault(mmsi, [self.now_s, self.now_s])
            if self.now_s - seen[1] > 0.06:
                self.blinked.append((name, mmsi, self.now_s))
            seen[1] = self.now_s


@pytest.fixture(scope="module")
def watch() -> Iterator[Watch]:
    with pytest.MonkeyPatch.context() as monkeypatch:
        made = Watch(monkeypatch)
        made.run(WATCHED_S)
        yield made


def test_every_report_is_on_every_chart_within_a_second(watch: Watch) -> None:
    for mmsi in (ANCHORED, SLOW, SHIP, SILENT):
        heard = watch.reports_s(mmsi)
        assert heard
        for at_s in heard:
            for name in ("AIS_VESSEL", "ADSB_VEHICLE"):
                after = [t_s for t_s, who, _ in watch.places[name] if who == mmsi and t_s >= at_s]
                assert after, (mmsi, name, at_s)
                assert min(after) - at_s <= 1.0, (mmsi, name, at_s)
        for name in watch.charts:
            assert watch.on_chart[name][mmsi][0] - heard[0] <= 1.0, (name, mmsi)


def test_a_vessel_at_anchor_stays_on_every_chart(watch: Watch) -> None:
    """She speaks every three minutes; MAVProxy forgets after one, QGroundControl takes nothing older than 15 s."""
    assert len(watch.reports_s(ANCHORED)) <= 3
    for name in watch.charts:
        for mmsi in (ANCHORED, SLOW):
            assert watch.on_chart[name][mmsi][1] >= WATCHED_S - 0.1, (name, mmsi)
    assert watch.blinked == []


def test_ghosts_end_as_far_as_the_station_allows(watch: Watch) -> None:
    """MAVProxy forgets a minute after the boat does. QGroundControl is told nothing once her place is not sure; it takes her away
    with its server setting on, and never with it off: no message can."""
    heard_s = watch.reports_s(SILENT)[-1]
    assert heard_s <= SILENT_FROM_S + 2.0
    on_chart = watch.on_chart
    assert SILENT not in watch.charts["mavproxy"].shown
    assert on_chart["mavproxy"][SILENT][1] - heard_s <= LIFE_S + 63.0
    assert SILENT not in watch.charts["qgc with its server setting"].shown
    assert on_chart["qgc with its server setting"][SILENT][1] - heard_s <= LIFE_S + 125.0
    assert SILENT in watch.charts["qgc"].shown
    last = max(t_s for t_s, who, _ in watch.places["ADSB_VEHICLE"] if who == SILENT)
    north_m, east_m = watch.world.surroundings.plant.frame.to_local(
        *(math.radians(degrees) for degrees in watch.charts["qgc"].shown[SILENT]["place"])
    )
    gone_s = last - heard_s
    assert math.hypot(north_m - 800.0, east_m - 800.0) <= 4.0 * (gone_s + SILENT_FROM_S + 5.0) + 100.0


def test_qgroundcontrol_shows_names_and_which_way_they_go(watch: Watch) -> None:
    shown = watch.charts["qgc"].shown
    assert {mmsi: each["label"] for mmsi, each in shown.items()} == {
        ANCHORED: "AT ANCHO",
        SLOW: "DRIFTER",
        SHIP: "MV EXAMP",
        SILENT: "GONE DAR",
    }
    assert shown[SHIP]["heading"] == pytest.approx(180.0, abs=6.0)
