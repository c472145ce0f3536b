"""The vessel as python-control sees it: the same file and the same force functions as the simulator's, as ``nlsys``,
linearised at a speed, with the steering law's own allocation in front of it.

Needs the ``design`` extra; ``control`` is imported when a function is called.
"""

from __future__ import annotations

import functools
import math
from typing import Any

from ..core.hull import ForceModel, VesselConfig
from ..core.hull.statics import drag_n, top_speed_mps
from ..core.hull.thrust import ThrustLaw
from ..core.steer.allocation import Allocator

STATES = ("u", "v", "r", "psi", "revs_port", "revs_starboard", "rudder")


def vessel_system(vessel: VesselConfig) -> Any:
    """Return the boat as an ``nlsys``: inputs port, starboard (-1...1) and rudder (rad); the seven states as outputs."""
    import control

    model = ForceModel(vessel)

    def update(_t: float, x: Any, inputs: Any, _params: Any) -> list[float]:
        return derivatives(
            vessel, model, x, port=float(inputs[0]), starboard=float(inputs[1]), rudder_rad=float(inputs[2])
        )

    return control.nlsys(
        update,
        None,
        inputs=["port", "starboard", "rudder"],
        outputs=list(STATES),
        states=list(STATES),
        name=vessel.name,
    )


def derivatives(
    vessel: VesselConfig, model: ForceModel, x: Any, port: float, starboard: float, rudder_rad: float
) -> list[float]:
    """Return the time derivatives of STATES in still water."""
    u, v, r, _, revs_port, revs_starboard, angle = (float(value) for value in x)
    law = _propellers(vessel)
    thrusts = [law.thrust_n(side, revs, u) for side, revs in ((0, revs_port), (1, revs_starboard))]
    du, dv, dr = model.rates(
        u,
        v,
        r,
        thrust_port_n=thrusts[0],
        thrust_starboard_n=thrusts[1],
        rudder_port_rad=angle,
        rudder_starboard_rad=angle,
    )
    lag_s, most = max(vessel.rudder.lag_s, 0.02), math.radians(vessel.rudder.rate_dps)
    turn = max(-most, min(most, (rudder_rad + vessel.rudder.offset_rad - angle) / lag_s))
    spin = [
        (law.revs(command) - revs) / vessel.thruster.lag_s
        for command, revs in ((port, revs_port), (starboard, revs_starboard))
    ]
    return [du, dv, dr, r, spin[0], spin[1], turn]


@functools.lru_cache(maxsize=64)
def _propellers(vessel: VesselConfig) -> ThrustLaw:
    """Without the dead band, which has no slope: a boat that cruises inside it would seem to have no propellers."""
    return ThrustLaw(vessel.model_copy(update={"thruster": vessel.thruster.model_copy(update={"dead_band": 0.0})}))


def cruise_command(vessel: VesselConfig, speed_mps: float) -> float:
    """Return the thruster command that holds a speed through the water."""
    law = _propellers(vessel)
    return law.command(0, drag_n(vessel, speed_mps) * law.sides[0].ahead_n / law.all_ahead_n, speed_mps)


def reachable(vessel: VesselConfig, speeds: tuple[float, ...]) -> tuple[float, ...]:
    """Return the speeds up to nine tenths of the greatest; beyond, nothing is left to steer with."""
    top = top_speed_mps(vessel)
    return tuple(speed for speed in speeds if speed <= 0.9 * top)


@functools.lru_cache(maxsize=64)
def moment_plant(vessel: VesselConfig, speed_mps: float) -> Any:
    """Return yaw moment wanted of the allocation -> (psi, r), linear at a speed: 7 states, 1 input, 2 outputs."""
    import control

    model = ForceModel(vessel)
    allocator = Allocator(vessel, model)
    surge_n = drag_n(vessel, speed_mps)

    def update(_t: float, x: Any, inputs: Any, _params: Any) -> list[float]:
        given = allocator.allocate(surge_n, float(inputs[0]), speed_mps)
        return derivatives(
            vessel, model, x, port=given.thruster_port, starboard=given.thruster_starboard, rudder_rad=given.rudder_rad
        )

    def seen(_t: float, x: Any, _inputs: Any, _params: Any) -> list[float]:
        return [float(x[3]), float(x[2])]

    system = control.nlsys(
        update, seen, inputs=["moment"], outputs=["psi", "r"], states=list(STATES), name="moment_to_yaw"
    )
    return control.linearize(system, _trim(vessel, speed_mps), [0.0], eps=1e-4)


@functools.lru_cache(maxsize=64)
def share_plant(vessel: VesselConfig, speed_mps: float, thruster_share: float) -> Any:
    """Return the seed law's heading output -> psi, linear at a speed, for a thruster share."""
    import control

    model = ForceModel(vessel)
    command = cruise_command(vessel, speed_mps)
    rudder_max = vessel.rudder.max_rad if vessel.rudder.count else 0.0

    def update(_t: float, x: Any, inputs: Any, _params: Any) -> list[float]:
        output = float(inputs[0])
        half, angle = thruster_share * output, (1.0 - thruster_share) * output * rudder_max
        return derivatives(vessel, model, x, port=command + half, starboard=command - half, rudder_rad=angle)

    def seen(_t: float, x: Any, _inputs: Any, _params: Any) -> list[float]:
        return [float(x[3])]

    system = control.nlsys(update, seen, inputs=["output"], outputs=["psi"], states=list(STATES), name="output_to_yaw")
    return control.linearize(system, _trim(vessel, speed_mps), [0.0], eps=1e-4)


def _trim(vessel: VesselConfig, speed_mps: float) -> list[float]:
    revs = _propellers(vessel).revs(cruise_command(vessel, speed_mps))
    return [speed_mps, 0.0, 0.0, 0.0, revs, revs, 0.0]


def nomoto(vessel: VesselConfig, speed_mps: float) -> tuple[float, float]:
    """Return (K in rad/s per rad, T in s) of rudder to yaw rate at a speed: static gain, and the lag of its slow part.

    Raises ValueError for a vessel without rudders or a course-unstable one, which has neither.
    """
    import control
    import numpy

    if not vessel.rudder.count:
        raise ValueError(f"{vessel.name} has no rudders")
    plant = control.linearize(vessel_system(vessel), _trim(vessel, speed_mps), _inputs(vessel, speed_mps), eps=1e-4)
    # sway and yaw alone, driven by the rudder's angle: the actuators' lags are not the hull's
    rows = [1, 2]
    hull = control.ss(plant.A[numpy.ix_(rows, rows)], plant.A[numpy.ix_(rows, [6])], [[0.0, 1.0]], 0.0)
    poles = hull.poles()
    if max(pole.real for pole in poles) >= 0.0:
        raise ValueError(f"{vessel.name} is course-unstable at {speed_mps} m/s")
    gain = float(numpy.real(hull.dcgain()))
    # T = T1 + T2 - T3, Nomoto's first-order approximation
    zeros = hull.zeros()
    lag = sum(-1.0 / pole for pole in poles) - sum(-1.0 / zero for zero in zeros)
    return gain, float(numpy.real(lag))


def _inputs(vessel: VesselConfig, speed_mps: float) -> list[float]:
    command = cruise_command(vessel, speed_mps)
    return [command, command, -vessel.rudder.offset_rad]
