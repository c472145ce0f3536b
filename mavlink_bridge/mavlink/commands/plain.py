"""Plain commands: the meaning of one is made from what its request says of itself (``language.spoken``)."""

from __future__ import annotations

from typing import Any, Final, assert_never

from ...language.spoken import Flag, Part, Real, Spoken, Sure
from ..wire.codec import dialect
from .command import Command, denied

NUMBERS: Final = {
    entry.name.removeprefix("MAV_CMD_"): int(number) for number, entry in dialect.enums["MAV_CMD"].items()
}
"""MAV_CMD by name, as the pinned dialect has it."""


def fields_of(spoken: Spoken, command: Command) -> dict[str, Any]:
    """The fields of the request that a command asks for. Raises Refused."""
    content: dict[str, Any] = {}
    for part in spoken.parts:
        content.update(_field(part, command))
    if spoken.place:
        lat_rad, lon_rad = command.position_rad(zero_is_here=True) or (None, None)
        content.update(lat_rad=lat_rad, lon_rad=lon_rad)
    return content


def _field(part: Part, command: Command) -> dict[str, Any]:
    match part:
        case Flag():
            return {part.field: command.whole(part.parameter, int(part.default), 0, 1) == 1}
        case Real():
            given = command.number(part.parameter, part.default, min(part.least, 0.0), part.most)
            if given and given < part.least:
                raise denied(f"parameter {part.parameter} = {given:g} is not between {part.least:g} and {part.most:g}")
            return {part.field: given or part.default}
        case Sure():
            if command.params[part.parameter - 1] != 1.0:
                raise denied(f"parameter {part.parameter} must be 1")
            return {}
        case _:
            assert_never(part)
