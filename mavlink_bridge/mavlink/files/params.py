"""The parameter protocol: every parameter REAL32, one table per endpoint, refusals by PARAM_ERROR with the old value after it.

A list is sent as room allows, so that other traffic keeps flowing; stations that ask while it runs share the pass. Setting
a parameter is a request to the vessel: its value is echoed when the vessel has taken it. Source: MAVLink guide, parameter
protocol; gcs.md §1.1, §2.3.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from ...language.requests import Reply, Result, SetParameter
from ..persona import ParamInfo, ParamTable
from ..wire.codec import dialect
from ..wire.payload import Packed, packed

REAL32: Final = 9
DOES_NOT_EXIST: Final = 1
OUT_OF_RANGE: Final = 2
PERMISSION_DENIED: Final = 3
READ_ONLY: Final = 5
TYPE_MISMATCH: Final = 7
"""MAV_PARAM_ERROR_TYPE_MISMATCH; newer than the library's list."""


def real32(value: float) -> float:
    """Round to what a REAL32 can hold; infinite when too large."""
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


class EndpointParams:
    """The vessel's parameters followed by the persona's own read-only ones, as one table."""

    def __init__(self, table: ParamTable, stubs: Sequence[ParamInfo] = ()) -> None:
        self._table = table
        self._stubs = tuple(stub for stub in stubs if table.get(stub.name) is None)
        self._stub_index = {stub.name: number for number, stub in enumerate(self._stubs)}

    def __len__(self) -> int:
        return len(self._table) + len(self._stubs)

    def get(self, name: str) -> ParamInfo | None:
        number = self._stub_index.get(name)
        return self._table.get(name) if number is None else self._stubs[number]

    def index(self, name: str) -> int | None:
        number = self._stub_index.get(name)
        return self._table.index(name) if number is None else len(self._table) + number

    def at(self, index: int) -> ParamInfo | None:
        if not 0 <= index < len(self):
            return None
        own = len(self._table)
        return self._table.at(index) if index < own else self._stubs[index - own]


@dataclass(slots=True)
class _Waiting:
    name: str
    value: float
    sender: tuple[int, int]
    is_overtaken: bool = False
    """Whether its sender wants another value by now: a refusal would be taken for the newer one's."""


