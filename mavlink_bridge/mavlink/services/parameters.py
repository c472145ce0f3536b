"""Parameters: read, listed and set; a value is told again when the vessel has taken it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...language.requests import Reply
from ..files.params import ParamServer
from .channel import Channel
from .service import Handler, Service


class Parameters(Service):
    """The parameter protocol of one endpoint (``ParamServer`` has its rules)."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._server = ParamServer(channel.params, channel.explain)

    @property
    def handles(self) -> Mapping[str, Handler]:
        return {
            "PARAM_REQUEST_LIST": self._on_list,
            "PARAM_REQUEST_READ": lambda message, now_us: self._channel.answer(self._server.request_read(message)),
            "PARAM_SET": self._on_set,
        }

    def reply(self, request_id: int, reply: Reply, now_us: int) -> bool:
        messages = self._server.reply(request_id, reply)
        self._channel.answer(messages or ())
        return messages is None

    def changed(self, name: str) -> None:
        """Tell of a parameter that somebody else changed."""
        self._channel.answer(self._server.changed(name))

    def _on_list(self, message: Any, now_us: int) -> None:
        self._server.request_list()
        self._channel.bulk(self._server.next)

    def _on_set(self, message: Any, now_us: int) -> None:
        messages, body = self._server.set(message)
        self._channel.answer(messages)
        if body is not None:
            self._channel.ask(body, message.get_srcSystem(), lambda number: self._server.asked(number, message))
