"""The page's end of the status socket: the newest picture, the track, plan and fence, and orders handed on unread."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from ..io.local_socket import connect
from .live import page_fields
from .track import PageTrack

AGAIN_S: Final = 1.0
"""Between two tries to reach a vessel that is not there."""
SILENT_S: Final = 3.0
"""A vessel's process that says nothing for so long hangs: the connection is made anew."""
ASK_S: Final = 1.8
"""How long an order is waited for: the page says NOT HEARD after two seconds."""
_LINE_MAX: Final = 1 << 20
ASKED_MAX: Final = 64
"""Questions under way at once; the vessel keeps as many answers."""
_OF_ONE_MAX: Final = 4
"""Of one address: two telephones behind one access point, each with its challenge and its order. A stranger's flood ends here, and
the operator's order goes on."""


class NotHeardError(Exception):
    """The vessel has not answered."""


class VesselLink:
    """Keeps a connection to the vessel for ever. ``on_news`` is called after each picture."""

    def __init__(self, places: list[Path], on_news: Callable[[], None] = lambda: None) -> None:
        self._places = places
        self._on_news = on_news
        self._writer: asyncio.StreamWriter | None = None
        self._asked: dict[int, asyncio.Future[dict[str, Any]]] = {}
        self._of_host: Counter[str] = Counter()
        """Questions under way of each address."""
        self._number = 0
        self._heard_s = -math.inf
        self._drawn: list[int] | None = None
        self.hello: dict[str, Any] = {}
        self.picture: dict[str, Any] | None = None
        self.drawing: dict[str, Any] = {}
        self.track = PageTrack()

    async def run(self) -> None:
        """Connect, read, begin again; ends when it is cancelled."""
        while True:
            with contextlib.suppress(OSError, ValueError, asyncio.IncompleteReadError, TimeoutError):
                await self._read_on()
            self._let_go()
            await asyncio.sleep(AGAIN_S)

    def newest(self) -> dict[str, Any] | None:
        """What the page is shown: the picture, and how old it is; None before the first."""
        if self.picture is None:
            return {"age_s": None, "name": self.hello.get("name", "")}
        age_s = time.monotonic() - self._heard_s
        fields = page_fields(self.picture)
        return {
            **fields,
            "age_s": 0 if age_s < SILENT_S else int(age_s),
            "name": self.hello.get("name", ""),
            "orders": bool(self.hello.get("orders")),
        }

    async def ask(self, *, host: str, **message: Any) -> dict[str, Any]:
        """Ask the vessel for somebody at an address, and wait for its answer. Raises NotHeardError."""
        writer = self._writer
        if writer is None or len(self._asked) >= ASKED_MAX or self._of_host[host] >= _OF_ONE_MAX:
            raise NotHeardError
        self._number += 1
        number = self._number
        answer: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()
        self._asked[number] = answer
        self._of_host[host] += 1
        try:
            writer.write(json.dumps({**message, "host": host, "id": number}).encode() + b"\n")
            return await asyncio.wait_for(answer, ASK_S)
        except (TimeoutError, OSError):
            raise NotHeardError from None
        finally:
            self._asked.pop(number, None)
            self._of_host -= Counter({host: 1})

    async def _read_on(self) -> None:
        reader, self._writer = await self._connected()
        self._drawn = None
        while True:
            line = await asyncio.wait_for(reader.readline(), SILENT_S)
            if not line:
                return
            message = json.loads(line)
            if "picture" in message:
                self._take(message["picture"])
            elif "hello" in message:
                self.hello = message["hello"]
            elif message.get("id") in self._asked and not self._asked[message["id"]].done():
                self._asked[message["id"]].set_result(message)
            elif "drawing" in message:
                self.drawing = message["drawing"]

    async def _connected(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        for place in self._places:
            try:
                stream = connect(place, AGAIN_S)
            except OSError:
                continue
            stream.setblocking(False)
            return await asyncio.open_unix_connection(sock=stream, limit=_LINE_MAX)
        raise FileNotFoundError(str(self._places[0]))

    def _take(self, picture: dict[str, Any]) -> None:
        self.picture, self._heard_s = picture, time.monotonic()
        lat, lon = picture.get("lat_deg"), picture.get("lon_deg")
        if isinstance(lat, float) and isinstance(lon, float):
            self.track.add(lat, lon, picture.get("keel_m"))
        if picture.get("plan_ids") != self._drawn and self._writer is not None:
            self._drawn = picture.get("plan_ids")
            self._writer.write(b'{"ask":"drawing","id":0}\n')
        self._on_news()

    def _let_go(self) -> None:
        if self._writer is not None:
            self._writer.close()
        self._writer = None
        for answer in self._asked.values():
            if not answer.done():
                answer.set_exception(NotHeardError())
