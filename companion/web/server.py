"""The page's server: many connections, each bounded in time, bytes and number, so that strangers tire themselves out.

One request a connection, or orders one after another. Whoever has not said what he wants goes first when there are too many, the oldest
of the most crowded address before all; so a new request of the operator always finds a place.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import socket
from collections.abc import Awaitable, Callable
from dataclasses import replace
from http import HTTPStatus
from typing import Any, Final

from ..io.links.places import LinkPlace, to_leave
from .http import HEAD_MAX, BadRequestError, HttpAnswer, HttpRequest, as_json, check_host, check_own_page, read_head
from .live import PERIOD_US, Feed
from .vessel import NotHeardError, VesselLink

CONNECTIONS_MAX: Final = 48
LIVE_MAX: Final = 16
"""Streams at once: more telephones than a pier has."""
LIVE_OF_ONE_MAX: Final = 6
"""Of one address: a browser opens six connections to one place."""
DOWNLOADS_MAX: Final = 2
HEAD_S: Final = 5.0
KEPT_S: Final = 2.0
"""How long a connection waits for another order: the challenge's answer and the order's way, twice a round trip of a slow link. A browser
gives the first way to the boat to its oldest question, and asks for another ever more seldom: all that waits has to go by that one."""
WRITE_S: Final = 20.0
"""A reader that takes nothing for so long is gone."""
_CHUNK: Final = 32_768
_SEND_BUFFER: Final = 16_384
_UNSENT: Final = 4096
"""Bytes of a stream that the kernel holds unsent: what a slow link has not taken is not yet history."""

log = logging.getLogger(__name__)
Handler = Callable[[HttpRequest, bytes], Awaitable[HttpAnswer]]


class Gone(Exception):  # noqa: N818 - no error: a browser has left
    """The other side is gone, or too slow."""


class PageServer:
    """Serves one vessel's page. ``routes`` answers (method, path); ``files`` opens downloads."""

    def __init__(
        self,
        vessel: VesselLink,
        routes: dict[tuple[str, str], Handler],
        download_fn: Callable[[str], tuple[int, int, HttpAnswer] | None],
        names: tuple[str, ...] = (),
    ) -> None:
        self._vessel = vessel
        self._routes = routes
        self._download = download_fn
        self._names = names
        self._waiting: dict[asyncio.StreamWriter, LinkPlace] = {}
        """Connections that are no stream; a trusted place has asked and is being answered."""
        self._live: dict[asyncio.StreamWriter, str] = {}
        self._downloads = 0
        self._server: asyncio.Server | None = None

    async def start(self, host: str, port: int) -> int:
        """Listen; return the port. Raises OSError."""
        self._server = await asyncio.start_server(self._come, host, port, limit=HEAD_MAX, backlog=64)
        return int(self._server.sockets[0].getsockname()[1])

    async def close(self) -> None:
        """Stop listening and let everybody go."""
        if self._server is not None:
            self._server.close()
        for writer in [*self._waiting, *self._live]:
            writer.transport.abort()

    # ---- one connection

    async def _come(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        peer = writer.get_extra_info("peername")
        host = str(peer[0]) if peer else ""
        now_us = _now_us()
        if len(self._waiting) >= CONNECTIONS_MAX:
            leaves = to_leave(self._waiting.items(), now_us)
            if leaves is None:
                writer.transport.abort()
                return
            self._waiting.pop(leaves)
            leaves.transport.abort()
        self._waiting[writer] = LinkPlace(host, now_us)
        try:
            await self._serve(reader, writer, host)
        except (Gone, OSError, asyncio.IncompleteReadError, TimeoutError):
            pass
        except Exception:
            log.exception("a request failed")
        finally:
            self._waiting.pop(writer, None)
            self._live.pop(writer, None)
            with contextlib.suppress(OSError, RuntimeError):
                writer.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, host: str) -> None:
        limit_s = HEAD_S
        while await self._serve_one(reader, writer, host, limit_s) and writer in self._waiting:
            self._waiting[writer] = LinkPlace(host, _now_us())  # who waits with nothing to say is a stranger again
            limit_s = KEPT_S

    async def _serve_one(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, host: str, limit_s: float
    ) -> bool:
        """Answer a request; True: the connection may carry another."""
        kept = False
        try:
            async with asyncio.timeout(limit_s):
                request, body = await self._read(reader, host)
            place = self._waiting.get(writer)
            if place is not None:
                place.trusted = request.method == "POST"  # an order is not driven out while it is under way
            if request.method == "GET" and request.path == "/live":
                await self._stream(writer, host)
                return False
            if request.method == "GET" and request.path.startswith("/runs/"):
                await self._send_file(writer, request.path.removeprefix("/runs/"))
                return False
            handler = self._routes.get((request.method, request.path))
            if handler is None:
                raise BadRequestError(HTTPStatus.NOT_FOUND)
            answer = await handler(request, body)
            kept = request.method == "POST" and request.headers.get("connection", "").lower() != "close"
        except BadRequestError as error:
            answer = HttpAnswer(error.status, body=f"{error}\n".encode())
        await self._write(writer, answer.whole(kept=kept))
        return kept

    async def _read(self, reader: asyncio.StreamReader, host: str) -> tuple[HttpRequest, bytes]:
        try:
            head = await reader.readuntil(b"\r\n\r\n")
        except asyncio.LimitOverrunError:
            raise BadRequestError(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE) from None
        request = replace(read_head(head), peer=host)
        check_host(request, self._names)
        return request, await reader.readexactly(request.body_bytes)

    async def _write(self, writer: asyncio.StreamWriter, data: bytes) -> None:
        for begin in range(0, len(data), _CHUNK):
            writer.write(data[begin : begin + _CHUNK])
            await asyncio.wait_for(writer.drain(), WRITE_S)

    # ---- the stream

    async def _stream(self, writer: asyncio.StreamWriter, host: str) -> None:
        self._waiting.pop(writer, None)
        of_host = [each for each, its_host in self._live.items() if its_host == host]
        for old in of_host[: max(0, len(of_host) - LIVE_OF_ONE_MAX + 1)]:
            self._live.pop(old)
            old.transport.abort()
        if len(self._live) >= LIVE_MAX:
            await self._write(
                writer, HttpAnswer(HTTPStatus.SERVICE_UNAVAILABLE, body=b"too many look already\n").whole()
            )
            return
        self._live[writer] = host
        _keep_short(writer)
        writer.transport.set_write_buffer_limits(high=0)
        writer.write(HttpAnswer(kind="text/event-stream").head(None) + b"retry: 1000\n\n")
        feed, moved_us = Feed(_now_us()), _now_us()
        while not writer.is_closing():
            now_us = _now_us()
            if writer.transport.get_write_buffer_size() == 0:
                moved_us = now_us
                event = feed.due(self._vessel.newest(), now_us)
                if event:
                    writer.write(event)
            elif now_us - moved_us > WRITE_S * 1e6:
                writer.transport.abort()
                return
            await asyncio.sleep(PERIOD_US * 1e-6 / 5)

    # ---- downloads

    async def _send_file(self, writer: asyncio.StreamWriter, name: str) -> None:
        if self._downloads >= DOWNLOADS_MAX:
            raise BadRequestError(HTTPStatus.SERVICE_UNAVAILABLE, "two downloads are under way: wait for one")
        found = self._download(name)
        if found is None:
            raise BadRequestError(HTTPStatus.NOT_FOUND)
        fd, size, answer = found
        self._downloads += 1
        try:
            with os.fdopen(fd, "rb") as file:
                await self._write(writer, answer.head(size))
                while size > 0 and (data := file.read(min(_CHUNK, size))):
                    size -= len(data)
                    await self._write(writer, data)
        finally:
            self._downloads -= 1


