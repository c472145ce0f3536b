"""Takes the picture of the vessel that every endpoint and the recorder see: once, at the end of a tick."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from mavlink_bridge.language.messages import (
    ActuatorDemand,
    ActuatorOutput,
    ActuatorStatus,
    LogText,
    PathControlState,
)
from mavlink_bridge.language.snapshot import Health, Progress, Snapshot

from .controls import Controls
from .refusals import prearm_reasons

_NO_PATH: Final = PathControlState()
_BOARD_US: Final = 2_000_000
"""A board tells its state five times a second: what it said longer ago it does not say now."""


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
            fix=estimator.fix_at(now_us),
            attitude=estimator.attitude_at(now_us),
            distance=estimator.distance_at(now_us),
            altitude_raw_m=guard.altitude_raw_m,
            altitude_limit_m=guard.limit_m,
            guard=guard.state,
            action=result.action,
            causes=result.causes,
            outlook=vehicle.outlook,
            standing=(*vehicle.standing, *inputs.standing) if inputs.standing else vehicle.standing,
            health=self._see_health(() if vehicle.armed else prearm_reasons(vehicle, now_us), now_us),
            fence=vehicle.fence_status,
            supply=vehicle.board.supply if self._board_speaks(now_us) else None,
            actuator=self._see_board(now_us),
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

    def _board_speaks(self, now_us: int) -> bool:
        return now_us - self._vehicle.inputs.actuator.t_us <= _BOARD_US

    def _see_board(self, now_us: int) -> ActuatorStatus:
        """The board's own account; of one that has fallen silent not what it last applied and measured."""
        status = self._vehicle.inputs.actuator
        if self._board_speaks(now_us) or (status.applied_us is None and status.voltage_v is None):
            return status
        return replace(status, applied_us=None, voltage_v=None)

    def _see_health(self, reasons: tuple[str, ...], now_us: int) -> Health:
        vehicle = self._vehicle
        state, inputs = vehicle.state, vehicle.inputs
        well = (
            state.x_m is not None and state.y_m is not None,
            state.psi_rad is not None,
            (state.phi_rad is not None or state.theta_rad is not None) if vehicle.estimator.knows_tilt else None,
            vehicle.guard_out.altitude_m is not None if vehicle.depth_enabled else None,
            inputs.actuator_ready,
            None
            if inputs.actuator.voltage_v is None
            else self._board_speaks(now_us) and "battery_low" not in vehicle.result.causes,
            not inputs.process.storage_fault,
            not vehicle.fence_status.breached and (not vehicle.fence.enabled or state.x_m is not None),
            vehicle.fence.enabled,
            not reasons,
            reasons,
        )
        if well != self._well:
            self._well, self._health = well, Health(*well)
        return self._health
