"""What happens during a scenario: faults put into the world, and an operator who gives orders, each at its time.

Orders go the way of the command line's (``App.submit``). One that the vessel refuses, or that is accepted though a refusal
was expected, is a finding against the scenario.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from mavlink_bridge.language.requests import (
    Arm,
    GuidedHeading,
    ManualInput,
    Orbit,
    PausePlan,
    Reply,
    Reposition,
    RequestBody,
    Result,
    SetMode,
    SetParameter,
    SetSpeed,
    StartPlan,
)
from mavlink_bridge.mavlink.wire.codec import Codec, dialect

from ..world import World
from .expect import Finding
from .file import MODES, Act, GotoAct, OrbitAct, Rudders, Scenario, SteerAct, SticksAct

_STATION: Final = 255
_BEAT_US: Final = 1_000_000
_HEARTBEAT: Final = dialect.MAVLink_heartbeat_message(
    type=dialect.MAV_TYPE_GCS,
    autopilot=dialect.MAV_AUTOPILOT_INVALID,
    base_mode=0,
    custom_mode=0,
    system_status=dialect.MAV_STATE_ACTIVE,
    mavlink_version=3,
)


@dataclass(slots=True)
class OperatorOrder:
    """An order of the operator and what became of it."""

    act: Act
    reply: Reply | None = None

    def answered(self, reply: Reply) -> None:
        """Take the vessel's answer."""
        self.reply = reply

    def finding(self) -> Finding | None:
        """None when all went as the scenario says."""
        wanted = self.act.refused
        reason = "no answer" if self.reply is None else self.reply.reason
        refused = self.reply is None or self.reply.result is not Result.ACCEPTED
        what = f"{self.act.name} at {self.act.t_s:g} s"
        if wanted is None:
            return Finding(what, f"refused: {reason}", "accepted", False) if refused else None
        passed = refused and wanted.lower() in reason.lower()
        return Finding(what, f"refused: {reason}" if refused else "accepted", f"refused: {wanted}", passed)


class Actor:
    """Carries out the acts of a scenario on a world; ``tick`` before each step."""

    def __init__(self, scenario: Scenario, world: World) -> None:
        self._world = world
        self._acts = sorted(scenario.text.at, key=lambda act: act.t_s)
        self._next = 0
        self._sticks: tuple[SticksAct, int] | None = None
        self._station = HeartbeatStation(world) if scenario.text.scenario.ground_station else None
        self.orders: list[OperatorOrder] = []

    def tick(self) -> None:
        """Do what is due."""
        now_us = self._world.now_us
        while self._next < len(self._acts) and self._acts[self._next].t_s * 1e6 <= now_us:
            self._do(self._acts[self._next])
            self._next += 1
        if self._sticks is not None:
            sticks, until_us = self._sticks
            self._sticks = None if now_us >= until_us else self._sticks
            if self._sticks is not None:
                self._world.app.submit(ManualInput(sticks.surge, sticks.yaw, _STATION))
        if self._station is not None:
            self._station.tick()

    def findings(self) -> tuple[Finding, ...]:
        """What did not go as the scenario says, and refusals that were expected."""
        return tuple(finding for order in self.orders if (finding := order.finding()) is not None)

    def _do(self, act: Act) -> None:
        value = getattr(act, act.name)
        bodies = _ORDERS[act.name](self._world, value) if act.name in _ORDERS else None
        if bodies is None:
            _FAULTS[act.name](self, value)
            return
        for body in bodies:
            order = OperatorOrder(act)
            self.orders.append(order)
            self._world.app.submit(body, order.answered)

    # ---- faults -------------------------------------------------------------------------------------------------

    def _sensor(self, faults: dict[str, Any]) -> None:
        for name, value in faults.items():
            self._world.surroundings.plant.sensors.faults.set(name, value)

    def _thrusters(self, health: tuple[float, float]) -> None:
        self._world.surroundings.plant.vessel.thruster_health = list(health)

    def _rudders(self, stuck: Rudders) -> None:
        self._world.surroundings.plant.vessel.rudder_stuck_rad = [
            None if angle is None else math.radians(angle) for angle in (stuck.port_deg, stuck.starboard_deg)
        ]

    def _board(self, what: str) -> None:
        board: Any = self._world.surroundings.plant.board
        if what in ("stop", "release"):
            board.set_estop(what == "stop")
        else:
            getattr(board, what)(self._world.now_us)

    def _supply(self, volts: float) -> None:
        board: Any = self._world.surroundings.plant.board
        board.set_voltage(volts)

    def _radio(self, change: dict[str, Any]) -> None:
        air = self._world.surroundings.radio.air
        if "jammed" in change:
            air.jammed = bool(change["jammed"])
        faults = {key: value for key, value in change.items() if key != "jammed"}
        if faults:
            air.configure(air.config.model_copy(update=faults))

    def _ais(self, change: dict[str, bool | float]) -> None:
        fleet = self._world.surroundings.fleet
        fleet.configure(fleet.ais.model_copy(update=change))

    def _water(self, change: dict[str, float]) -> None:
        water = self._world.surroundings.plant.water
        water.configure(water.config.model_copy(update=change))

    def _hold(self, sticks: SticksAct) -> None:
        self._sticks = (sticks, self._world.now_us + round(sticks.for_s * 1e6))

    def _silence(self, state: str) -> None:
        if self._station is None:
            self._station = HeartbeatStation(self._world)
        self._station.silent = state == "silent"