def orders(vessel: VesselLink) -> dict[tuple[str, str], Handler]:
    """The two requests of an order; the vessel judges it, and nothing here can."""

    async def handed_on(request: HttpRequest, body: bytes, ask: str, names: tuple[str, ...] = ()) -> HttpAnswer:
        check_own_page(request)
        try:
            data = json.loads(body or b"{}")
        except (ValueError, RecursionError):
            raise BadRequestError(HTTPStatus.BAD_REQUEST) from None
        if not isinstance(data, dict):
            raise BadRequestError(HTTPStatus.BAD_REQUEST)
        words: dict[str, Any] = {name: str(data.get(name, ""))[:128] for name in names}
        try:
            found = await vessel.ask(ask=ask, host=request.peer, **words)
        except NotHeardError:
            return as_json({"not_heard": True}, HTTPStatus.GATEWAY_TIMEOUT)
        return as_json({name: found[name] for name in ("challenge", "answer", "refused") if name in found})

    async def challenge(request: HttpRequest, body: bytes) -> HttpAnswer:
        return await handed_on(request, body, "challenge")

    async def order(request: HttpRequest, body: bytes) -> HttpAnswer:
        return await handed_on(request, body, "order", ("order", "nonce", "response", "page"))

    return {("POST", "/challenge"): challenge, ("POST", "/order"): order}


def _keep_short(writer: asyncio.StreamWriter) -> None:
    """Little in the kernel: what a slow link has not taken is to be replaced by what is newer."""
    stream = writer.get_extra_info("socket")
    if stream is None:
        return
    with contextlib.suppress(OSError):
        stream.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, _UNSENT)
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


def _now_us() -> int:
    return int(asyncio.get_running_loop().time() * 1e6)
