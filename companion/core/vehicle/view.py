"""Takes the picture of the vessel that every endpoint and the recorder see: once, at the end of a tick."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import ActuatorDemand, ActuatorOutput, LogText, PathControlState
from mavlink_bridge.language.snapshot import Health, Progress, Snapshot

from .controls import Controls
from .refusals import prearm_reasons

_NO_PATH: Final = PathControlState()


class View:
    """The eye on one vessel. What has not changed since the last picture is the same object in the next."""

    def __init__(self, vehicle: Controls) -> None:
        self._vehicle = vehicle
        self._stands: tuple[object, ...] = ()
        self._progress = Progress()
        self._well: tuple[object, ...] = ()
        self._health = Health()

    def picture(
        self,
        now_us: int,
        demand: ActuatorDemand | None,
        output: ActuatorOutput,
        reached: tuple[int, ...],
        texts: tuple[LogText, ...],
    ) -> Snapshot:
        """Return the vessel as it is after this tick; the fields in their order, since naming 32 costs more than all else."""
        vehicle = self._vehicle
        inputs, estimator, guard, result = vehicle.inputs, vehicle.estimator, vehicle.guard_out, vehicle.result
        guided, home = vehicle.guided, vehicle.mission.home
        return Snapshot(
            t_us=now_us,
            tick=vehicle.ticks,
            state=vehicle.state,
            mode=vehicle.navigator.mode,
            armed=vehicle.armed,
            output=output,
            demand=demand,
            desired=vehicle.desired,
            path=_NO_PATH if guided is None else guided.path,
            trace=vehicle.trace,
            progress=self._see_progress(reached),
            fix=estimator.latest_fix,
            attitude=estimator.latest_attitude,
            distance=estimator.latest_distance,
            altitude_raw_m=guard.altitude_raw_m,
            altitude_limit_m=guard.limit_m,
            guard=guard.state,
            action=result.action,
            causes=result.causes,
            health=self._see_health(() if vehicle.armed else prearm_reasons(vehicle, now_us)),
            fence=vehicle.fence_status,
            supply=vehicle.supply,
            actuator=inputs.actuator,
            commanded_us=inputs.commanded_us,
            home_lat_rad=None if home is None else home[0],
            home_lon_rad=None if home is None else home[1],
            utc_us=vehicle.utc_us,
            texts=texts,
            links=inputs.links,
            throttle=0.5 * (output.thruster_port + output.thruster_starboard),
            terminated=vehicle.gate.terminated,
            load=inputs.load,
        )

    def _see_progress(self, reached: tuple[int, ...]) -> Progress:
        mission = self._vehicle.mission
        stands = (mission.state, mission.seq, mission.total, *self._vehicle.inputs.plan_ids, reached)
        if stands != self._stands:
            self._stands, self._progress = stands, Progress(*stands)
        return self._progress

    def _see_health(self, reasons: tuple[str, ...]) -> Health:
        vehicle = self._vehicle
        state, inputs = vehicle.state, vehicle.inputs
        well = (
            state.x_m is not None and state.y_m is not None,
            state.psi_rad is not None,
            state.phi_rad is not None,
            vehicle.guard_out.altitude_m is not None if vehicle.depth_enabled else None,
            inputs.actuator_ready,
            None if inputs.actuator.voltage_v is None else "battery_low" not in vehicle.result.causes,
            not inputs.storage_fault,
            not vehicle.fence_status.breached,
            vehicle.fence.enabled,
            not reasons,
            reasons,
        )
        if well != self._well:
            self._well, self._health = well, Health(*well)
        return self._health
