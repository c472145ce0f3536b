"""What each station is told once by itself: who this is, and what has been wrong since before it came.

Said at its first HEARTBEAT, and again 3 s after its first request, because a ground station's window shows no text of the
milliseconds in which it connects. A station that starts again asks again, and is greeted again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from ...language.messages import Severity
from ...language.snapshot import Snapshot
from ..persona import EndpointConfig, Identity
from ..persona.identity import greeting
from ..wire.cmd import Cmd
from ..wire.payload import message_id

WAIT_US: Final = 3_000_000
"""QGroundControl shows what comes once its connect sequence is over: 2.5 s, measured."""
GONE_US: Final = 3_500_000
"""After so long a silence a station that asks has been started again, or the link has: QGroundControl's own time-out."""
AGAIN_US: Final = 15_000_000
"""A program started again within the time above shows it by asking for AUTOPILOT_VERSION, at the earliest after so long."""
_MAX_STATIONS: Final = 32
_AUTOPILOT_VERSION: Final = message_id("AUTOPILOT_VERSION")
_COMMANDS: Final = frozenset(("COMMAND_LONG", "COMMAND_INT"))


class Greeter:
    """One link's. ``say`` queues a text for this link; ``on_station`` is told of each station's first HEARTBEAT (id, persona)."""

    def __init__(
        self,
        config: EndpointConfig,
        identity: Callable[[], Identity],
        say: Callable[[int, str], None],
        on_station: Callable[[int, str], None] | None,
    ) -> None:
        self._config, self._identity, self._say, self._on_station = config, identity, say, on_station
        self._heard: dict[tuple[int, int], int] = {}
        self._greeted: dict[tuple[int, int], int] = {}
        self._due_us: int | None = None

    def welcome(self, system: int) -> None:
        """A station's first HEARTBEAT."""
        self._say(Severity.INFO, greeting(self._identity(), self._config))
        if self._on_station is not None:
            self._on_station(system, self._config.persona)

    def hears(self, message: Any, now_us: int) -> None:
        """Note who speaks; a first request starts the wait."""
        who = message.get_srcSystem(), message.get_srcComponent()
        last_us = self._heard.pop(who, None)
        if len(self._heard) >= _MAX_STATIONS:
            lost = next(iter(self._heard))
            del self._heard[lost]
            self._greeted.pop(lost, None)
        self._heard[who] = now_us
        if last_us is None or now_us - last_us >= GONE_US:
            self._greeted.pop(who, None)
        if getattr(message, "target_system", None) != self._config.system_id:
            return
        greeted_us = self._greeted.get(who)
        if greeted_us is None or (now_us - greeted_us >= AGAIN_US and _asks_who(message)):
            self._greeted[who] = now_us
            self._due_us = now_us + WAIT_US

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        """Say it when it is due: one greeting for all that came meanwhile."""
        if self._due_us is None or now_us < self._due_us:
            return
        self._due_us = None
        self._say(Severity.INFO, greeting(self._identity(), self._config))
        for severity, text in snapshot.standing:
            self._say(severity, text)
        for each in snapshot.outlook:
            sentence = each.sentence()
            self._say(Severity.WARNING, sentence[:1].upper() + sentence[1:])


def _asks_who(message: Any) -> bool:
    if message.get_type() not in _COMMANDS:
        return False
    wants = message.command == Cmd.REQUEST_MESSAGE and message.param1 == _AUTOPILOT_VERSION
    return bool(wants or message.command == Cmd.REQUEST_AUTOPILOT_CAPABILITIES)
