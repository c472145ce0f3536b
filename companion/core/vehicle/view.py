"""Takes the picture of the vessel that every endpoint and the recorder see: once, at the end of a tick."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from mavlink_bridge.language.messages import (
    ActuatorStatus,
    LogText,
    PathControlState,
)
from mavlink_bridge.language.snapshot import Health, Progress, Snapshot

from .config import TickInputs
from .controls import Controls
from .refusals import prearm_reasons
from .ticked import Sensed, Ticked

_NO_PATH: Final = PathControlState()
_BOARD_US: Final = 2_000_000
"""A board tells its state five times a second: what it said longer ago it does not say now."""


class View:
    """The eye on one vessel. What has not changed since the last picture is the same object in the next."""

    def __init__(self, controls: Controls) -> None:
        self._controls, self._parts = controls, controls.parts
        self._stands: tuple[object, ...] = ()
        self._progress = Progress()
        self._well: tuple[object, ...] = ()
        self._health = Health()

    def picture(self, ticked: Ticked, reached: tuple[int, ...], texts: tuple[LogText, ...]) -> Snapshot:
        """Return the vessel as it is after this tick, with the items that it reached in it and what it said."""
        controls, parts, sensed, verdict = self._controls, self._parts, ticked.sensed, ticked.verdict
        now_us, inputs, guided, depth = sensed.now_us, sensed.inputs, ticked.course.guided, ticked.guarded.depth
        home, output, estimator = parts.mission.home, ticked.output, parts.estimator
        speaks = _board_speaks(sensed)
        return Snapshot(
            t_us=now_us,
            tick=ticked.number,
            state=sensed.state,
            mode=parts.navigator.mode,
            armed=controls.armed,
            output=output,
            demand=ticked.demand.actuators,
            desired=ticked.course.desired,
            path=_NO_PATH if guided is None else guided.path,
            trace=ticked.demand.trace,
            progress=self._see_progress(inputs, reached),
            fix=estimator.fix_at(now_us),
            attitude=estimator.attitude_at(now_us),
            distance=estimator.distance_at(now_us),
            altitude_raw_m=depth.altitude_raw_m,
            altitude_limit_m=depth.limit_m,
            altitude_least_m=depth.least_m,
            guard=depth.state,
            action=verdict.result.action,
            causes=verdict.result.causes,
            outlook=verdict.outlook,
            standing=(*controls.standing, *controls.voyage.standing, *inputs.standing),
            health=self._see_health(ticked, speaks=speaks),
            fence=ticked.guarded.fence.status,
            supply=sensed.board.supply if speaks else None,
            actuator=_see_board(inputs.actuator, speaks=speaks),
            commanded_us=inputs.commanded_us,
            home_lat_rad=None if home is None else home[0],
            home_lon_rad=None if home is None else home[1],
            utc_us=sensed.utc_us,
            texts=texts,
            links=inputs.links,
            throttle=0.5 * (output.thruster_port + output.thruster_starboard),
            terminated=parts.gate.terminated,
            load=inputs.load,
            traffic=sensed.others,
        )

    def _see_progress(self, inputs: TickInputs, reached: tuple[int, ...]) -> Progress:
        mission = self._parts.mission
        # between its last item and its end a plan stands behind all items: there is none to show with that number
        seq = min(mission.seq, max(mission.total - 1, 0))
        stands = (mission.state, seq, mission.total, *inputs.plan_ids, reached)
        if stands != self._stands:
            self._stands, self._progress = stands, Progress(*stands)
        return self._progress

    def _see_health(self, ticked: Ticked, *, speaks: bool) -> Health:
        """``speaks``: the board's account is fresh."""
        controls, parts, sensed = self._controls, self._parts, ticked.sensed
        state, inputs, fence = sensed.state, sensed.inputs, ticked.guarded.fence.status
        reasons = () if controls.armed else prearm_reasons(controls, sensed.now_us)
        well = (
            state.x_m is not None and state.y_m is not None,
            state.psi_rad is not None,
            (state.phi_rad is not None or state.theta_rad is not None) if parts.estimator.knows_tilt else None,
            ticked.guarded.depth.altitude_m is not None if controls.config.depth.enabled else None,
            inputs.actuator_ready,
            None if inputs.actuator.voltage_v is None else speaks and "battery_low" not in ticked.verdict.result.causes,
            not inputs.process.storage_fault,
            not fence.breached and (not parts.fence.enabled or state.x_m is not None),
            parts.fence.enabled,
            not reasons,
            reasons,
        )
        if well != self._well:
            self._well, self._health = well, Health(*well)
        return self._health


def _board_speaks(sensed: Sensed) -> bool:
    return sensed.now_us - sensed.inputs.actuator.t_us <= _BOARD_US


def _see_board(status: ActuatorStatus, *, speaks: bool) -> ActuatorStatus:
    """The board's own account; of one that has fallen silent not what it last applied and measured."""
    if speaks or (status.applied_us is None and status.voltage_v is None):
        return status
    return replace(status, applied_us=None, voltage_v=None)
