"""What a ground station asks of the vessel, after MAVLink has been taken off.

An endpoint collects these; the vessel answers each at the next tick with a ``Reply`` under the same id, and
the endpoint turns that into COMMAND_ACK, MISSION_ACK or PARAM_VALUE. SI units and radians; None = not given.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from .depth_requests import (
    FORGET_MAX_M as FORGET_MAX_M,
    DistanceInput as DistanceInput,
    ForgetDepth as ForgetDepth,
    UnlockGuard as UnlockGuard,
)
from .figures import Circle, Figure
from .messages import FenceArea, Mode, PlanSpecification
from .nature import OTHER as _OTHER, Ask, Matter, Nature
from .points import LatLon
from .spoken import Spoken
from .stations import Proof, Station
from .trials import SeaTrial


class Result(Enum):
    """Outcome of a request; ``commands.py`` maps these to MAV_RESULT."""

    ACCEPTED = "accepted"
    REJECTED_NOW = "temporarily rejected"
    DENIED = "denied"
    UNSUPPORTED = "unsupported"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Reply:
    """The vessel's answer. ``reason`` is one plain sentence for the operator, empty when accepted."""

    result: Result
    reason: str = ""


ACCEPTED = Reply(Result.ACCEPTED)


class PlanKind(Enum):
    """MAV_MISSION_TYPE."""

    MISSION = 0
    FENCE = 1
    RALLY = 2


@dataclass(frozen=True, slots=True)
class PlanItem:
    """One item as it crossed the wire, kept so that a download returns it bit for bit (canonical: no home item)."""

    command: int
    frame: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    """Latitude, degrees * 1e7, or the raw field of a command without a position."""
    y: int
    z: float
    autocontinue: int = 1


_WAY: Final = frozenset((Matter.WAY,))
_SPEED: Final = frozenset((Matter.SPEED,))
_HOME: Final = frozenset((Matter.HOME,))
_FENCE: Final = frozenset((Matter.FENCE,))
_HELM: Final = frozenset((Matter.HELM,))
_BY_PLAN: Final = {PlanKind.MISSION: _WAY | _SPEED, PlanKind.FENCE: _FENCE, PlanKind.RALLY: _HOME}


@dataclass(frozen=True, slots=True)
class Arm(Ask):
    arm: bool
    force: bool = False
    """MAV_CMD_COMPONENT_ARM_DISARM param2 = 21196: for disarm, IMC Abort."""

    @property
    def nature(self) -> Nature:
        return Nature(aim=(None, True)) if self.arm else Nature(stops=True, yields=False, aim=(None, False))


@dataclass(frozen=True, slots=True)
class SetMode(Ask):
    mode: Mode

    @property
    def nature(self) -> Nature:
        stops = self.mode in (Mode.HOLD, Mode.LOITER)
        moves = self.mode not in (Mode.MANUAL, Mode.HOLD)
        return Nature(stops=stops, moves=moves, decides=True, yields=not stops, aim=(self.mode, None))


@dataclass(frozen=True, slots=True)
class StartPlan(Ask):
    first: int | None = None
    last: int | None = None

    @property
    def nature(self) -> Nature:
        return Nature(moves=True, decides=True, aim=(Mode.AUTO, True), settles=_WAY)


@dataclass(frozen=True, slots=True)
class PausePlan(Ask):
    pause: bool
    """True: hold here. False: go on with the plan."""

    @property
    def nature(self) -> Nature:
        if self.pause:
            return Nature(stops=True, decides=True, yields=False, aim=(Mode.HOLD, None))
        return Nature(moves=True, decides=True, aim=(Mode.AUTO, None))


@dataclass(frozen=True, slots=True)
class SetCurrent(Ask):
    seq: int
    reset: bool = False

    @property
    def nature(self) -> Nature:
        return Nature(settles=_WAY)


@dataclass(frozen=True, slots=True)
class LoadPlan(Ask):
    """A whole, parsed upload. The vessel checks it, stores it durably, swaps it in at a tick, then replies."""

    kind: PlanKind
    items: tuple[PlanItem, ...]
    plan: PlanSpecification = field(default_factory=PlanSpecification)
    fence: tuple[FenceArea, ...] = ()
    rally_rad: tuple[LatLon, ...] = ()
    base_id: int | None = None
    """Id of the stored plan of which this changes a part; None: it is a whole plan of its own."""

    @property
    def nature(self) -> Nature:
        return Nature(sets=True, yields=False, settles=_BY_PLAN[self.kind])

    @property
    def about(self) -> PlanKind:
        return self.kind


@dataclass(frozen=True, slots=True)
class Reposition(Ask):
    """Go to a point and stay (DO_REPOSITION, guided go-to). Position None = here."""

    lat_rad: float | None
    lon_rad: float | None
    speed_mps: float | None = None
    radius_m: float | None = None
    change_mode: bool = True

    @property
    def nature(self) -> Nature:
        stops = self.lat_rad is None and self.radius_m is None
        return Nature(stops=stops, moves=True, decides=True, yields=not stops, aim=(Mode.GUIDED, None), settles=_WAY)


@dataclass(frozen=True, slots=True)
class Orbit(Ask):
    """Loiter at once (DO_ORBIT, DO_FIGURE_EIGHT). Position None = here."""

    lat_rad: float | None
    lon_rad: float | None
    figure: Figure = Circle()  # noqa: RUF009 - frozen
    speed_mps: float | None = None
    turns: float | None = None

    @property
    def nature(self) -> Nature:
        return Nature(moves=True, decides=True, aim=(Mode.CIRCLE, None), settles=_WAY)


