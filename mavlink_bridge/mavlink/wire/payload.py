"""Messages as payloads, not yet framed, so that one packing serves every link: each frames it with its own sequence number.

What a service answers is a message object of the library, packed by ``packed``. Telemetry goes without: a ``Teller`` packs the
values that a function finds in the vessel's picture at once, in the layout that the library gives the message.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, ParamSpec

from .codec import dialect, payload

Shown = ParamSpec("Shown")
Values = tuple[float, ...]
Packed = tuple[int, bytes]
"""A message's id and payload, trailing zeros cut."""


def packed(message: Any) -> Packed:
    """Pack a message. Raises struct.error for a value that its field cannot hold: a fault of the caller."""
    return message.get_msgId(), payload(message)


def message_id(name: str) -> int:
    """Id of a message of the dialect."""
    number: int = getattr(dialect, f"MAVLINK_MSG_ID_{name}")
    return number


class Teller(Generic[Shown]):
    """One kind of telemetry: ``values`` gives its fields in the order of the wire, or None when there is nothing true to say."""

    __slots__ = ("_rest", "_whole", "fields", "message_id", "pack", "values")

    def __init__(self, name: str, fields: str, values: Callable[Shown, Values | None]) -> None:
        self.message_id = message_id(name)
        self.fields = fields.split()
        self.values = values
        message_class = dialect.mavlink_map[self.message_id]
        given = len(self.fields)
        if self.fields != message_class.ordered_fieldnames[:given]:
            raise ValueError(f"{name}: the wire has {' '.join(message_class.ordered_fieldnames)}")
        self._whole: Callable[..., bytes] = message_class.unpacker.pack
        self._rest: Values = (0,) * sum(message_class.lengths[given:])
        self.pack = self._padded if self._rest else self._whole

    def __call__(self, *args: Shown.args, **kwargs: Shown.kwargs) -> Packed | None:
        """Return the message, packed; None when there is nothing true to say."""
        values = self.values(*args, **kwargs)
        return None if values is None else self.packed(values)

    def packed(self, values: Values) -> Packed:
        """Pack what ``values`` returned. Raises struct.error for a value that its field cannot hold."""
        return self.message_id, self.pack(*values).rstrip(b"\0") or b"\0"

    def _padded(self, *values: float) -> bytes:
        return self._whole(*values, *self._rest)


def told_as(name: str, fields: str) -> Callable[[Callable[Shown, Values | None]], Teller[Shown]]:
    """Make a function that returns a message's values a ``Teller``.

    ``fields`` names the values in their order, which is the wire's: large fields first, extensions last. An array is one
    field and several values. Extensions at the end that nobody fills may be left out.
    """

    def teller(values: Callable[Shown, Values | None]) -> Teller[Shown]:
        return Teller(name, fields, values)

    return teller
