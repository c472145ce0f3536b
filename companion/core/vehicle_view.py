"""Takes the picture of the vessel that every endpoint and the recorder see: once, at the end of a tick."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.imc import ActuatorDemand, ActuatorOutput, LogText, PathControlState
from mavlink_bridge.snapshot import Health, Progress, Snapshot

from .controls import Controls
from .refusals import prearm_reasons

_NO_PATH: Final = PathControlState()


def picture(
    vehicle: Controls,
    now_us: int,
    demand: ActuatorDemand | None,
    output: ActuatorOutput,
    reached: tuple[int, ...],
    texts: tuple[LogText, ...],
) -> Snapshot:
    """Return the vessel as it is after this tick."""
    inputs = vehicle.inputs
    reasons = () if vehicle.armed else prearm_reasons(vehicle, now_us)
    attitude = vehicle.estimator.latest_attitude
    home = vehicle.mission.home
    return Snapshot(
        t_us=now_us,
        tick=vehicle.ticks,
        state=vehicle.state,
        mode=vehicle.navigator.mode,
        armed=vehicle.armed,
        output=output,
        demand=demand,
        desired=vehicle.desired,
        path=vehicle.guided.path if vehicle.guided is not None else _NO_PATH,
        trace=vehicle.trace,
        progress=_progress(vehicle, reached),
        fix=vehicle.estimator.latest_fix,
        attitude=attitude,
        distance=vehicle.estimator.latest_distance,
        altitude_raw_m=vehicle.guard_out.altitude_raw_m,
        altitude_limit_m=vehicle.guard_out.limit_m,
        guard=vehicle.guard_out.state,
        action=vehicle.result.action,
        causes=vehicle.result.causes,
        health=_health(vehicle, reasons),
        fence=vehicle.fence_status,
        supply=vehicle.supply,
        actuator=inputs.actuator,
        commanded_us=inputs.commanded_us,
        home_lat_rad=None if home is None else home[0],
        home_lon_rad=None if home is None else home[1],
        utc_us=vehicle.estimator.utc_us(now_us),
        texts=texts,
        links=inputs.links,
        throttle=0.5 * (output.thruster_port + output.thruster_starboard),
        terminated=vehicle.gate.terminated,
        load=inputs.load,
    )


def _progress(vehicle: Controls, reached: tuple[int, ...]) -> Progress:
    mission, (mission_id, fence_id, rally_id) = vehicle.mission, vehicle.inputs.plan_ids
    return Progress(
        state=mission.state,
        seq=mission.seq,
        total=mission.total,
        mission_id=mission_id,
        fence_id=fence_id,
        rally_id=rally_id,
        reached=reached,
    )


def _health(vehicle: Controls, reasons: tuple[str, ...]) -> Health:
    inputs = vehicle.inputs
    return Health(
        gps=vehicle.state.position_valid,
        heading=vehicle.state.heading_valid,
        attitude=vehicle.state.phi_rad is not None,
        depth=None if not vehicle.config.depth.enabled else vehicle.guard_out.altitude_m is not None,
        actuators=inputs.actuator_ready,
        battery=None if inputs.actuator.voltage_v is None else "battery_low" not in vehicle.result.causes,
        logging=not inputs.storage_fault,
        fence_ok=not vehicle.fence_status.breached,
        fence_enabled=vehicle.fence.enabled,
        prearm_ok=not reasons,
        prearm_reasons=reasons,
    )
