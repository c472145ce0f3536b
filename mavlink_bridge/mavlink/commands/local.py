"""Commands that an endpoint answers by itself, without the vessel: messages on request, stream rates, the high-latency switch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Protocol

from ..persona import EndpointConfig, VehiclePort, modes
from ..persona.identity import autopilot_version
from ..telemetry.streams import HEARTBEAT, STREAMED, Streams
from ..wire.cmd import Cmd
from ..wire.codec import dialect
from ..wire.payload import Packed, message_id, packed
from .command import ACCEPTED, DENIED, REJECTED_NOW, UNSUPPORTED, Command, Refused, denied

_AUTOPILOT_VERSION: Final = message_id("AUTOPILOT_VERSION")
_AVAILABLE_MODES: Final = message_id("AVAILABLE_MODES")
_COMPONENT_METADATA: Final = message_id("COMPONENT_METADATA")
_HOME_POSITION: Final = message_id("HOME_POSITION")
_MESSAGE_INTERVAL: Final = message_id("MESSAGE_INTERVAL")
_PROTOCOL_VERSION: Final = message_id("PROTOCOL_VERSION")
_MAVLINK_1, _MAVLINK_2 = 100, 200
"""As PROTOCOL_VERSION counts them."""

LOCAL: Final = frozenset(
    (
        Cmd.GET_HOME_POSITION,
        Cmd.GET_MESSAGE_INTERVAL,
        Cmd.SET_MESSAGE_INTERVAL,
        Cmd.REQUEST_MESSAGE,
        Cmd.REQUEST_PROTOCOL_VERSION,
        Cmd.REQUEST_AUTOPILOT_CAPABILITIES,
        Cmd.CONTROL_HIGH_LATENCY,
    )
)


class Host(Protocol):
    """What the endpoint lends to its local commands."""

    config: EndpointConfig
    vehicle: VehiclePort
    streams: Streams
    high_latency_on: bool

    def compose(self, number: int) -> Packed | None: ...
    def component_metadata(self) -> Any: ...


@dataclass(frozen=True, slots=True)
class LocalAnswer:
    """MAV_RESULT and the messages that follow the acknowledgement."""

    result: int
    messages: tuple[Packed, ...] = ()
    reason: str = ""


def answer(host: Host, command: Command) -> LocalAnswer:
    """Carry out a command of ``LOCAL``."""
    try:
        return _HANDLERS[command.id](host, command)
    except Refused as refusal:
        return LocalAnswer(refusal.result, reason=refusal.reason)


def _request_message(host: Host, command: Command) -> LocalAnswer:
    number = command.whole(1, -1, -1, 0xFFFFFF)
    if number == _AUTOPILOT_VERSION:
        return _version(host, command)
    if number == _AVAILABLE_MODES:
        return _modes(host, command)
    if number == _COMPONENT_METADATA:
        metadata = host.component_metadata()
        return LocalAnswer(UNSUPPORTED) if metadata is None else LocalAnswer(ACCEPTED, (packed(metadata),))
    if number == _PROTOCOL_VERSION:
        return _protocol(host, command)
    if number == _MESSAGE_INTERVAL:
        return _interval(host, command.whole(2, -1, -1, 0xFFFF))
    if number not in STREAMED:
        return LocalAnswer(UNSUPPORTED)
    message = host.compose(number)
    return LocalAnswer(REJECTED_NOW) if message is None else LocalAnswer(ACCEPTED, (message,))


def _version(host: Host, _: Command) -> LocalAnswer:
    return LocalAnswer(ACCEPTED, (packed(autopilot_version(host.vehicle.identity, host.config)),))


def _protocol(host: Host, _: Command) -> LocalAnswer:
    """QGroundControl 4.x takes a generic vehicle that does not say it speaks MAVLink 2 for one without fence and rally points."""
    unknown = [0] * 8
    version = dialect.MAVLink_protocol_version_message(_MAVLINK_2, _MAVLINK_1, _MAVLINK_2, unknown, unknown)
    return LocalAnswer(ACCEPTED, (packed(version),))


def _modes(host: Host, command: Command) -> LocalAnswer:
    index = command.whole(2, 0, 0, 255)
    if index > len(modes.FACES):
        return LocalAnswer(DENIED)
    wanted = (index,) if index else range(1, len(modes.FACES) + 1)
    return LocalAnswer(ACCEPTED, tuple(packed(modes.available_modes(number, host.config)) for number in wanted))


def _home(host: Host, _: Command) -> LocalAnswer:
    message = host.compose(_HOME_POSITION)
    return LocalAnswer(REJECTED_NOW, reason="no home yet") if message is None else LocalAnswer(ACCEPTED, (message,))


def _set_interval(host: Host, command: Command) -> LocalAnswer:
    number = command.whole(1, -1, -1, 0xFFFFFF)
    interval_us = command.given(2)
    if number not in STREAMED:
        return LocalAnswer(UNSUPPORTED)
    if number == HEARTBEAT or interval_us is None or not host.streams.set_interval(number, interval_us):
        return LocalAnswer(DENIED, reason=f"message {number}: that rate cannot be had")
    return LocalAnswer(ACCEPTED)


def _get_interval(host: Host, command: Command) -> LocalAnswer:
    return _interval(host, command.whole(1, -1, -1, 0xFFFF))


def _interval(host: Host, number: int) -> LocalAnswer:
    """MESSAGE_INTERVAL of the message with this number."""
    interval_us = host.config.heartbeat_us if number == HEARTBEAT else host.streams.interval_us(number)
    message = dialect.MAVLink_message_interval_message(message_id=max(number, 0), interval_us=interval_us)
    return LocalAnswer(ACCEPTED, (packed(message),))


def _high_latency(host: Host, command: Command) -> LocalAnswer:
    switch_on = command.whole(1, 0, 0, 1) == 1
    if host.config.profile != "high_latency":
        if switch_on:
            raise denied("this link has no high-latency mode")
        return LocalAnswer(ACCEPTED)
    host.high_latency_on = switch_on
    return LocalAnswer(ACCEPTED)


_HANDLERS: Final[dict[int, Callable[[Host, Command], LocalAnswer]]] = {
    Cmd.GET_HOME_POSITION: _home,
    Cmd.GET_MESSAGE_INTERVAL: _get_interval,
    Cmd.SET_MESSAGE_INTERVAL: _set_interval,
    Cmd.REQUEST_MESSAGE: _request_message,
    Cmd.REQUEST_PROTOCOL_VERSION: _protocol,
    Cmd.REQUEST_AUTOPILOT_CAPABILITIES: _version,
    Cmd.CONTROL_HIGH_LATENCY: _high_latency,
}
