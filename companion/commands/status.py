"""What a person without a ground station sees: the vessel's state on the terminal, or one plain line every few seconds."""

from __future__ import annotations

import importlib.util
import logging
import math
import sys
from collections.abc import Callable, Sequence
from typing import Any, Final, Protocol, TextIO

from mavlink_bridge.language.messages import Action, FixType, GuardState, LogText, PlanState, Severity
from mavlink_bridge.language.snapshot import LinkHealth, Snapshot
from mavlink_bridge.radio.air import Ledger

from ..core.guard.failsafe_table import BY_NAME
from ..io.links import Link
from ..io.loop import LoopApp
from ..ports import GroundPort

SCREEN_PERIOD_US: Final = 250_000
LINE_PERIOD_US: Final = 5_000_000
TEXTS_KEPT: Final = 6
_NONE: Final = "–"
_SETTLE_US: Final = 2_000_000
"""Links are given so long to open before one that is not open counts as missing."""
_KEEPERS: Final = ("Recorder", "Store")
"""Whose trouble costs what a run should leave behind, and is seen on no device."""
_DEVICES: Final = frozenset({"nmea", "actuators", "radio"})
"""Kinds of links that ought to be open; an endpoint may well have nobody at its other end."""

log = logging.getLogger(__name__)


class View(Protocol):
    """What looks at each snapshot."""

    def update(self, snapshot: Snapshot) -> None: ...
    def close(self) -> None: ...


class LinkNotes:
    """Says in the log which device is missing, when it is back, and what is not kept: what a service's journal should hold.

    ``texts`` False: somebody else shows the vessel's own words.
    """

    def __init__(self, *, texts: bool = True) -> None:
        self._texts = texts
        self._since_us: int | None = None
        self._seen: tuple[LinkHealth, ...] = ()
        self._open: dict[str, bool] = {}

    def update(self, snapshot: Snapshot) -> None:
        """Take one tick's picture."""
        for text in snapshot.texts if self._texts else ():
            if text.severity <= Severity.WARNING and text.text.startswith(_KEEPERS):
                log.warning("%s", text.text)
        if self._since_us is None:
            self._since_us = snapshot.t_us
        if snapshot.links is self._seen or snapshot.t_us - self._since_us < _SETTLE_US:
            return
        self._seen = snapshot.links
        for link in snapshot.links:
            if link.kind not in _DEVICES or self._open.get(link.name, True) == link.is_open:
                continue
            self._open[link.name] = link.is_open
            if link.is_open:
                log.info("%s is there: %s", link.name, link.text)
            else:
                log.warning("%s is missing, tried again for ever: %s", link.name, link.text)

    def close(self) -> None:
        """Nothing to give back."""


class StatusView:
    """Shows snapshots: ``update`` with each, ``close`` at the end. On a terminal with rich a live table, else plain lines.

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
        rich_here = importlib.util.find_spec("rich") is not None
        self.plain = (not self._out.isatty() or not rich_here) if plain is None else plain
        self._period_us = round((LINE_PERIOD_US if self.plain else SCREEN_PERIOD_US) * max(speed, 1.0))
        self._due_us = 0
        self._texts: list[LogText] = []
        self._airtime = airtime or (lambda now_us: "")
        self._notes = LinkNotes(texts=False)
        self._live: Any = None

    def update(self, snapshot: Snapshot) -> None:
        """Take one tick's picture; cheap unless something is due to be shown."""
        if snapshot.texts:
            self._texts = [*self._texts, *snapshot.texts][-TEXTS_KEPT:]
            if self.plain:
                for text in snapshot.texts:
                    self._print(f"{_time(text.t_us)}  {text.severity.name.lower():9} {text.text}")
        if self.plain:
            self._notes.update(snapshot)
        if snapshot.t_us < self._due_us:
            return
        self._due_us = snapshot.t_us + self._period_us
        if self.plain:
            self._print(line(snapshot))
        else:
            self._show(snapshot)

    def close(self) -> None:
        """Give the terminal back."""
        live, self._live = self._live, None
        if live is not None:
            live.stop()

    def _print(self, text: str) -> None:
        try:
            self._out.write(text + "\n")
            self._out.flush()
        except (OSError, ValueError):
            self._period_us = 1 << 62  # nobody reads any more

    def _show(self, snapshot: Snapshot) -> None:
        from rich.console import Console
        from rich.live import Live

        table = screen(snapshot, self._texts, self._airtime(snapshot.t_us))
        if self._live is None:
            self._live = Live(table, console=Console(file=self._out), auto_refresh=False, transient=False)
            self._live.start()
        self._live.update(table, refresh=True)


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

    def __init__(self, app: LoopApp, view: View) -> None:
        self._app = app
        self._view = view

    @property
    def links(self) -> Sequence[Link]:
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


def line(s: Snapshot) -> str:
    """The state in one line."""
    state = s.state
    parts = [
        _time(s.t_us),
        f"{s.mode.value}{'' if s.armed else ' (disarmed)'}",
        position(s),
        f"hdg {_deg(state.psi_rad)}",
        f"{_metres(state.sog_mps, 'm/s', 2)}",
        f"item {s.progress.seq + 1}/{s.progress.total}" if s.progress.total else "no plan",
        f"xte {_metres(s.path.cross_track_m, 'm', 2)}",
        f"water {_metres(state.alt_m, 'm', 1)}",
    ]
    if s.action > Action.NONE:
        parts.append(f"{s.action.name}: {_causes(s)}")
    if _not_ready(s):
        parts.append(f"not ready: {_not_ready(s)}")
    return "  ".join(parts)


