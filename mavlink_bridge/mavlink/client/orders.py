"""Orders as jobs: a command with its answer, repeated until the vehicle has spoken, and the reason when it refuses.

Repeats are safe: a vehicle answers a copy from memory. A stop is repeated until it shows. Times: a vehicle on a wire answers at its
next tick; behind a radio the answer takes seconds, with IN_PROGRESS where the vehicle may say so. Source: MAVLink command protocol.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from ...language.messages import Mode
from ..commands.command import ACCEPTED, IN_PROGRESS
from ..persona import modes
from ..wire.cmd import Cmd
from ..wire.codec import dialect
from .exchange import DONE, Job, JobOutcome, Step
from .texts import Texts
from .vehicle import SAFETY_ARMED, HeardVehicle

REPEAT_S: Final = 0.5
"""Longer than a tick and its answer; six repeats fall into the 3 s for which a vehicle of ours remembers a command."""
REASON_S: Final = 0.4
"""The text that says why comes with the refusal or just behind it."""
_FORCE: Final = 21196.0
"""COMPONENT_ARM_DISARM, parameter 2: whatever the checks say; for a disarm, at once."""
_RESULTS: Final = {
    1: "temporarily rejected",
    2: "denied",
    3: "not supported",
    4: "failed",
    6: "cancelled",
}
"""MAV_RESULT, for a vehicle that gives no reason."""


def is_ack(message: Any, number: int) -> bool:
    return bool(message.get_type() == "COMMAND_ACK" and message.command == number)


def command(
    vehicle: HeardVehicle,
    number: int,
    *params: float,
    texts: Texts,
    answer_s: float,
    shows: Callable[[Any], bool] = lambda message: False,
) -> Job:
    """COMMAND_LONG and its final answer. ``answer_s``: given up after so long without one; IN_PROGRESS starts it anew.

    ``shows``: a message by which the vehicle shows what was asked for is an answer too, so that nothing is asked for twice whose
    acknowledgement is lost. Behind a radio nothing is: there states come later than answers.
    """
    values = [*params, *([0.0] * (7 - len(params)))]

    def said(tried: int) -> list[Any]:
        fields = dict(zip(("param1", "param2", "param3", "param4", "param5", "param6", "param7"), values, strict=True))
        return [
            dialect.MAVLink_command_long_message(
                target_system=vehicle.system,
                target_component=vehicle.component,
                command=number,
                confirmation=min(tried, 255),
                **fields,
            )
        ]

    since = texts.count

    def answers(message: Any) -> bool:
        return is_ack(message, number) or shows(message)

    answer = yield Step(said, answers, REPEAT_S, max(1, round(answer_s / REPEAT_S)))
    while answer is not None and is_ack(answer, number) and answer.result == IN_PROGRESS:
        answer = yield Step(lambda _: (), answers, answer_s)
    if answer is None:
        return JobOutcome(False, "the vehicle does not answer")
    if not is_ack(answer, number) or answer.result == ACCEPTED:
        return DONE
    return (yield from _refused(answer.result, texts, since))


def _refused(result: int, texts: Texts, since: int) -> Job:
    """Wait a moment for the vehicle's own words."""
    yield Step(lambda _: (), lambda _: False, REASON_S)
    words = texts.reasons(since)
    return JobOutcome(False, words or _RESULTS.get(result, f"result {result}"))


def set_mode(vehicle: HeardVehicle, mode: Mode, *, texts: Texts, answer_s: float) -> Job:
    """Only the answer counts: the mode may be shown already by a state that is older than the order."""
    main, sub = vehicle.numbers_of(mode)
    return command(vehicle, Cmd.DO_SET_MODE, 1.0, main, sub, texts=texts, answer_s=answer_s)


def arm(vehicle: HeardVehicle, *, texts: Texts, answer_s: float) -> Job:
    def shows(message: Any) -> bool:
        return not vehicle.by_radio and message.get_type() == "HEARTBEAT" and bool(message.base_mode & SAFETY_ARMED)

    return command(vehicle, Cmd.COMPONENT_ARM_DISARM, 1.0, texts=texts, answer_s=answer_s, shows=shows)


def disarm(vehicle: HeardVehicle, *, force: bool, texts: Texts, answer_s: float) -> Job:
    """``force``: the emergency stop, whatever it is doing."""
    return command(vehicle, Cmd.COMPONENT_ARM_DISARM, 0.0, _FORCE if force else 0.0, texts=texts, answer_s=answer_s)


def start_mission(vehicle: HeardVehicle, *, texts: Texts, answer_s: float) -> Job:
    """Sail the plan from its first item. The vehicle must not be in Auto already."""

    def shows(message: Any) -> bool:
        if vehicle.by_radio or message.get_type() != "HEARTBEAT":
            return False
        return modes.from_custom_mode(message.custom_mode) is Mode.AUTO

    return command(vehicle, Cmd.MISSION_START, texts=texts, answer_s=answer_s, shows=shows)


def to_first_item(vehicle: HeardVehicle, *, texts: Texts, answer_s: float) -> Job:
    """Forget how far the plan had come."""
    return command(vehicle, Cmd.DO_SET_MISSION_CURRENT, float(vehicle.home_item), 1.0, texts=texts, answer_s=answer_s)


def request_message(vehicle: HeardVehicle, number: int, *, texts: Texts, answer_s: float) -> Job:
    return command(vehicle, Cmd.REQUEST_MESSAGE, float(number), texts=texts, answer_s=answer_s)


def set_interval(vehicle: HeardVehicle, number: int, rate_hz: float, *, texts: Texts, answer_s: float) -> Job:
    """Ask an autopilot that streams nothing by itself for a message."""
    return command(vehicle, Cmd.SET_MESSAGE_INTERVAL, float(number), 1e6 / rate_hz, texts=texts, answer_s=answer_s)


def heartbeat() -> Any:
    """MAV_TYPE_GCS, MAV_AUTOPILOT_INVALID, MAV_STATE_ACTIVE."""
    return dialect.MAVLink_heartbeat_message(
        type=6, autopilot=8, base_mode=0, custom_mode=0, system_status=4, mavlink_version=3
    )


def manual_control(vehicle: HeardVehicle, surge: float, yaw: float) -> Any:
    """Sticks, -1...1 each: ahead and to starboard positive."""
    return dialect.MAVLink_manual_control_message(
        target=vehicle.system, x=0, y=_thousandths(yaw), z=_thousandths(surge), r=0, buttons=0
    )


def _thousandths(share: float) -> int:
    return round(max(-1.0, min(1.0, share)) * 1000.0)