class HeartbeatStation:
    """A ground station on the first endpoint that only sends heartbeats."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._link = world.ground(world.settings.endpoints[0].name)
        self._codec = Codec(_STATION, 190)
        self._beat_us = 0
        self.silent = False

    def tick(self) -> None:
        """Send what is due, throw away what comes."""
        self._link.poll(self._world.now_us)
        if not self.silent and self._world.now_us >= self._beat_us:
            self._beat_us = self._world.now_us + _BEAT_US
            self._link.write(0, self._codec.encode(_HEARTBEAT))


def _goto(world: World, text: GotoAct) -> list[RequestBody]:
    place = text.position_rad(world.surroundings.plant.frame)
    return [Reposition(*place, speed_mps=text.speed_mps, radius_m=text.radius_m)]


def _orbit(world: World, text: OrbitAct) -> list[RequestBody]:
    return [
        Orbit(
            *text.position_rad(world.surroundings.plant.frame),
            figure=text.figure,
            speed_mps=text.speed_mps,
            turns=text.turns,
        )
    ]


def _steer(world: World, text: SteerAct) -> list[RequestBody]:
    return [GuidedHeading(math.radians(text.heading_deg), speed_mps=text.speed_mps)]


_ORDERS: Final[dict[str, Callable[[World, Any], list[RequestBody]]]] = {
    "arm": lambda world, value: [Arm(True)],
    "disarm": lambda world, value: [Arm(False)],
    "abort": lambda world, value: [Arm(False, force=True)],
    "mode": lambda world, value: [SetMode(MODES[value.lower()])],
    "start": lambda world, value: [StartPlan(0)],
    "pause": lambda world, value: [PausePlan(True)],
    "resume": lambda world, value: [PausePlan(False)],
    "goto": _goto,
    "orbit": _orbit,
    "steer": _steer,
    "speed_mps": lambda world, value: [SetSpeed(value)],
    "param": lambda world, value: [SetParameter(name, number) for name, number in value.items()],
}

_FAULTS: Final[dict[str, Callable[[Actor, Any], None]]] = {
    "sensor": Actor._sensor,
    "thruster_health": Actor._thrusters,
    "rudder_stuck": Actor._rudders,
    "board": Actor._board,
    "supply_v": Actor._supply,
    "unplug": lambda actor, name: actor._world.vessel_end(name).unplug(),
    "plug": lambda actor, name: actor._world.vessel_end(name).plug(),
    "radio": Actor._radio,
    "water": Actor._water,
    "ais": Actor._ais,
    "sticks": Actor._hold,
    "station": Actor._silence,
}