def rows(s: Snapshot, airtime: str = "") -> list[tuple[str, str, str]]:
    """(label, text, colour) for the table."""
    state, path, output, plan = s.state, s.path, s.output, s.progress
    armed = "armed" if s.armed else "disarmed"
    found = [
        ("Mode", f"{s.mode.value}, {armed}", "green" if s.armed else "yellow"),
        ("Position", f"{position(s)}   {_receiver(s)}", "" if state.position_valid else "red"),
        (
            "Motion",
            f"heading {_compass(state.psi_rad)}, course {_compass(state.cog_rad)}, speed {_metres(state.sog_mps, 'm/s', 2)}",
            "" if state.heading_valid else "red",
        ),
        ("Plan", _plan(s), "green" if plan.state is PlanState.ACTIVE else ""),
        (
            "Errors",
            f"cross-track {_metres(path.cross_track_m, 'm', 2)}, heading {_deg(s.trace.heading_error_rad, 1)}, "
            f"speed {_metres(s.trace.speed_error_mps, 'm/s', 2)}",
            "",
        ),
        (
            "Depth",
            f"{_metres(state.alt_m, 'm', 1)} under the keel, limit {_metres(s.altitude_limit_m, 'm', 1)}, "
            f"guard {s.guard.name.lower()}",
            {GuardState.OK: "green", GuardState.CORRECTION: "yellow", GuardState.LOCKED: "red"}.get(s.guard, ""),
        ),
        (
            "Actuators",
            f"thrust {output.thruster_port:+.2f} {output.thruster_starboard:+.2f}, "
            f"rudders {_deg(output.rudder_port_rad)} {_deg(output.rudder_starboard_rad)}, {output.cause}",
            "" if s.health.actuators else "red",
        ),
        (
            "Failsafe",
            _failsafe(s),
            "green" if s.action is Action.NONE else "yellow" if s.action is Action.WARN else "red",
        ),
    ]
    if _not_ready(s):
        found.append(("Not ready", _not_ready(s), "yellow"))
    if airtime:
        found.append(("Airtime", airtime, ""))
    found += [(f"Link {link.name}", _link(link), "green" if link.is_open else "red") for link in s.links]
    return found


def screen(snapshot: Snapshot, texts: list[LogText], airtime: str = "") -> Any:
    """The live table."""
    from rich.table import Table
    from rich.text import Text

    table = Table(show_header=False, box=None, padding=(0, 1), title=f"{_time(snapshot.t_us)}", title_justify="left")
    table.add_column(style="dim", no_wrap=True)
    table.add_column()
    for label, text, colour in rows(snapshot, airtime):
        table.add_row(label, Text(text, style=colour))
    for note in texts:
        colour = "red" if note.severity <= Severity.ERROR else "yellow" if note.severity is Severity.WARNING else "dim"
        table.add_row(_time(note.t_us), Text(note.text, style=colour))
    return table


def position(s: Snapshot) -> str:
    """Latitude and longitude, or that they are not known."""
    if s.state.lat_rad is None or s.state.lon_rad is None:
        return "no position"
    return f"{math.degrees(s.state.lat_rad):.6f}° {math.degrees(s.state.lon_rad):.6f}°"


def _receiver(s: Snapshot) -> str:
    """What the receiver says, and where that is no position, why."""
    if s.fix is None:
        return "no receiver heard"
    if s.fix.fix_type is FixType.NONE:
        return "receiver has no fix"
    kind = s.fix.fix_type.name.replace("_", " ")
    return kind if s.state.position_valid else f"receiver says {kind}, not believed"


def _plan(s: Snapshot) -> str:
    plan = s.progress
    if not plan.total:
        return "none"
    target = f", {_metres(s.path.distance_m, 'm', 0)} to go" if s.path.distance_m is not None else ""
    return f"{plan.state.name.replace('_', ' ').lower()}, item {plan.seq + 1} of {plan.total}{target}"


def _failsafe(s: Snapshot) -> str:
    if s.action is Action.NONE:
        return "none"
    return f"{s.action.name.lower()}: {_causes(s)}"


def _causes(s: Snapshot) -> str:
    """What is wrong, in words, with what comes next; a picture that came over the radio has the names only."""
    if s.outlook:
        return ". ".join(each.sentence() for each in s.outlook)
    return ", ".join(BY_NAME[name].text if name in BY_NAME else name for name in s.causes)


def _not_ready(s: Snapshot) -> str:
    """Everything that keeps the vessel from being armed."""
    return "" if s.armed or s.health.prearm_ok else "; ".join(s.health.prearm_reasons)


def _link(link: LinkHealth) -> str:
    age = _NONE if link.last_rx_age_s is None else f"{link.last_rx_age_s:.1f} s ago"
    return f"{link.text or link.kind}, in {_bytes(link.bytes_in)} ({age}), out {_bytes(link.bytes_out)}"


def _bytes(count: int) -> str:
    return (
        f"{count} B" if count < 10_000 else f"{count / 1000:.0f} kB" if count < 10_000_000 else f"{count / 1e6:.0f} MB"
    )


def _metres(value: float | None, unit: str, digits: int) -> str:
    return _NONE if value is None else f"{value:.{digits}f} {unit}"


def _deg(value_rad: float | None, digits: int = 0) -> str:
    return _NONE if value_rad is None else f"{math.degrees(value_rad):.{digits}f}°"


def _compass(value_rad: float | None) -> str:
    return _NONE if value_rad is None else f"{round(math.degrees(value_rad)) % 360:03d}°"


def _time(t_us: int) -> str:
    seconds = t_us // 1_000_000
    return f"{seconds // 3600}:{seconds // 60 % 60:02d}:{seconds % 60:02d}"
