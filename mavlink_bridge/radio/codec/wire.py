"""The code page of the compact link: every number that stands for something on the air, each written down once and frozen.

A number is never reused and its meaning never changes; new meanings are appended under new numbers. What must differ
raises ``VERSION``, and ends of different versions then understand only what is marked frozen here. Nothing follows the
order of an enum or of a dataclass: a member without a number fails at import, by name. The golden vectors in
tests/data/radio hold all of it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from enum import Enum, IntEnum, unique
from typing import Any, Final, Generic, TypeVar

from ...language import requests as ask
from ...language.figures import FIGURES, Circle, Figure, FigureEight, Hover, Racetrack
from ...language.messages import Action, FixType, GuardState, LoiterDirection, Mode, PlanState, Severity
from .bits import BitsError

VERSION: Final = 2
"""1 was the first release: counters kept in the store, codes by declaration order, 4-byte tags. 4 bits in HELLO."""

Member = TypeVar("Member")


class Codes(Generic[Member]):
    """Numbers of ``bits`` bits for all members of a closed vocabulary. Raises ValueError, naming the member, for a table with a gap."""

    def __init__(self, kind: Iterable[Member], bits: int, numbers: Mapping[Member, int], name: str = "") -> None:
        """``kind``: an enum, or all classes of a sum type, which is then called ``name``."""
        self._name = name or getattr(kind, "__name__", "")
        missing = [getattr(member, "name", str(member)) for member in kind if member not in numbers]
        if missing:
            raise ValueError(f"{self._name}.{missing[0]} has no number on the radio's code page")
        if len(set(numbers.values())) < len(numbers) or max(numbers.values()) >> bits:
            raise ValueError(f"two members of {self._name} share a number, or one needs more than {bits} bits")
        self.bits = bits
        self._numbers = dict(numbers)
        self._members = {number: member for member, number in numbers.items()}

    def number(self, member: Member) -> int:
        """What stands for a member on the air."""
        return self._numbers[member]

    def member(self, number: int) -> Member:
        """Raises BitsError for a number that this version does not know."""
        found = self._members.get(number)
        if found is None:
            raise BitsError(f"{self._name} {number} is not known here")
        return found


# ---- frames ---------------------------------------------------------------------------------------------------------


TAG_BYTES: Final = 5
"""2^40 tags: at 5.5 kbit/s a crafted stream offers 684 offsets a second with two tags each, 25 years for one success."""
HEAD_BYTES: Final = 2
OVERHEAD: Final = HEAD_BYTES + TAG_BYTES
MAX_BODY: Final = 55
MAX_FRAME: Final = MAX_BODY + OVERHEAD
"""62: what the module sends as one packet."""


BRIEF_FROM: Final = 56
"""Lengths that no body has: the frame is an order without a body, and the head's other bits tell its number and which one (``frames``)."""
BRIEF_ORDERS: Final = tuple(bytes.fromhex(order) for order in ("fc04ad0880", "fc04ad1800", "fc04ad1a00", "fc006c"))
"""QGroundControl's Guided, Auto, Return and arming: it waits 1.3 s for a mode and 1.5 s for an arming to show. Full."""
BRIEF_ARM: Final = BRIEF_ORDERS[3]
"""The one that may be said twice, on an air that loses (``frames`` has the marks)."""
BRIEF_HOLD: Final = bytes((1, 255))
"""QGroundControl's Hold, of SAFE: its first tries go without a body too. To the vessel the kind of a state marks it: KEY and DELTA are
the number's fifth bit, and a 0, its low four bits and a 0 stand in the place of the length.
"""
BRIEF_AIMS: Final[Mapping[bytes, Mode | None]] = dict(
    zip((*BRIEF_ORDERS, BRIEF_HOLD), (Mode.GUIDED, Mode.AUTO, Mode.RTL, None, Mode.HOLD), strict=True)
)
"""What each of these brings: a mode, or (None) the armed bit. From the vessel such a length marks "accepted" to one of them."""
BRIEF_PLANS: Final = (None, PlanState.ACTIVE, PlanState.PAUSED)
"""What an answer without a body says of the plan: as told before, or so. 3 is free."""


class Kind(IntEnum):
    """What a frame is, in 4 bits. HELLO, REPLY's first byte, SAFE and POSITION are frozen for all versions."""

    HELLO = 0
    """Frozen: version and flags, nonce; from the vessel its clock too (``hello``)."""
    KEY = 1
    DELTA = 2
    BATCH = 3
    EVENT = 4
    PLAN = 5
    """Id, and a whole plan."""
    ORDER = 6
    """Id, and a request."""
    PIECE = 7
    """Id, row of the erasure code, count and flags, part of a longer message."""
    MISSING = 8
    """Id, number of pieces that have arrived."""
    REPLY = 9
    """Frozen first byte: id and result. Then the state where the vessel answers, and a reason."""
    BEACON = 10
    INFO = 11
    STOP = 12
    """Count of stops, id, and a request that makes the vessel stop: goes before everything else."""
    SAFE = 13
    """Frozen: count of stops, id, what (``SAFE_STOPS``), system id of the station."""
    TEXT = 14
    POSITION = 15
    """Frozen: latitude, longitude, speed, mode and armed; for a shore of another version."""


