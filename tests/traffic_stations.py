"""Two charts that show other vessels: MAVProxy's own ais module, and QGroundControl's list of aircraft by its rules.

MAVProxy's module is the real one, on a clock that a test turns. QGroundControl's rules were read in its source (master of May 2026,
src/ADSB): what it drops, when it shows a name, and that it takes nobody away unless its ADS-B server setting is on.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

from MAVProxy.modules import mavproxy_ais
from MAVProxy.modules.lib import mp_module
from pymavlink import mavutil


class Clock:
    """What stands for the module ``time`` in pymavlink and MAVProxy."""

    def __init__(self) -> None:
        self.now_s = 1_700_000_000.0

    def time(self) -> float:
        return self.now_s


class MavProxyChart:
    """MAVProxy's ais module as loaded by ``module load ais``, without a map window."""

    def __init__(self, monkeypatch: Any) -> None:
        self.clock = Clock()
        monkeypatch.setattr(mavutil, "time", self.clock)
        monkeypatch.setattr(mp_module, "time", self.clock)
        state = SimpleNamespace(public_modules={}, modules=[], command_map={}, completions={}, completion_functions={})
        state.start_time_s, state.is_sitl = self.clock.now_s, False
        self.module = mavproxy_ais.init(state)

    def hear(self, message: Any) -> None:
        self.module.mavlink_packet(message)

    def turn(self, now_s: float) -> None:
        self.clock.now_s = 1_700_000_000.0 + now_s
        self.module.idle_task()

    @property
    def shown(self) -> dict[int, Any]:
        """What is on the chart: the newest AIS_VESSEL by number."""
        return {int(name.removeprefix("AIS-")): each.state for name, each in self.module.threat_vehicles.items()}


class QgcChart:
    """QGroundControl's ADSBVehicleManager and the symbol that it draws."""

    GONE_S = 120.0
    TSLC_MOST_S = 15
    PLACE, ALTITUDE, HEADING, CALLSIGN = 1, 2, 4, 16

    def __init__(self, *, server_setting: bool) -> None:
        self._cleans = server_setting
        """The timer that removes the stale starts with the server's thread only."""
        self._now_s = 0.0
        self.shown: dict[int, dict[str, Any]] = {}

    def hear(self, message: Any) -> None:
        if message.get_type() != "ADSB_VEHICLE" or message.tslc > self.TSLC_MOST_S:
            return
        known = self.shown.get(message.ICAO_address)
        if known is None:
            if not message.flags & self.PLACE:
                return
            known = self.shown[message.ICAO_address] = {"altitude": math.nan, "label": ""}
        if message.flags & self.PLACE:
            known["place"] = message.lat * 1e-7, message.lon * 1e-7
        if message.flags & self.ALTITUDE:
            known["altitude"] = message.altitude * 1e-3
        if message.flags & self.HEADING:
            known["heading"] = message.heading * 1e-2
        if message.flags & self.CALLSIGN and not math.isnan(known["altitude"]):
            known["label"] = message.callsign.rstrip("\0")
        known["at_s"] = self._now_s

    def turn(self, now_s: float) -> None:
        self._now_s = now_s
        if self._cleans:
            self.shown = {number: each for number, each in self.shown.items() if now_s - each["at_s"] <= self.GONE_S}
