"""A boat on a straight course among simulated vessels: their bytes through the line reader into the traffic watch."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence

from companion.core.ais.receiver import AisWord, ReceivedReport
from companion.core.nmea import NmeaConfig, NmeaReader
from companion.core.traffic import Traffic, TrafficConfig
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import EstimatedState, Severity
from mavlink_bridge.language.traffic import OtherVessel, TrafficPicture
from sitl.traffic.target import Target, VesselText
from sitl.traffic.transmitter import AisText, Transmitter

START_UTC_US = 1_700_000_000_000_000
LAT_RAD, LON_RAD = math.radians(41.1852), math.radians(-8.7060)


class Sea:
    """``step`` moves everything by ``dt_s``; ``picture`` and ``texts`` are what the boat knows and says."""

    def __init__(
        self,
        vessels: Sequence[VesselText] = (),
        *,
        seed: int = 1,
        own_mps: float = 1.5,
        own_deg: float = 0.0,
        ais: AisText | None = None,
        config: TrafficConfig | None = None,
        knows_utc: bool = True,
        dt_s: float = 0.5,
    ) -> None:
        self.frame = LocalFrame(LAT_RAD, LON_RAD)
        self.targets = [Target(text, number) for number, text in enumerate(vessels)]
        self.air = [
            Transmitter(target, self.frame, ais or AisText(), random.Random(f"{seed}/{number}"))
            for number, target in enumerate(self.targets)
        ]
        self.reader = NmeaReader(NmeaConfig())
        self._heard: list[ReceivedReport | AisWord] = []
        self.traffic = Traffic(config or TrafficConfig())
        self.own_mps, self.own_rad = own_mps, math.radians(own_deg)
        self.north_m = self.east_m = 0.0
        self.time_s = 0.0
        self.dt_s = dt_s
        self.knows_utc = knows_utc
        self.texts: list[tuple[float, Severity, str]] = []
        self.picture: TrafficPicture = self.traffic.picture

    @property
    def now_us(self) -> int:
        return round(self.time_s * 1e6)

    @property
    def state(self) -> EstimatedState:
        lat_rad, lon_rad = self.frame.to_geodetic(self.north_m, self.east_m)
        return EstimatedState(
            self.now_us,
            lat_rad=lat_rad,
            lon_rad=lon_rad,
            x_m=self.north_m,
            y_m=self.east_m,
            vx_mps=self.own_mps * math.cos(self.own_rad),
            vy_mps=self.own_mps * math.sin(self.own_rad),
            psi_rad=self.own_rad,
            sog_mps=self.own_mps,
        )

    def hear(self, data: bytes) -> None:
        """Bytes on the receiver's line, now."""
        self.reader.receive(data, self.now_us)
        self._heard += self.reader.take_ais()

    def step(self) -> TrafficPicture:
        self.time_s += self.dt_s
        self.north_m += self.own_mps * math.cos(self.own_rad) * self.dt_s
        self.east_m += self.own_mps * math.sin(self.own_rad) * self.dt_s
        for target, air in zip(self.targets, self.air, strict=True):
            target.step(self.dt_s, (self.north_m, self.east_m, self.own_mps, 0.0))
            data = air.due(self.time_s, START_UTC_US + self.now_us)
            if data:
                self.hear(data)
        utc_us = START_UTC_US + self.now_us if self.knows_utc else None
        heard, self._heard = self._heard, []
        self.picture = self.traffic.step(self.now_us, self.state, utc_us, heard, line_alive=bool(heard))
        self.texts += [(self.time_s, *text) for text in self.traffic.drain_texts()]
        return self.picture

    def run(self, seconds: float, each: Callable[[], None] | None = None) -> TrafficPicture:
        end_s = self.time_s + seconds
        while self.time_s < end_s - 1e-9:
            self.step()
            if each is not None:
                each()
        return self.picture

    def vessel(self, number: int = 0) -> OtherVessel | None:
        mmsi = self.targets[number].mmsi
        return next((vessel for vessel in self.picture.vessels if vessel.mmsi == mmsi), None)

    def said(self, words: str) -> list[float]:
        return [at_s for at_s, _, text in self.texts if words in text]

    def off_m(self, number: int = 0) -> float | None:
        """How far a vessel is from where the boat believes her now."""
        vessel, target = self.vessel(number), self.targets[number]
        if vessel is None:
            return None
        north, east = self.frame.to_local(vessel.lat_rad, vessel.lon_rad)
        return math.hypot(north - target.north_m, east - target.east_m)