@dataclass(frozen=True, slots=True)
class SetSpeed(Ask):
    """Speed over ground or share of full thrust; both None = back to the default."""

    speed_mps: float | None = None
    throttle: float | None = None

    @property
    def nature(self) -> Nature:
        return Nature(settles=_SPEED)


@dataclass(frozen=True, slots=True)
class GuidedHeading(Ask):
    """Steer a heading or course, with a speed when given (IMC DesiredHeading, DesiredSpeed)."""

    psi_rad: float | None
    """None = as it is."""
    speed_mps: float | None = None
    throttle: float | None = None
    course: bool = False
    stream: bool = False
    """True for a set-point that must be repeated (times out), False for a command that stands."""

    @property
    def nature(self) -> Nature:
        return Nature(moves=True, decides=not self.stream, aim=(Mode.GUIDED, None), settles=_WAY)


@dataclass(frozen=True, slots=True)
class GuidedTarget(Ask):
    """A streamed guided position (SET_POSITION_TARGET_GLOBAL_INT)."""

    lat_rad: float
    lon_rad: float
    speed_mps: float | None = None

    @property
    def nature(self) -> Nature:
        return Nature(moves=True)


@dataclass(frozen=True, slots=True)
class ManualInput(Ask):
    """Sticks: surge -1...1 ahead positive, yaw -1...1 to starboard. Times out after 0.5 s."""

    surge: float
    yaw: float
    source: int
    """System id of the sender, for ownership."""

    @property
    def nature(self) -> Nature:
        return _OTHER


@dataclass(frozen=True, slots=True)
class SetHomePosition(Ask):
    lat_rad: float | None
    lon_rad: float | None

    @property
    def nature(self) -> Nature:
        return Nature(sets=True, settles=_HOME)


@dataclass(frozen=True, slots=True)
class Terminate(Ask):
    """DO_FLIGHTTERMINATION: Abort that stays until restart."""

    @property
    def nature(self) -> Nature:
        return Nature(stops=True, yields=False)


@dataclass(frozen=True, slots=True)
class EnableFence(Ask):
    enable: bool

    @property
    def nature(self) -> Nature:
        return Nature(sets=True, settles=_FENCE)


@dataclass(frozen=True, slots=True)
class SetParameter(Ask):
    name: str
    value: float

    @property
    def nature(self) -> Nature:
        return Nature(sets=True, yields=False, settles=_FENCE | _SPEED)

    @property
    def about(self) -> str:
        return self.name


@dataclass(frozen=True, slots=True)
class Reboot(Ask):
    shutdown: bool = False

    @property
    def nature(self) -> Nature:
        return Nature(sets=True)


@dataclass(frozen=True, slots=True)
class EraseLogs(Ask):
    """Delete the telemetry logs of the vessel's earlier runs (LOG_ERASE). There is no way back."""

    @property
    def nature(self) -> Nature:
        return Nature(sets=True)


@dataclass(frozen=True, slots=True)
class RtcmData(Ask):
    """GPS_RTCM_DATA, reassembled, for the receiver's port."""

    data: bytes

    @property
    def nature(self) -> Nature:
        return _OTHER


@dataclass(frozen=True, slots=True)
class RunPrearmChecks(Ask):
    """The checks before arming, told without arming."""

    spoken = Spoken("RUN_PREARM_CHECKS")

    @property
    def nature(self) -> Nature:
        return _OTHER


@dataclass(frozen=True, slots=True)
class TakeCommand(Ask):
    """A station asks to command the vessel from now on, or gives it up; nothing moves by it."""

    take: bool = True

    @property
    def nature(self) -> Nature:
        return Nature(settles=_HELM)


RequestBody = (
    Arm
    | SetMode
    | StartPlan
    | PausePlan
    | SetCurrent
    | LoadPlan
    | Reposition
    | Orbit
    | SetSpeed
    | GuidedHeading
    | GuidedTarget
    | ManualInput
    | SetHomePosition
    | Terminate
    | EnableFence
    | SetParameter
    | Reboot
    | EraseLogs
    | DistanceInput
    | RtcmData
    | RunPrearmChecks
    | UnlockGuard
    | TakeCommand
    | ForgetDepth
    | SeaTrial
)


@dataclass(frozen=True, slots=True)
class Origin:
    """The message that a request came in, word for word: for a link that carries it on instead of what it was taken to mean."""

    message_id: int
    payload: bytes
    source: tuple[int, int]
    """System and component of the ground station."""
    home_item: bool = False
    """Whether the station counts a home item before the mission's first."""


@dataclass(frozen=True, slots=True)
class Request:
    """A body with its return address. ``id`` is unique within one endpoint; ``reply`` False = only a refusal is of interest."""

    id: int
    body: RequestBody
    sender: int
    """System id of the ground station."""
    reply: bool = True
    origin: Origin | None = None
    """Of a COMMAND_LONG or COMMAND_INT."""
    component: int = 0
    """Component id of the ground station."""
    station: Station | None = None
    """Who asks, where; None = the vessel's own people."""
    proof: Proof = Proof.UNSIGNED
    """What stands behind it."""
