"""SETUP_SIGNING: a station hands the vessel a new key, where that is allowed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ..wire.signing import SigningState, setup_refusal
from .channel import Channel
from .service import Handler, Service


class Keys(Service):
    """``on_key`` takes the new key; None: keys are set on the vessel only."""

    def __init__(self, channel: Channel, signing: SigningState, on_key: Callable[[bytes], None] | None) -> None:
        self._channel, self._signing, self._on_key = channel, signing, on_key

    @property
    def handles(self) -> Mapping[str, Handler]:
        return {"SETUP_SIGNING": self._on_setup}

    def _on_setup(self, message: Any, now_us: int) -> None:
        key = bytes(message.secret_key)
        refusal = setup_refusal(
            self._signing,
            message.verdict,
            key=key,
            version=1 if message.get_msgbuf()[:1] == b"\xfe" else 2,
            armed=self._channel.armed,
            radio=self._channel.config.profile != "lan",
        )
        if refusal or self._on_key is None:
            self._channel.explain(refusal or "keys are set on the vessel, not over MAVLink")
        else:
            self._on_key(key)
