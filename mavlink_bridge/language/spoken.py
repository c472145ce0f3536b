"""How a plain request is asked for: by which command, and which of its parameters fills which field.

A request that says this itself needs no row of its own among the commands: the row is made from it. One whose meaning
depends on the boat's state, or that several commands bring, has its function there instead.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

Parameter = int
"""1 to 4, as in MAVLink's param1 to param4."""


@dataclass(frozen=True, slots=True)
class Flag:
    """A yes or no, 1 or 0; not given is ``default``."""

    field: str
    parameter: Parameter
    default: bool


@dataclass(frozen=True, slots=True)
class Real:
    """A number within bounds; 0 and not given are ``default``."""

    field: str
    parameter: Parameter
    least: float
    most: float
    default: float


@dataclass(frozen=True, slots=True)
class Sure:
    """A parameter that must be 1, so that the order is none given by mistake; it fills no field."""

    parameter: Parameter


Part = Flag | Real | Sure


@dataclass(frozen=True, slots=True)
class Spoken:
    """A command's name in MAV_CMD, without the prefix, and what its parameters are."""

    command: str
    parts: tuple[Part, ...] = ()
    place: bool = False
    """Whether it has a position, which fills ``lat_rad`` and ``lon_rad``; none given, and 0/0, is here."""
    stops: bool = False
    """Whether the request's nature is to stop, for who sees only the number."""


UNSPOKEN: Final[Spoken | None] = None
"""No plain command: the request comes by functions in the table of commands, by other messages, or from inside."""
