"""Sticks and set-points: what steers as long as it comes, and is answered by nobody."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ...language.requests import RequestBody
from .channel import Channel
from .guided import Unusable, attitude_target, local_target, position_target
from .manual import RcOverride, manual_control
from .service import Handler, Service


class Steering(Service):
    """Each message becomes one request of a stream, of which the vessel sees the newest."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._rc = RcOverride()

    @property
    def handles(self) -> Mapping[str, Handler]:
        return {
            "MANUAL_CONTROL": lambda message, now_us: self._steer(message, manual_control(message)),
            "RC_CHANNELS_OVERRIDE": lambda message, now_us: self._steer(message, self._rc.take(message, now_us)),
            "SET_POSITION_TARGET_GLOBAL_INT": lambda message, now_us: self._set(message, position_target),
            "SET_POSITION_TARGET_LOCAL_NED": lambda message, now_us: self._set(message, local_target),
            "SET_ATTITUDE_TARGET": lambda message, now_us: self._set(message, attitude_target),
        }

    def _set(self, message: Any, read: Callable[[Any], RequestBody]) -> None:
        try:
            self._steer(message, read(message))
        except Unusable as mistake:
            self._channel.explain(str(mistake), rarely=True)

    def _steer(self, message: Any, body: RequestBody | None) -> None:
        self._channel.stream(body, message.get_srcSystem())
