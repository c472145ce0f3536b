"""An encounter sailed by a boat that only watches: its AIS bytes into the real reader and the real traffic watch, judged against the truth.

The boat keeps its course and speed, as policy `tell` does; hull and control are left out, so that thousands take minutes. The same vessels
sail against the whole vessel as a scenario's ``[[vessel]]``.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from typing import Final

from companion.core.nmea import NmeaConfig, NmeaReader
from companion.core.traffic import Traffic, TrafficConfig
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.traffic import Danger, Role

from ..plant.truth import SIM_UTC_START_US
from .fleet import Fleet
from .score import Scorer, VesselTruth, true_role
from .sets import Encounter
from .transmitter import AisText

STEP_S: Final = 0.5
TRACK_S: Final = 5.0
"""Between two points of an outcome's tracks."""
_ORIGIN: Final = (math.radians(41.1850123), math.radians(-8.7062154))
_WANDER_RAD: Final = math.radians(1.5)
"""How a boat on a leg yaws about its course."""
_ROLES: Final = {
    Role.HEAD_ON: "head-on",
    Role.GIVE_WAY: "give way",
    Role.STAND_ON: "stand on",
    Role.OVERTAKING: "overtaking",
    Role.OVERTAKEN: "overtaken",
    Role.OBSTACLE: "obstacle",
    Role.NONE: "none",
}


@dataclass(slots=True)
class ToldVessel:
    """What the boat told of one vessel, and what was true."""

    truth: VesselTruth
    told_s: float | None = None
    close_s: float | None = None
    """When she was told as close."""
    role: str = ""
    true_role: str = ""
    grey: bool = False
    heard_s: tuple[float, ...] = ()
    """When her position reports came."""


@dataclass(slots=True)
class EncounterOutcome:
    """An encounter that was sailed."""

    encounter: Encounter
    told: list[ToldVessel]
    tracks: list[list[tuple[float, float]]]
    """Places every ``TRACK_S``, ours first, m."""

    @property
    def collision(self) -> bool:
        return any(each.truth.collision for each in self.told)

    @property
    def least_m(self) -> float:
        return min((each.truth.least_m for each in self.told), default=math.inf)


def sail(
    encounter: Encounter, *, ais: AisText | None = None, config: TrafficConfig | None = None, extra_s: float = 0.0
) -> EncounterOutcome:
    """Sail the leg and return what was told and what was true. ``extra_s``: go on watching after the leg."""
    frame = LocalFrame(*_ORIGIN)
    fleet = Fleet(encounter.vessels, ais or AisText(), frame, encounter.seed)
    scorer = Scorer(fleet.targets, encounter.own_mps)
    told = [ToldVessel(truth) for truth in scorer.truths]
    reader, traffic = NmeaReader(NmeaConfig()), Traffic(config or TrafficConfig())
    rng, north, yaw = random.Random(f"{encounter.seed}/own"), 0.0, 0.0
    tracks: list[list[tuple[float, float]]] = [[] for _ in range(len(told) + 1)]
    for step in range(round((encounter.leg_m / encounter.own_mps + extra_s) / STEP_S)):
        now_s = (step + 1) * STEP_S
        now_us, speed = round(now_s * 1e6), encounter.own_mps
        north += speed * STEP_S
        yaw += 0.1 * (rng.gauss(0.0, _WANDER_RAD * 2.0) - yaw)
        data = fleet.step(now_us, SIM_UTC_START_US + now_us, (north, 0.0, speed, 0.0))
        if data:
            reader.receive(data, now_us)
        scorer.step(now_s, (north, 0.0), (speed, 0.0))
        lat_rad, lon_rad = frame.to_geodetic(north, 0.0)
        state = EstimatedState(
            now_us, lat_rad, lon_rad, x_m=north, y_m=0.0, vx_mps=speed, vy_mps=0.0, psi_rad=yaw, sog_mps=speed
        )
        picture = traffic.step(now_us, state, SIM_UTC_START_US + now_us, reader.take_ais())
        dangers = {vessel.mmsi: vessel for vessel in picture.vessels if vessel.danger is not Danger.NONE}
        for target, each in zip(fleet.targets, told, strict=True):
            vessel = dangers.get(target.mmsi)
            if vessel is not None and vessel.danger is Danger.CLOSE and each.close_s is None:
                each.close_s = now_s
            if vessel is not None and each.told_s is None:
                each.told_s, each.role = now_s, _ROLES[vessel.role]
                each.true_role, each.grey = true_role(target, (north, 0.0), 0.0, speed)
        if step % round(TRACK_S / STEP_S) == 0:
            places = [(north, 0.0), *((target.north_m, target.east_m) for target in fleet.targets)]
            for track, place in zip(tracks, places, strict=True):
                track.append(place)
    for each, air in zip(told, fleet.air, strict=True):
        each.heard_s = tuple(air.heard_s)
    return EncounterOutcome(encounter, told, tracks)