FROZEN: Final = frozenset((Kind.HELLO, Kind.REPLY, Kind.SAFE, Kind.POSITION))
"""What ends of different versions still say to each other."""

SAFE_STOPS: Final[Mapping[int, ask.RequestBody]] = {
    1: ask.SetMode(Mode.HOLD),
    2: ask.Arm(arm=False),
    3: ask.Arm(arm=False, force=True),
}
"""Frozen: what the second byte of SAFE asks for."""

BEACON_COMMANDED: Final = 0x80
"""The station that commands through the gateway is alive."""
BEACON_NAMES_KEY: Final = 0x40
"""Two bytes follow: the low 16 bits of the counter of the state that differences may refer to: a key, or a difference, which then serves as
the key ``as_key_mark``. A vessel that does not know the latter sends a key each minute.
"""

# ---- vocabularies ---------------------------------------------------------------------------------------------------

MODE: Final = Codes(
    Mode,
    4,
    {
        Mode.MANUAL: 0,
        Mode.HOLD: 1,
        Mode.AUTO: 2,
        Mode.RTL: 3,
        Mode.GUIDED: 4,
        Mode.CIRCLE: 5,
        Mode.LOITER: 6,
    },
)
RESULT: Final = Codes(
    ask.Result,
    3,
    {
        ask.Result.ACCEPTED: 0,
        ask.Result.REJECTED_NOW: 1,
        ask.Result.DENIED: 2,
        ask.Result.UNSUPPORTED: 3,
        ask.Result.FAILED: 4,
    },
)
ACTION: Final = Codes(
    Action,
    3,
    {
        Action.NONE: 0,
        Action.WARN: 1,
        Action.HOLD: 2,
        Action.RETURN: 3,
        Action.STOP: 4,
        Action.DISARM: 5,
        Action.TERMINATE: 6,
    },
)
GUARD: Final = Codes(
    GuardState,
    2,
    {GuardState.UNKNOWN: 0, GuardState.OK: 1, GuardState.CORRECTION: 2, GuardState.LOCKED: 3},
)
PLAN_STATE: Final = Codes(
    PlanState,
    3,
    {
        PlanState.NO_MISSION: 1,
        PlanState.NOT_STARTED: 2,
        PlanState.ACTIVE: 3,
        PlanState.PAUSED: 4,
        PlanState.COMPLETE: 5,
    },
)
FIX: Final = Codes(
    FixType,
    3,
    {
        FixType.NONE: 1,
        FixType.FIX_2D: 2,
        FixType.FIX_3D: 3,
        FixType.DGPS: 4,
        FixType.RTK_FLOAT: 5,
        FixType.RTK_FIXED: 6,
    },
)
PLAN_KIND: Final = Codes(ask.PlanKind, 2, {ask.PlanKind.MISSION: 0, ask.PlanKind.FENCE: 1, ask.PlanKind.RALLY: 2})
SEVERITY: Final = Codes(
    Severity,
    3,
    {
        Severity.EMERGENCY: 0,
        Severity.ALERT: 1,
        Severity.CRITICAL: 2,
        Severity.ERROR: 3,
        Severity.WARNING: 4,
        Severity.NOTICE: 5,
        Severity.INFO: 6,
        Severity.DEBUG: 7,
    },
)
FIGURE: Final = Codes[type[Figure]](
    FIGURES.values(), 3, {Circle: 0, Racetrack: 1, FigureEight: 2, Hover: 3}, name="Figure"
)
LOITER_DIRECTION: Final = Codes(
    LoiterDirection,
    3,
    {LoiterDirection.CW: 0, LoiterDirection.CCW: 1, LoiterDirection.INTO_DRIFT: 2, LoiterDirection.VESSEL: 3},
)

# ---- requests -------------------------------------------------------------------------------------------------------


@unique
class Form(Enum):
    """How a field of a request is written."""

    FLAG = "one bit"
    WHOLE = "Exp-Golomb code of order 4, signed"
    REAL = "a REAL32, short where it is whole or in tenths"
    NAME = "CRC-16 of a parameter's name"
    LATITUDE = "degrees * 1e7, 32 bits"
    LONGITUDE = "the same of a longitude"
    MODE = "4 bits of a mode"
    FIGURE = "3 bits of a figure; radius, length and bearing, each a bit and a REAL32 where it is there; 3 bits of a direction"


