"""What a ground station asks of the vessel, after MAVLink has been taken off.

An endpoint collects these; the vessel answers each at the next tick with a ``Reply`` under the same id, and
the endpoint turns that into COMMAND_ACK, MISSION_ACK or PARAM_VALUE. SI units and radians; None = not given.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from mavlink_bridge.imc import FenceArea, LoiterDirection, LoiterKind, Mode, PlanSpecification


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


@dataclass(frozen=True, slots=True)
class Arm:
    arm: bool
    force: bool = False
    """MAV_CMD_COMPONENT_ARM_DISARM param2 = 21196: for disarm, IMC Abort."""


@dataclass(frozen=True, slots=True)
class SetMode:
    mode: Mode


@dataclass(frozen=True, slots=True)
class StartPlan:
    first: int | None = None
    last: int | None = None


@dataclass(frozen=True, slots=True)
class PausePlan:
    pause: bool
    """True: hold here. False: go on with the plan."""


@dataclass(frozen=True, slots=True)
class SetCurrent:
    seq: int
    reset: bool = False


@dataclass(frozen=True, slots=True)
class LoadPlan:
    """A whole, parsed upload. The vessel checks it, stores it durably, swaps it in at a tick, then replies."""

    kind: PlanKind
    items: tuple[PlanItem, ...]
    plan: PlanSpecification = field(default_factory=PlanSpecification)
    fence: tuple[FenceArea, ...] = ()
    rally_rad: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Reposition:
    """Go to a point and stay (DO_REPOSITION, guided go-to). Position None = here."""

    lat_rad: float | None
    lon_rad: float | None
    speed_mps: float | None = None
    radius_m: float | None = None
    change_mode: bool = True


@dataclass(frozen=True, slots=True)
class Orbit:
    """Loiter at once (DO_ORBIT, DO_FIGURE_EIGHT). Position None = here."""

    lat_rad: float | None
    lon_rad: float | None
    kind: LoiterKind = LoiterKind.CIRCULAR
    radius_m: float | None = None
    length_m: float | None = None
    bearing_rad: float | None = None
    direction: LoiterDirection = LoiterDirection.CW
    speed_mps: float | None = None
    turns: float | None = None


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """Speed over ground or share of full thrust; both None = back to the default."""

    speed_mps: float | None = None
    throttle: float | None = None


@dataclass(frozen=True, slots=True)
class GuidedHeading:
    """Steer a heading or course, with a speed when given (IMC DesiredHeading, DesiredSpeed)."""

    psi_rad: float | None
    """None = as it is."""
    speed_mps: float | None = None
    throttle: float | None = None
    course: bool = False
    stream: bool = False
    """True for a set-point that must be repeated (times out), False for a command that stands."""


@dataclass(frozen=True, slots=True)
class GuidedTarget:
    """A streamed guided position (SET_POSITION_TARGET_GLOBAL_INT)."""

    lat_rad: float
    lon_rad: float
    speed_mps: float | None = None


@dataclass(frozen=True, slots=True)
class ManualInput:
    """Sticks: surge -1...1 ahead positive, yaw -1...1 to starboard. Times out after 0.5 s."""

    surge: float
    yaw: float
    source: int
    """System id of the sender, for ownership."""


@dataclass(frozen=True, slots=True)
class SetHomePosition:
    lat_rad: float | None
    lon_rad: float | None


@dataclass(frozen=True, slots=True)
class Terminate:
    """DO_FLIGHTTERMINATION: Abort that stays until restart."""


@dataclass(frozen=True, slots=True)
class EnableFence:
    enable: bool


@dataclass(frozen=True, slots=True)
class SetParameter:
    name: str
    value: float


@dataclass(frozen=True, slots=True)
class Reboot:
    shutdown: bool = False


@dataclass(frozen=True, slots=True)
class DistanceInput:
    """DISTANCE_SENSOR from another component: metres below the transducer."""

    value_m: float | None
    signal_quality: float | None = None


@dataclass(frozen=True, slots=True)
class RtcmData:
    """GPS_RTCM_DATA, reassembled, for the receiver's port."""

    data: bytes


@dataclass(frozen=True, slots=True)
class RunPrearmChecks:
    pass


@dataclass(frozen=True, slots=True)
class UnlockGuard:
    """An operator on the spot lifts a LOCKED depth guard once."""


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
    | DistanceInput
    | RtcmData
    | RunPrearmChecks
    | UnlockGuard
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
