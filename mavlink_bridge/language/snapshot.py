"""What the vessel shows of itself: one immutable picture per tick, read by every endpoint and by the recorder."""

from __future__ import annotations

from dataclasses import field

from .messages import (
    Action,
    ActuatorDemand,
    ActuatorOutput,
    ActuatorStatus,
    Desired,
    Distance,
    EstimatedState,
    EulerAngles,
    GpsFix,
    GuardState,
    LogText,
    Mode,
    PathControlState,
    PlanState,
    Severity,
    SupplyVoltage,
)
from .traffic import NO_TRAFFIC, TrafficPicture
from .value import value


@value
class LinkHealth:
    """One link's state as shown to the operator."""

    name: str
    kind: str
    is_open: bool
    peers: int = 0
    bytes_in: int = 0
    bytes_out: int = 0
    bad_frames: int = 0
    last_rx_age_s: float | None = None
    text: str = ""
    is_listening: bool = True
    """False: it waits for others at an address that this computer does not have now."""


@value
class Progress:
    """Where the plan stands. ``seq`` counts canonical items from 0; personas shift it."""

    state: PlanState = PlanState.NO_MISSION
    seq: int = 0
    total: int = 0
    mission_id: int = 0
    fence_id: int = 0
    rally_id: int = 0
    reached: tuple[int, ...] = ()
    """Items reached in this tick."""


@value
class Health:
    """Truth behind the SYS_STATUS bits. None = no such part is fitted."""

    gps: bool = False
    heading: bool = False
    attitude: bool | None = None
    """Roll or pitch is known; None = neither has ever been measured."""
    depth: bool | None = None
    actuators: bool = False
    battery: bool | None = None
    logging: bool = True
    fence_ok: bool = True
    fence_enabled: bool = False
    prearm_ok: bool = False
    prearm_reasons: tuple[str, ...] = ()


@value
class FenceStatus:
    """FENCE_STATUS."""

    breached: bool = False
    breach_count: int = 0
    breach_type: int = 0
    breach_t_us: int = 0
    distance_m: float | None = None
    """To the nearest edge, positive inside."""
    stops_in_m: float | None = None
    """On the present course the vessel will be stopped after so many metres, for the fence; None = not within sight."""


@value
class ControlTrace:
    """Why the actuators got what they got: the parcels of both loops, for control.csv and the log."""

    heading_error_rad: float | None = None
    heading_p: float = 0.0
    heading_i: float = 0.0
    heading_d: float = 0.0
    speed_error_mps: float | None = None
    speed_p: float = 0.0
    speed_i: float = 0.0
    speed_d: float = 0.0
    psi_ref_rad: float | None = None
    speed_ref_mps: float | None = None


@value
class Outlook:
    """One failsafe condition in words: what is wrong, what the vessel does, what comes next and when, what ends it."""

    name: str
    cause: str
    doing: str
    """In words: "holding", "stopped (position lost)" where that is done for another condition, "taken over" by an operator."""
    next_action: Action = Action.NONE
    """What follows by itself; NONE = nothing."""
    next_in_s: float | None = None
    """On the clock of the second action, which stands while ``runs`` is False."""
    runs: bool = True
    """Whether the cause stands."""
    until: str = ""

    def sentence(self) -> str:
        """For a person: "ground station lost: holding, RETURN in 48 s; until ground station is back, then order Auto"."""
        over = "" if self.runs or self.next_in_s is not None else " (over)"
        parts = f"{self.cause}{over}: {self.doing}"
        if self.next_in_s is not None:
            clock = f"{self.next_action.name} in {max(self.next_in_s, 0.0):.0f} s"
            parts += f", {clock}" if self.runs else f", clock stands ({clock})"
        return f"{parts}; {self.until}" if self.until else parts


@value
class Snapshot:
    """The vessel at the end of a tick."""

    t_us: int
    tick: int
    state: EstimatedState
    mode: Mode
    armed: bool
    output: ActuatorOutput
    demand: ActuatorDemand | None = None
    desired: Desired | None = None
    path: PathControlState = field(default_factory=PathControlState)
    trace: ControlTrace = field(default_factory=ControlTrace)
    progress: Progress = field(default_factory=Progress)
    fix: GpsFix | None = None
    """What the receiver says now; None when it is silent."""
    attitude: EulerAngles | None = None
    """What the compass and the roll and pitch sensor say now; None when all are silent."""
    distance: Distance | None = None
    """The newest sounding; without a value when the sounder is silent."""
    altitude_raw_m: float | None = None
    altitude_limit_m: float | None = None
    """Below this the vessel is stopped now: the least altitude plus what stopping over a closing bottom uses up."""
    altitude_least_m: float | None = None
    """The least altitude."""
    guard: GuardState = GuardState.UNKNOWN
    action: Action = Action.NONE
    causes: tuple[str, ...] = ()
    """Names of the failsafe conditions that are active."""
    outlook: tuple[Outlook, ...] = ()
    """The same in words, with what comes next."""
    standing: tuple[tuple[Severity, str], ...] = ()
    """What a station that comes late should hear too."""
    health: Health = field(default_factory=Health)
    fence: FenceStatus = field(default_factory=FenceStatus)
    supply: SupplyVoltage | None = None
    """What the board measures now; None when it is silent or does not measure."""
    actuator: ActuatorStatus = field(default_factory=lambda: ActuatorStatus(0))
    commanded_us: tuple[int, int, int, int] | None = None
    home_lat_rad: float | None = None
    home_lon_rad: float | None = None
    utc_us: int | None = None
    texts: tuple[LogText, ...] = ()
    """Texts of this tick."""
    links: tuple[LinkHealth, ...] = ()
    throttle: float = 0.0
    """Mean forward thrust, -1...1."""
    terminated: bool = False
    load: float = 0.0
    """Share of the tick period that the last tick took, 0...1; 0 in virtual time."""
    traffic: TrafficPicture = NO_TRAFFIC
    """Other vessels; the same object until something of it changes."""
