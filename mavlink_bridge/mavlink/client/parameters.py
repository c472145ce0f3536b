"""A vehicle's parameters, as jobs: the whole list with its gaps filled, one that is read, one that is set.

Source: MAVLink parameter protocol.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

from ..files.params import REAL32, real32
from ..wire.codec import dialect
from .exchange import DONE, Job, JobOutcome, Step
from .orders import REASON_S
from .texts import Texts
from .vehicle import HeardVehicle

LIST_S: Final = 3.0
LIST_TRIES: Final = 5
SET_S: Final = 1.0
MOST: Final = 4096
"""No vehicle has more; what counts higher is not believed."""
_AT_ONCE: Final = 10
_FILL_TRIES: Final = 5
_ERRORS: Final = {1: "there is no such parameter", 2: "out of range", 3: "not now", 5: "read-only", 7: "wrong type"}
"""MAV_PARAM_ERROR, for a vehicle that gives no reason."""


def fetch(vehicle: HeardVehicle, into: dict[str, float]) -> Job:
    """Read all parameters ``into`` a dict; the vehicle's own list wins over what was there."""
    to = {"target_system": vehicle.system, "target_component": vehicle.component}
    asked = dialect.MAVLink_param_request_list_message(**to)
    first = yield Step(lambda _: (asked,), _is_listed, LIST_S, LIST_TRIES)
    if first is None:
        return JobOutcome(False, "the vehicle does not tell its parameters")
    count = min(first.param_count, MOST)
    heard = {first.param_index: first}
    for _ in range(_FILL_TRIES * math.ceil(count / _AT_ONCE)):
        while len(heard) < count:
            value = yield Step(lambda _: (), _is_listed, LIST_S)
            if value is None:
                break
            heard[value.param_index] = value
        missing = [index for index in range(count) if index not in heard][:_AT_ONCE]
        if not missing:
            break
        reads = [dialect.MAVLink_param_request_read_message(param_id=b"", param_index=at, **to) for at in missing]
        value = yield Step(lambda _, reads=reads: reads, _is_listed, LIST_S)  # type: ignore[misc]
        if value is not None:
            heard[value.param_index] = value
    into.update({value.param_id: float(value.param_value) for value in heard.values()})
    return (
        DONE if len(heard) >= count else JobOutcome(False, f"{count - len(heard)} of {count} parameters did not come")
    )


def _is_listed(message: Any) -> bool:
    return bool(message.get_type() == "PARAM_VALUE" and message.param_index < MOST)


def read(vehicle: HeardVehicle, name: str, into: dict[str, float], *, answer_s: float) -> Job:
    """Read one parameter ``into`` a dict, as it is aboard now."""
    asked = dialect.MAVLink_param_request_read_message(
        target_system=vehicle.system,
        target_component=vehicle.component,
        param_id=name.encode("ascii", "replace")[:16],
        param_index=-1,
    )
    told = yield Step(lambda _: (asked,), _answers(name), SET_S, _tries(answer_s))
    if told is None:
        return JobOutcome(False, f"{name}: the vehicle does not answer")
    if told.get_type() == "PARAM_ERROR":
        return JobOutcome(False, f"{name}: {_ERRORS.get(told.error, f'error {told.error}')}")
    into[name] = float(told.param_value)
    return DONE


def _answers(name: str) -> Callable[[Any], bool]:
    return lambda heard: bool(heard.get_type() in ("PARAM_VALUE", "PARAM_ERROR") and heard.param_id == name)


def _tries(answer_s: float) -> int:
    return max(1, round(answer_s / SET_S))


def put(vehicle: HeardVehicle, name: str, value: float, *, texts: Texts, answer_s: float) -> Job:
    """Set one parameter and wait for the value that the vehicle has taken."""
    message = dialect.MAVLink_param_set_message(
        target_system=vehicle.system,
        target_component=vehicle.component,
        param_id=name.encode("ascii", "replace")[:16],
        param_value=value,
        param_type=REAL32,
    )
    since = texts.count
    echo = yield Step(lambda _: (message,), _answers(name), SET_S, _tries(answer_s))
    if echo is None:
        return JobOutcome(False, f"{name}: the vehicle does not answer")
    if echo.get_type() == "PARAM_VALUE" and echo.param_value == real32(value):
        return DONE
    yield Step(lambda _: (), lambda _: False, REASON_S)
    if texts.reasons(since):
        return JobOutcome(False, texts.reasons(since))
    if echo.get_type() == "PARAM_ERROR":
        return JobOutcome(False, f"{name}: {_ERRORS.get(echo.error, f'error {echo.error}')}")
    return JobOutcome(False, f"{name}: the vehicle keeps {echo.param_value:g}")
