"""What can be fetched: files over FTP (parameters, metadata), and the logs of voyages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...language.requests import EraseLogs, Reply
from ..files import metadata
from ..files.ftp import FileServer
from ..files.logs import LogServer
from .channel import Channel
from .service import Handler, Service


class Library(Service):
    """Files and logs of one endpoint; logs over a link that can carry them only."""

    def __init__(self, channel: Channel) -> None:
        config = channel.config
        self._channel = channel
        self._erasing: set[int] = set()
        """Numbers of requests to erase that the vessel has not answered."""
        self._files = FileServer(metadata.files(channel.params))
        shelf = channel.vehicle.logs if config.profile == "lan" else None
        self._logs = LogServer(shelf, 1 if config.has_home_item else 0, channel.explain, self._erase)

    @property
    def handles(self) -> Mapping[str, Handler]:
        return dict.fromkeys(self._logs.handles, self._on_log) | {"FILE_TRANSFER_PROTOCOL": self._on_file}

    @property
    def busy(self) -> bool:
        return self._logs.busy

    def poll(self, now_us: int) -> None:
        self._channel.bulk(self._logs.next)

    def _on_file(self, message: Any, now_us: int) -> None:
        self._channel.answer(self._files.handle(message))
        self._channel.bulk(self._files.next)

    def _on_log(self, message: Any, now_us: int) -> None:
        self._logs.handle(message, now_us)

    def _erase(self) -> None:
        self._channel.ask(EraseLogs(), 0, self._erasing.add)

    def reply(self, request_id: int, reply: Reply, now_us: int) -> bool:
        if request_id in self._erasing:
            self._erasing.discard(request_id)
            self._logs.erase_answered()
        return False