@dataclasses.dataclass(frozen=True, slots=True)
class WireField:
    """One field on its place in the request. ``optional``: one bit before it says whether it is there."""

    name: str
    form: Form
    optional: bool = False


@dataclasses.dataclass(frozen=True, slots=True)
class RequestRow:
    """A request and its fields in the order of the air. Raises ValueError for a field of the class that the row forgets."""

    kind: type[Any]
    fields: tuple[WireField, ...] = ()

    def __post_init__(self) -> None:
        declared = {field.name for field in dataclasses.fields(self.kind)}
        named = {field.name for field in self.fields}
        if declared != named:
            raise ValueError(
                f"{self.kind.__name__}: {', '.join(declared ^ named)} is not as the radio's code page says"
            )


_LAT: Final = WireField("lat_rad", Form.LATITUDE, optional=True)
_LON: Final = WireField("lon_rad", Form.LONGITUDE, optional=True)
_SPEED: Final = WireField("speed_mps", Form.REAL, optional=True)
_THROTTLE: Final = WireField("throttle", Form.REAL, optional=True)

REQUEST_BITS: Final = 5
REQUESTS: Final[Mapping[int, RequestRow]] = {
    0: RequestRow(ask.Arm, (WireField("arm", Form.FLAG), WireField("force", Form.FLAG))),
    1: RequestRow(ask.SetMode, (WireField("mode", Form.MODE),)),
    2: RequestRow(ask.StartPlan, (WireField("first", Form.WHOLE, True), WireField("last", Form.WHOLE, True))),
    3: RequestRow(ask.PausePlan, (WireField("pause", Form.FLAG),)),
    4: RequestRow(ask.SetCurrent, (WireField("seq", Form.WHOLE), WireField("reset", Form.FLAG))),
    5: RequestRow(
        ask.Reposition,
        (_LAT, _LON, _SPEED, WireField("radius_m", Form.REAL, True), WireField("change_mode", Form.FLAG)),
    ),
    6: RequestRow(
        ask.Orbit,
        (
            _LAT,
            _LON,
            WireField("figure", Form.FIGURE),
            _SPEED,
            WireField("turns", Form.REAL, True),
        ),
    ),
    7: RequestRow(ask.SetSpeed, (_SPEED, _THROTTLE)),
    8: RequestRow(
        ask.GuidedHeading,
        (
            WireField("psi_rad", Form.REAL, True),
            _SPEED,
            _THROTTLE,
            WireField("course", Form.FLAG),
            WireField("stream", Form.FLAG),
        ),
    ),
    9: RequestRow(ask.SetHomePosition, (_LAT, _LON)),
    10: RequestRow(ask.Terminate),
    11: RequestRow(ask.EnableFence, (WireField("enable", Form.FLAG),)),
    12: RequestRow(ask.SetParameter, (WireField("name", Form.NAME), WireField("value", Form.REAL))),
    13: RequestRow(ask.Reboot, (WireField("shutdown", Form.FLAG),)),
    14: RequestRow(ask.RunPrearmChecks),
    15: RequestRow(ask.UnlockGuard),
    16: RequestRow(ask.ForgetDepth, (_LAT, _LON, WireField("radius_m", Form.REAL))),
}
RESERVED: Final[Mapping[int, str]] = {
    17: "TakeCommand: this station commands from now on",
    18: "AcceptFarPlan: the plan may be far away",
    19: "Insist: an order, and the refusals that it overrides by name",
}
"""Numbers of requests that are agreed on and not built."""
COMMAND_CODE: Final = 31
"""In the place of a request's number: a station's command, word for word (``command_codec``)."""
RAW_CODE: Final = 30
"""Likewise: any message, as it is."""

# ---- codebooks: the place in each tuple is the number; append only ----------------------------------------------------

COMMANDS: Final = (
    *(400, 176, 300, 192, 193, 178, 179, 34, 35, 20, 17, 185, 224, 207, 115, 246, 262, 401, 31010, 43000, 43002),
    *(43001, 245, 2500, 2501, 511, 512, 520, 410, 222, 252),
)
"""MAV_CMD of orders; full. Any other number travels in 16 bits."""
STATIONS: Final = ((255, 190), (245, 190), (255, 230))
"""System and component of QGroundControl, MAVSDK, MAVProxy."""
COMMAND_FRAMES: Final = (0, 5, 6, 3, 2, 1, 11)
"""MAV_FRAME of orders; full."""
PLAN_COMMANDS: Final = (16, 19, 178, 17, 18, 20, 177, 93, 112, 5001, 5002, 5003, 5004, 5100, 34)
"""MAV_CMD of plans, commonest first; full. Any other number travels in 16 bits."""
PLAN_FRAMES: Final = (3, 6, 2, 0, 5, 10, 11)
"""MAV_FRAME of plans; full."""
