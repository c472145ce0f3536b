"""What an endpoint needs to know of the vessel: parameters, stored plans, identity. The app implements it.

Read-only from the bridge's side: every change is asked for as a Request and answered by a Reply.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

from ...language.deeds import Deeds
from ...language.requests import PlanItem, PlanKind


@dataclass(frozen=True, slots=True)
class ParamInfo:
    """One parameter with everything a ground station may show of it."""

    name: str
    """At most 16 ASCII characters."""
    value: float
    """As it crosses the wire: REAL32; NaN = not set."""
    minimum: float | None = None
    maximum: float | None = None
    unit: str = ""
    text: str = ""
    live: bool = True
    """False: takes effect at the next start."""
    default: float | None = None
    increment: float | None = None
    read_only: bool = False
    group: str = ""
    choices: tuple[tuple[float, str], ...] = ()
    """Values with a name each, for parameters that are a choice."""


class ParamTable(Protocol):
    """The vessel's parameters in a fixed order. Indices never change while the process runs."""

    def __len__(self) -> int: ...

    def get(self, name: str) -> ParamInfo | None:
        """Return the parameter of this name, None when there is no such."""
        ...

    def index(self, name: str) -> int | None:
        """Return the position of a name in the table, from 0."""
        ...

    def at(self, index: int) -> ParamInfo | None:
        """Return the parameter at a position, None beyond the end."""
        ...


class PlanStore(Protocol):
    """The plans in force, canonical (no home item)."""

    def items(self, kind: PlanKind) -> tuple[PlanItem, ...]: ...

    def plan_id(self, kind: PlanKind) -> int:
        """CRC-32 of the items; 0 when there are none."""
        ...

    @property
    def home(self) -> tuple[float, float] | None:
        """Latitude and longitude in radians."""
        ...


@dataclass(frozen=True, slots=True)
class Identity:
    """Who the vessel is (AUTOPILOT_VERSION)."""

    uid: int = 0
    """64 bits, the same for the life of the computer."""
    version: tuple[int, int, int] = (0, 0, 0)
    os_version: tuple[int, int, int] = (0, 0, 0)
    board: int = 0
    git_hash: str = ""
    name: str = "usv-companion"
    started_utc_us: int = 0
    """UTC at the start by this computer's clock, a lower bound for signing; 0 = not known."""
    start_nonce: str = "000000000000"
    """Six bytes in hex that no other start of this vessel has: what is said by radio is bound to them (``lora.session``)."""


@dataclass(frozen=True, slots=True)
class LogInfo:
    """One log that the vessel keeps."""

    size_bytes: int
    utc_s: int
    """When it begins, seconds since 1970."""


class LogLostError(Exception):
    """A log that was listed cannot be read any more; the text says why."""


class LogShelf(Protocol):
    """The logs that the vessel keeps. Nothing here waits for a disk: what is not there yet is asked for again later."""

    @property
    def logs(self) -> tuple[LogInfo, ...]:
        """As last looked up, oldest first."""
        ...

    @property
    def looked(self) -> int:
        """Number of the last look that is finished; 0 = none yet."""
        ...

    def look(self) -> int:
        """Have the logs looked up; return the number that ``looked`` will have reached by then."""
        ...

    def piece(self, log: int, number: int) -> bytes | None:
        """Bytes ``number * LOG_PIECE`` onwards of a log, at most LOG_PIECE; None = being fetched. Raises LogLostError."""
        ...


LOG_PIECE: Final = 180 * 90
"""Bytes that are read at a time: whole LOG_DATA messages."""


class VehiclePort(Protocol):
    """The vessel as seen from an endpoint."""

    @property
    def params(self) -> ParamTable: ...

    @property
    def plans(self) -> PlanStore: ...

    @property
    def identity(self) -> Identity: ...

    @property
    def deeds(self) -> Deeds: ...

    @property
    def logs(self) -> LogShelf | None:
        """None: no logs can be had here."""
        ...