class ParamServer:
    """One endpoint's side of the parameter protocol. Handlers return (messages to send, value to ask the vessel for)."""

    def __init__(self, params: EndpointParams, explain: Callable[[str], None] = lambda reason: None) -> None:
        self._params = params
        self._explain = explain
        self._cursor = 0
        self._left = 0
        self._waiting: dict[int, _Waiting] = {}

    def request_list(self) -> None:
        """PARAM_REQUEST_LIST: everything is sent once more from where the pass is; a fresh pass starts at 0."""
        if not self._left:
            self._cursor = 0
        self._left = len(self._params)

    def next(self, now_us: int) -> Packed | None:
        """Return the list's next message, None when no list is being sent."""
        if not self._left:
            return None
        index = self._cursor
        self._cursor = (index + 1) % len(self._params)
        self._left -= 1
        info = self._params.at(index)
        return None if info is None else packed(self._value(info, index))

    def request_read(self, message: Any) -> list[Any]:
        """PARAM_REQUEST_READ, by index when it is 0 or more, else by name."""
        index: int | None = message.param_index
        if message.param_index < 0:
            index = self._params.index(message.param_id)
        info = None if index is None else self._params.at(index)
        if info is None or index is None:
            return [self._error(message, message.param_id, message.param_index, DOES_NOT_EXIST)]
        return [self._value(info, index)]

    def set(self, message: Any) -> tuple[list[Any], SetParameter | None]:
        """PARAM_SET: refuse here what can be refused without the vessel, else return what to ask it for."""
        name: str = message.param_id
        info = self._params.get(name)
        if info is None:
            return [self._error(message, name, -1, DOES_NOT_EXIST)], None
        refusal = self._refusal(message, info)
        if refusal:
            self._explain(_why(info, refusal, message.param_value))
            return self._refused(message, info, refusal), None
        waiting = _Waiting(name, message.param_value, _sender(message))
        if waiting in self._waiting.values():
            return [], None
        return [], SetParameter(name, message.param_value)

    @staticmethod
    def _refusal(message: Any, info: ParamInfo) -> int:
        value = message.param_value
        if message.param_type != REAL32:
            return TYPE_MISMATCH
        if info.read_only:
            return READ_ONLY
        if not math.isfinite(value):
            return OUT_OF_RANGE
        too_low = info.minimum is not None and value < real32(info.minimum)
        too_high = info.maximum is not None and value > real32(info.maximum)
        return OUT_OF_RANGE if too_low or too_high else 0

    def asked(self, request_id: int, message: Any) -> None:
        """Remember under which number the vessel was asked."""
        new = _Waiting(message.param_id, message.param_value, _sender(message))
        for each in self._waiting.values():
            each.is_overtaken |= (each.name, each.sender) == (new.name, new.sender)
        self._waiting[request_id] = new

    def reply(self, request_id: int, reply: Reply) -> list[Any] | None:
        """The vessel's answer: the stored value, after a PARAM_ERROR when refused; nothing for a request that is not ours. None: refused,
        and its sender wants another value by now, so that there is nothing to say.
        """
        waiting = self._waiting.pop(request_id, None)
        if waiting is None:
            return []
        if waiting.is_overtaken and reply.result is not Result.ACCEPTED:
            return None
        messages = self._told(waiting.name)
        if reply.result is not Result.ACCEPTED:
            error = PERMISSION_DENIED if reply.result is Result.REJECTED_NOW else OUT_OF_RANGE
            messages.insert(0, self._error_to(waiting.sender, waiting.name, -1, error))
        return messages

    def changed(self, name: str) -> list[Any]:
        """PARAM_VALUE of a parameter that somebody changed; nothing while an answer of the same words is about to be given here."""
        return [] if any(each.name == name for each in self._waiting.values()) else self._told(name)

    def _told(self, name: str) -> list[Any]:
        info, index = self._params.get(name), self._params.index(name)
        return [] if info is None or index is None else [self._value(info, index)]

    def _refused(self, message: Any, info: ParamInfo, error: int) -> list[Any]:
        return [self._error(message, info.name, -1, error), *self._told(info.name)]

    def _value(self, info: ParamInfo, index: int) -> Any:
        return dialect.MAVLink_param_value_message(
            param_id=info.name.encode("ascii", "replace")[:16],
            param_value=info.value,
            param_type=REAL32,
            param_count=len(self._params),
            param_index=index,
        )

    def _error(self, message: Any, name: str, index: int, error: int) -> Any:
        return self._error_to(_sender(message), name, index, error)

    @staticmethod
    def _error_to(sender: tuple[int, int], name: str, index: int, error: int) -> Any:
        return dialect.MAVLink_param_error_message(
            target_system=sender[0],
            target_component=sender[1],
            param_id=name.encode("ascii", "replace")[:16],
            param_index=index,
            error=error,
        )


def _sender(message: Any) -> tuple[int, int]:
    return message.get_srcSystem(), message.get_srcComponent()


def _why(info: ParamInfo, refusal: int, value: float) -> str:
    """In words, because older stations do not know PARAM_ERROR and just show the old value again."""
    if refusal == READ_ONLY:
        return f"{info.name} is read-only"
    if refusal == TYPE_MISMATCH:
        return f"{info.name} is a REAL32"
    unit = f" {info.unit}" if info.unit else ""
    low = "" if info.minimum is None else f"{info.minimum:g}"
    high = "" if info.maximum is None else f"{info.maximum:g}"
    return f"{info.name}: {value:g}{unit} is outside {low}...{high}"
