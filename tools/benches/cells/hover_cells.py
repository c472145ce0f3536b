"""Station keeping measured on the truth: how near, how much turning, how much thrust. One run each."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from companion.core.guide import GuidanceConfig
from companion.core.guide.station import StationConfig
from mavlink_bridge.language.figures import Hover
from mavlink_bridge.language.messages import Loiter
from mavlink_bridge.language.units import wrap_pi

from .control_cells import Case

_FULL = 0.9


@dataclass(frozen=True, slots=True)
class Held:
    """One run of keeping station; distances, turning and full thrust after the settling time, power over all of it."""

    rms_m: float
    most_m: float
    swept_deg: float
    """Widest apart that two headings were, turns counted."""
    full_share: float
    """Share of the time in which a propeller was asked for more than nine tenths."""
    power: float
    """Mean cube of the commands: what the propellers take, over full power."""
    furthest_m: float
    """From the start on."""


def held(case: Case, mode: str = "weathervane", seconds: float = 400.0, settle_s: float = 100.0) -> Held:
    """Hold a point from rest on it, bow to the north, in the case's water."""
    station = StationConfig.model_validate({**case.guidance.station.model_dump(), "mode": mode})
    guidance = GuidanceConfig.model_validate({**case.guidance.model_dump(), "station": station.model_dump()})
    run = replace(case, guidance=guidance).loop()
    run.place(0.0, 0.0, 0.0)
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=Hover()))
    distances: list[float] = []
    turned, last, turns = 0.0, run.vessel.psi_rad, [0.0]
    full = power = furthest_m = 0.0
    while run.t_s < seconds:
        run.tick(1.5)
        turned += wrap_pi(run.vessel.psi_rad - last)
        last = run.vessel.psi_rad
        away_m = math.hypot(run.vessel.north_m, run.vessel.east_m)
        furthest_m = max(furthest_m, away_m)
        assert run.sent is not None
        sizes = (abs(run.sent.thruster_port), abs(run.sent.thruster_starboard))
        power += 0.5 * (sizes[0] ** 3 + sizes[1] ** 3)
        if run.t_s > settle_s:
            distances.append(away_m)
            turns.append(turned)
            full += max(sizes) > _FULL
    rms = math.sqrt(math.fsum(value * value for value in distances) / len(distances))
    swept = math.degrees(max(turns[1:]) - min(turns[1:]))
    return Held(
        rms_m=rms,
        most_m=max(distances),
        swept_deg=swept,
        full_share=full / len(distances),
        power=power / run.ticks,
        furthest_m=furthest_m,
    )
