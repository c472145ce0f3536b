"""What the vessel's core is configured with, and what each tick brings it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field

from mavlink_bridge.language.messages import ActuatorStatus, Measurement, Severity
from mavlink_bridge.language.snapshot import LinkHealth
from mavlink_bridge.language.stations import Heard
from mavlink_bridge.language.value import value

from ..ais.receiver import AisWord, ReceivedReport
from ..config import Config, param
from ..estimate import EstimatorConfig
from ..guard.depth.guard import DepthGuardConfig
from ..guard.failsafe import FailsafeConfig
from ..guard.failsafe_flags import ProcessFlags
from ..guard.fence import FenceConfig
from ..guard.gate import GateConfig
from ..guard.monitors import MonitorConfig
from ..guide import GuidanceConfig
from ..steer import SteeringConfig
from ..traffic import TrafficConfig
from .navigator import ModeConfig
from .plan_reach import MissionConfig


class SystemConfig(Config):
    """Who the vessel is on MAVLink, and how fast it thinks."""

    name: str = Field("usv", max_length=16)
    """Shown to people."""
    system_id: int = Field(1, ge=1, le=250)
    """The vessel's number on MAVLink, different for each vessel that one ground station sees."""
    tick_hz: int = Field(20, ge=10, le=50)
    """Control and actuator refresh rate; every part's period follows from it."""
    entity_label: str = ""
    """The seed's Entity Label: labels the log."""

    @property
    def period_us(self) -> int:
        """Period of the control tick."""
        return 1_000_000 // self.tick_hz


def _as_text(value: object) -> object:
    return [str(each) if isinstance(each, int) else each for each in value] if isinstance(value, list) else value


def _are_ids(ids: tuple[str, ...]) -> tuple[str, ...]:
    for text in ids:
        numbers = text.split("/")
        if len(numbers) > 2 or not all(each.isascii() and each.isdigit() and 1 <= int(each) <= 255 for each in numbers):
            raise ValueError(f'{text!r} is no station: write 255, or "255/190" for one component of it')
    return ids


OperatorIds = Annotated[tuple[str, ...], BeforeValidator(_as_text), AfterValidator(_are_ids)]
"""Stations that may command: numbers of systems, or "system/component"."""


class OperatorConfig(Config):
    """What the vessel expects of ground stations."""

    ids: OperatorIds = ()
    """Who may command: system ids, or "system/component" where a forwarder shares the system id (QGroundControl is "255/190", MAVProxy
    "255/230"); empty: whoever orders. Hold, Return and Disarm are obeyed from everybody that a link admits."""
    gcs_required: bool = param(True, "GCS_REQUIRED", "Armed, a ground station must be heard")
    store_required: bool = True
    """No departure, and no change of plan or parameter, while the store cannot be written. False: changes are then taken over and kept
    in memory until it can, and are lost if power is lost before."""
    owner_timeout_s: float = param(
        3.0, "OWNER_TIMEOUT", "Sticks become free after this silence", unit="s", ge=0.5, le=60
    )


class VehicleConfig(Config):
    """Settings of all parts of the core."""

    system: SystemConfig = SystemConfig()
    operator: OperatorConfig = OperatorConfig()
    mission: MissionConfig = MissionConfig()
    modes: ModeConfig = ModeConfig()
    guidance: GuidanceConfig = GuidanceConfig()
    steering: SteeringConfig = SteeringConfig()
    estimate: EstimatorConfig = EstimatorConfig()
    depth: DepthGuardConfig = DepthGuardConfig()
    fence: FenceConfig = FenceConfig()
    failsafe: FailsafeConfig = FailsafeConfig()
    monitors: MonitorConfig = MonitorConfig()
    gate: GateConfig = GateConfig()
    traffic: TrafficConfig = TrafficConfig()


@value
class TickInputs:
    """What the app brings to a tick, besides requests."""

    measurements: Sequence[tuple[Measurement, int]] = ()
    """Each with the number of its sensor link; the lowest one alive leads."""
    ais: Sequence[ReceivedReport | AisWord] = ()
    """What AIS receivers have brought."""
    ais_alive: bool = False
    """A line that carries AIS has brought a byte since the last tick."""
    actuator: ActuatorStatus = field(default_factory=lambda: ActuatorStatus(0))
    actuator_ready: bool = False
    actuator_reason: str = "no actuator board"
    actuator_faults: Sequence[str] = ()
    commanded_us: tuple[int, int, int, int] | None = None
    links: tuple[LinkHealth, ...] = ()
    heard: Sequence[Heard] = ()
    """Every ground station's newest HEARTBEAT."""
    standing: Sequence[tuple[Severity, str]] = ()
    """What is told at the start, by others than the vessel, and holds still."""
    process: ProcessFlags = field(default_factory=ProcessFlags)
    """How the program around the vessel is."""
    barred: tuple[str, ...] = ()
    """Why the vessel must not depart, as the app knows it (its store); no reason against going on with a voyage."""
    late_s: float = 0.0
    load: float = 0.0
    plan_ids: tuple[int, int, int] = (0, 0, 0)
