"""A sea trial in simulated water, and what its record teaches: trial, fit and judgement of the fitted file by the true hull."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from companion.core.hull import Handling, VesselConfig
from companion.core.hull.statics import stopping_distance_m
from companion.core.steer import SteeringConfig, manual_demand
from companion.core.trial import Trial, TrialConfig, TrialStanding
from companion.io.recording.recorder import fix_fields
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import ActuatorDemand, ActuatorOutput, EstimatedState, Hover, Loiter
from sitl.plant import SimVessel, WaterConfig
from tools.benches.cells.control_loop import ORIGIN_RAD, ControlLoop, Setup, StateSource

COLUMNS = (
    "t_s,armed,heading_deg,speed_mps,yaw_rate_dps,lat_deg,lon_deg,"
    "thruster_port,thruster_starboard,rudder_port_deg,rudder_starboard_deg,fix_n_mps,fix_e_mps,fix_age_s"
)
"""Those of control.csv that a fit reads."""
_CRUISE_MPS = 1.5
"""As in the shipped settings: the way back is sailed by it."""
_STEADY_STEPS, _STEADY_DT_S = 1200, 0.02
"""24 s: a launch of 350 kg moves evenly after ten."""


COEFFICIENTS = (
    *(("hull", key) for key in ("xu", "xuu", "yv", "yvv", "nr", "nrr", "nur", "m22_kg", "m33_kgm2", "m23_kgm", "munk")),
    *(("thruster", key) for key in ("ahead_n", "astern_n", "lag_s", "dead_band")),
    *(("rudder", key) for key in ("area_m2", "lag_s")),
)
"""Table and key of what a vessel file can be wrong about."""
_SOME_MUNK = 0.3
"""A file that says nothing of it is wrong about this much."""


@dataclass(frozen=True, slots=True)
class Trialled:
    """How a trial went."""

    told: TrialStanding
    texts: list[str]
    seconds: float
    furthest_m: float


def sail_trial(
    vessel: VesselConfig,
    water: WaterConfig,
    config: TrialConfig,
    file: Path,
    *,
    belief: VesselConfig | None = None,
    seed: int = 1,
    source: StateSource | None = None,
    plant: Callable[[VesselConfig], SimVessel] = SimVessel,
) -> Trialled:
    """Sail a whole trial, confirmed after the first group of manoeuvres, and write its record. ``plant`` makes the hull.

    As aboard: all that is known of the vessel is ``belief``, and between two manoeuvres the law brings her back by it.
    """
    believed = belief or vessel
    loop = ControlLoop(Setup(vessel, water, belief=believed, seed=seed, plant=plant), source)
    loop.place(0.0, 0.0, 0.0)
    handling = Handling(believed)
    trial = Trial(config, loop.state, turns_at_rest=handling.model.turns_at_rest, turns_away=handling.turns_away)
    middle = Loiter(-1, *loop.frame.to_geodetic(0.0, 0.0), figure=Hover())
    rows, texts, furthest_m, homeward = [COLUMNS], list[str](), 0.0, False
    while True:
        if trial.progress[0] == 1:
            trial.confirm()
        state = loop.state
        out = trial.step(loop.now_us, state, stopping_distance_m(believed, state.sog_mps or 0.0))
        texts += out.texts
        if out.home and not homeward:
            loop.sail(middle)
        homeward = out.home
        if homeward:
            loop.tick(_CRUISE_MPS)
        else:
            mixed = not out.rudders_alone
            loop.by_sticks(manual_demand(loop.now_us, out.surge, out.yaw, SteeringConfig(), believed, mixed=mixed))
        rows.append(_row(loop.t_s, state, loop.sent))
        furthest_m = max(furthest_m, math.hypot(loop.vessel.north_m, loop.vessel.east_m))
        if out.told is not TrialStanding.RUNNING:
            file.write_text("\n".join(rows) + "\n", encoding="utf-8")
            return Trialled(out.told, texts, loop.t_s, furthest_m)


def _row(t_s: float, state: EstimatedState, sent: ActuatorOutput | None) -> str:
    if sent is None or state.x_m is None or state.y_m is None or state.psi_rad is None or state.u_mps is None:
        return f"{t_s:.3f},1" + "," * 12
    lat, lon = map(math.degrees, LocalFrame(*ORIGIN_RAD).to_geodetic(state.x_m, state.y_m))
    heading, rate = math.degrees(state.psi_rad) % 360.0, math.degrees(state.r_radps or 0.0)
    rudders = f"{math.degrees(sent.rudder_port_rad):.3f},{math.degrees(sent.rudder_starboard_rad):.3f}"
    thrusters = f"{sent.thruster_port:.4f},{sent.thruster_starboard:.4f}"
    motion = f"{heading:.4f},{state.u_mps:.4f},{rate:.4f},{lat:.9f},{lon:.9f}"
    return f"{t_s:.3f},1,{motion},{thrusters},{rudders},{fix_fields(state)}"


def wrong(vessel: VesselConfig, seed: int, most: float = 0.5) -> VesselConfig:
    """Return a file of which every coefficient is off by up to so much, but the mass scale, which no motion tells.

    Of rudders that stand off and of unlike sides it knows nothing.
    """
    dice = random.Random(f"wrong {seed}")
    tables: dict[str, dict[str, float]] = {
        "hull": {},
        "thruster": {"starboard_share": 1.0},
        "rudder": {"offset_deg": 0.0},
    }
    for table, key in COEFFICIENTS:
        right = getattr(getattr(vessel, table), key)
        if key == "munk":
            right = right or _SOME_MUNK
        tables[table][key] = _off(key, right, 1.0 + dice.uniform(-most, most))
    return vessel.model_copy(
        update={table: getattr(vessel, table).model_copy(update=values) for table, values in tables.items()}
    )


def one_wrong(vessel: VesselConfig, table: str, key: str, factor: float) -> VesselConfig:
    """Return a file of which one of ``COEFFICIENTS`` is so many times what is right."""
    part = getattr(vessel, table)
    return vessel.model_copy(update={table: part.model_copy(update={key: _off(key, getattr(part, key), factor)})})


def _off(key: str, right: float, factor: float) -> float:
    """A share of an ideal moment is no more than all of it."""
    return min(1.0, factor * right) if key == "munk" else factor * right


def turn_rate(
    vessel: VesselConfig, throttle: float, helm: float, plant: Callable[[VesselConfig], SimVessel] = SimVessel
) -> float:
    """Return the steady yaw rate, rad/s, of an operator's sticks in still water."""
    return steady(plant(vessel), manual_demand(0, throttle, helm, SteeringConfig(), vessel)).r_radps


def steady(hull: SimVessel, demand: ActuatorDemand) -> SimVessel:
    """Sail a hull with unchanged sticks in still water, until it moves evenly."""
    for _ in range(_STEADY_STEPS):
        hull.step(
            _STEADY_DT_S,
            demand.thruster_port,
            demand.thruster_starboard,
            rudder_port_rad=demand.rudder_port_rad,
            rudder_starboard_rad=demand.rudder_starboard_rad,
        )
    return hull
