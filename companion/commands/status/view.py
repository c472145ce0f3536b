"""Shows the vessel's own snapshots where it runs: a live panel on a terminal, plain lines in a pipe."""

from __future__ import annotations

import os
import sys
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Final, Protocol, TextIO

from mavlink_bridge.language.messages import LogText
from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.radio.air import Ledger

from ...io.loop import LoopApp, Waited
from ...io.outlet import Outlet
from ...ports import GroundPort
from ...status.picture import Picture, picture_of
from ...status.service import TEXTS_KEPT
from .journal import LinkNotes
from .panel import PanelLine, coloured, line, panel

SCREEN_PERIOD_US: Final = 250_000
LINE_PERIOD_US: Final = 5_000_000
_PANELS_KEPT: Final = 2
"""Older ones are of no use to a reader who comes back."""


class SnapshotView(Protocol):
    """What looks at each snapshot."""

    def update(self, snapshot: Snapshot) -> None: ...
    def close(self) -> None: ...


class Views:
    """Several that look at the same."""

    def __init__(self, *views: SnapshotView) -> None:
        self._views = views

    def update(self, snapshot: Snapshot) -> None:
        """Show one tick's picture to all."""
        for view in self._views:
            view.update(snapshot)

    def close(self) -> None:
        """Close all."""
        for view in self._views:
            view.close()


class Screen:
    """Draws a panel over the one before, on a terminal."""

    def __init__(self, out: TextIO, write: Callable[[str], bool] | None = None) -> None:
        """``write``: takes a picture for ``out`` and says whether it went there; else it is written at once."""
        self._out = out
        self._write = write or self._write_now
        self._height = 0

    def size(self) -> tuple[int, int]:
        """Columns and lines; 80 x 24 where nobody says."""
        try:
            found = os.get_terminal_size(self._out.fileno())
        except (OSError, ValueError):
            return 80, 24
        return (found.columns or 80), (found.lines or 24)

    def draw(self, picture: Picture, more: Sequence[PanelLine] = ()) -> None:
        """Draw a picture, with lines of one's own above it. Raises OSError, ValueError when nobody reads any more."""
        width, height = self.size()
        lines = [*more, *panel(picture, width, height - 1 - len(more))]
        up = f"\x1b[{self._height}F" if self._height else ""
        if self._write(up + "".join(f"\x1b[2K{text}\n" for text in coloured(lines)) + "\x1b[J"):
            self._height = len(lines)

    def _write_now(self, text: str) -> bool:
        self._out.write(text)
        self._out.flush()
        return True


class StatusView:
    """Shows snapshots: ``update`` with each, ``close`` at the end. On a terminal a live panel, else plain lines.

    ``speed`` is how many simulated seconds pass in a real one; the view's own pace is in real time. ``airtime`` is asked
    what the radio's hour holds.
    """

    def __init__(
        self,
        out: TextIO | None = None,
        *,
        plain: bool | None = None,
        speed: float = 1.0,
        airtime: Callable[[int], str] | None = None,
    ) -> None:
        self._out = out or sys.stdout
        self.plain = not self._out.isatty() if plain is None else plain
        self._period_us = round((LINE_PERIOD_US if self.plain else SCREEN_PERIOD_US) * max(speed, 1.0))
        self._due_us = 0
        self._texts: deque[LogText] = deque(maxlen=TEXTS_KEPT)
        self._airtime = airtime or (lambda now_us: "")
        self._notes = LinkNotes()
        self._outlet = Outlet(self._out) if self.plain else Outlet(self._out, _PANELS_KEPT)
        self._screen = Screen(self._out, self._outlet.write)

    def update(self, snapshot: Snapshot) -> None:
        """Take one tick's picture; cheap unless something is due to be shown."""
        self._texts.extend(snapshot.texts)
        if self.plain:
            for text in snapshot.texts:
                self._print(f"{_time(text.t_us)}  {text.severity.name.lower():9} {text.text}")
            self._notes.update(snapshot)
        if snapshot.t_us < self._due_us:
            return
        self._due_us = snapshot.t_us + self._period_us
        picture = picture_of(snapshot, tuple(self._texts), self._airtime(snapshot.t_us))
        if self.plain:
            self._print(line(picture))
        else:
            self._screen.draw(picture)

    def close(self) -> None:
        """The last panel stays."""
        self._outlet.close()

    def _print(self, text: str) -> None:
        self._outlet.write(text + "\n")


def _time(t_us: int) -> str:
    seconds = t_us // 1_000_000
    return f"{seconds // 3600}:{seconds // 60 % 60:02d}:{seconds % 60:02d}"


def airtime_of(grounds: Sequence[GroundPort]) -> Callable[[int], str]:
    """What the radio has sent in the last hour and may send, in words; empty without a radio, or before it is open."""

    def told(now_us: int) -> str:
        for port in grounds:
            for talk in port.conversations.values():
                ledger = getattr(talk, "ledger", None)
                if isinstance(ledger, Ledger):
                    limit = "" if ledger.limit_us is None else f" of {ledger.limit_us * 1e-6:.0f} s"
                    return f"{ledger.used_us(now_us) * 1e-6:.1f}{limit or ' s'} in this hour"
        return ""

    return told


class Watched:
    """An app (or a world) whose every tick is shown."""

    def __init__(self, app: LoopApp, view: SnapshotView) -> None:
        self._app = app
        self._view = view

    @property
    def links(self) -> Sequence[Waited]:
        return self._app.links

    def __getattr__(self, name: str) -> Any:
        return getattr(self._app, name)

    def pump(self, now_us: int) -> None:
        self._app.pump(now_us)

    def tick(self, now_us: int, *, late_s: float = 0.0, load: float = 0.0) -> object:
        snapshot = self._app.tick(now_us, late_s=late_s, load=load)
        if isinstance(snapshot, Snapshot):
            self._view.update(snapshot)
        return snapshot

    def shutdown(self, now_us: int) -> None:
        self._app.shutdown(now_us)
        self._view.close()
