"""Who commands: whose silence counts as a lost ground station, and whose orders may set the vessel moving.

The station that last armed or ordered motion commands. Others that are heard are observers: their HEARTBEAT keeps no failsafe
asleep, and their Hold, Return and Disarm are obeyed all the same. ``operator.ids`` narrows who may ever command. Nothing here
reads a clock or knows a link; the app says who was heard, ``orders.py`` who ordered what.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from mavlink_bridge.language.leading import leads
from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.requests import (
    ACCEPTED,
    EnableFence,
    LoadPlan,
    PlanKind,
    Reply,
    RequestBody,
    Result,
    SetHomePosition,
    SetParameter,
    TakeCommand,
)
from mavlink_bridge.language.stations import Heard, Station

INSIST_US: Final = 30_000_000
"""How long a request for command stands: time to read the text and press again."""
INSIST_AFTER_US: Final = 4_000_000
"""A repeat that comes sooner is the program's own (QGroundControl repeats a mode for 3.9 s), not a person's."""


@dataclass(frozen=True, slots=True)
class Ages:
    """Seconds since the commanding station was last heard, by kind of link; None = never over that kind."""

    gcs_s: float | None = None
    radio_s: float | None = None


class Operators:
    """Keeps who commands. ``ids``: "system" or "system/component", as in the settings; empty = anybody may take command.

    ``gcs_s`` and ``radio_s``: after how long a commander over that kind of link is silent.
    """

    def __init__(self, ids: Iterable[str] = (), *, gcs_s: float = 5.0, radio_s: float = 65.0) -> None:
        self.configure(ids, gcs_s=gcs_s, radio_s=radio_s)
        self.commander: Station | None = None
        """Who last armed or ordered motion; None until somebody has, or after he has released the command."""
        self.texts: list[tuple[Severity, str]] = []
        self._heard_us: int | None = None
        """When the commander last gave a sign of life."""
        self._local_us: int | None = None
        """When the vessel's own people (a scenario, the command line) last ordered."""
        self._anybody_us: dict[bool, int] = {}
        """When any station that may command was last heard, over the radio (True) or not; it stays when a link is closed."""
        self._wish: tuple[Station, int] | None = None

    def configure(self, ids: Iterable[str], *, gcs_s: float, radio_s: float) -> None:
        self._ids = frozenset(_parse(each) for each in ids)
        self._gcs_us, self._radio_us = round(gcs_s * 1e6), round(radio_s * 1e6)

    # ---- whose silence counts

    def ages(self, heard: Iterable[Heard], now_us: int) -> Ages:
        """Return the ages that the failsafe judges. Before anybody commands, whoever may command counts."""
        commander = self.commander
        his_us: dict[bool, int] = {}
        for each in heard:
            station = each.station
            if not self.may_command(station):
                continue
            _latest(self._anybody_us, station.radio, each.t_us)
            if commander is not None and self._same(station, commander):
                self._heard_us = each.t_us if self._heard_us is None else max(self._heard_us, each.t_us)
                _latest(his_us, station.radio, each.t_us)
        if commander is not None and self._heard_us is not None:
            # what is no longer in any table, after a link was closed, was heard all the same
            _latest(his_us, commander.radio, self._heard_us)
        by_kind = dict(self._anybody_us if commander is None else his_us)
        if self._local_us is not None:
            _latest(by_kind, False, self._local_us)
        return Ages(_age_s(by_kind.get(False), now_us), _age_s(by_kind.get(True), now_us))

    def hears(self, heard: Iterable[Heard]) -> bool:
        """Whether any station that may command is heard now, or ever was."""
        return bool(self._anybody_us) or any(self.may_command(each.station) for each in heard)

    def may_command(self, station: Station) -> bool:
        """Whether the configuration lets this station command."""
        ids = self._ids
        if station.bystander:
            return False
        if station.gateway:
            return True  # the gateway has ids of its own, and the radio's key
        return not ids or (station.system, None) in ids or (station.system, station.component) in ids

    def is_same(self, one: Station | None, other: Station | None) -> bool:
        """Whether two orders come from one hand; None = the vessel's own people."""
        return one is other if one is None or other is None else self._same(one, other)

    def _same(self, one: Station, other: Station) -> bool:
        """With configured ids the ids alone say who it is, on whatever link; without, only the same place does."""
        if self._ids:
            return (one.system, one.component) == (other.system, other.component)
        return one == other

    # ---- who may order

    def objection(self, body: RequestBody, station: Station | None, now_us: int, *, manual: bool) -> str:
        """Return why this station may not ask for this, or "": who moves the vessel must command, who sets what stands must be able to."""
        if leads(body, manual=manual):
            return self.refusal(station, now_us)
        if body.nature.sets and station is not None and not self.may_command(station):
            return _no_operator(station)
        return ""

    def refusal(self, station: Station | None, now_us: int) -> str:
        """Return why this station may not set the vessel moving now, or "".

        Without configured ids whoever orders takes command. With them it passes from one operator to another who asks for it
        (``take``, or the same order again by a person), and at once when the commander is silent.
        """
        if station is None:
            return ""
        if not self.may_command(station):
            return _no_operator(station)
        commander = self.commander
        if not self._ids or commander is None or self._same(station, commander) or self.silent(now_us):
            return ""
        wish = self._wish
        if wish is not None and self._same(wish[0], station) and now_us - wish[1] <= INSIST_US:
            if now_us - wish[1] >= INSIST_AFTER_US:
                return ""
        else:
            self._wish = station, now_us
            asker, holder = _start(station.beside(commander)), commander.beside(station)
            self.texts.append((Severity.WARNING, f"{asker} asks for command, {holder} has it"))
        return f"{commander.beside(station)} commands: order again in {INSIST_AFTER_US // 1_000_000} s to take command"

    def silent(self, now_us: int) -> bool:
        """Whether nobody commands, or who does has not been heard for its link's time-out."""
        if self.commander is None or self._heard_us is None:
            return True
        return now_us - self._heard_us >= (self._radio_us if self.commander.radio else self._gcs_us)

    # ---- what was ordered

    def ordered(self, station: Station | None, now_us: int, *, leads: bool) -> None:
        """An order was carried out: it restarts its sender's timer. ``leads``: it set the vessel moving, or armed it.

        An order that stops, or leads home, passes command only where nobody else is there to have it.
        """
        if station is None:
            self._local_us = now_us
            return
        if station.bystander:
            return  # somebody on the pier has stopped the vessel; that is no station's sign of life
        commander = self.commander
        if commander is not None and self._same(station, commander):
            self._heard_us = now_us
            self.commander = station
        elif self.may_command(station) and (leads or self.silent(now_us)):
            self._pass_to(station, now_us)

    def obeyed(self, body: RequestBody, station: Station | None, now_us: int, *, manual: bool) -> None:
        """A request was carried out; ``manual``: sticks steer."""
        leading = leads(body, manual=manual)
        if leading or body.nature.decides or body.nature.stops:
            self.ordered(station, now_us, leads=leading)

    def has_set(self, body: RequestBody, station: Station | None, *, armed: bool) -> None:
        """Something that stands was changed. Command does not pass by it, so the commander is told of what others change under way."""
        commander = self.commander
        if not body.nature.sets or station is None or commander is None or not armed or self._same(station, commander):
            return
        self.texts.append((Severity.WARNING, f"{_start(station.beside(commander))} {_changed(body)}"))

    def asked(self, body: TakeCommand, station: Station | None, now_us: int) -> Reply:
        """The explicit request for command, or its release; nothing moves by it."""
        if station is None:
            return Reply(Result.DENIED, "only a station commands")
        if body.take:
            refusal = self.take(station, now_us)
            return Reply(Result.DENIED, refusal) if refusal else ACCEPTED
        self.release(station, now_us)
        return ACCEPTED

    def drain_texts(self) -> list[tuple[Severity, str]]:
        texts, self.texts = self.texts, []
        return texts

    def take(self, station: Station, now_us: int) -> str:
        """The explicit request for command; returns a refusal or ""."""
        if not self.may_command(station):
            return f"{station} is no operator here (operator.ids)"
        if self.commander is None or not self._same(station, self.commander):
            self._pass_to(station, now_us)
        self._heard_us = now_us
        return ""

    def release(self, station: Station, now_us: int) -> None:
        """The commander leaves: until somebody orders, whoever may command counts, and he by what he last said."""
        if self.commander is not None and self._same(station, self.commander):
            self.commander = self._heard_us = None
            _latest(self._anybody_us, station.radio, now_us)
            self.texts.append((Severity.INFO, f"{_start(str(station))} has given up command"))

    def _pass_to(self, station: Station, now_us: int) -> None:
        before = self.commander
        self.commander, self._heard_us, self._wish = station, now_us, None
        if before is not None:
            self.texts.append(
                (Severity.WARNING, f"{_start(station.beside(before))} commands now, not {before.beside(station)}")
            )


class StickOwner:
    """Who has the sticks: manual control comes from one station at a time; None = the vessel's own people."""

    def __init__(self) -> None:
        self._owner: tuple[Station | None, int] | None = None

    def owner(
        self, station: Station | None, now_us: int, timeout_s: float, neutral_s: float
    ) -> tuple[Station | None, str]:
        """A stick message came. Return who has the sticks, and what is to be told of a change of hands.

        They are free when their owner has been silent for ``timeout_s``; to the same program on another link when they are neutral,
        after ``neutral_s``.
        """
        owner = self._owner
        silent_s = min(timeout_s, neutral_s) if owner and _is_one_program(owner[0], station) else timeout_s
        if owner is None or now_us - owner[1] > silent_s * 1e6:
            return station, self._hand_over(station, now_us)
        if owner[0] == station:
            self._owner = (station, now_us)
        return owner[0], ""

    def take(self, station: Station | None, now_us: int, timeout_s: float) -> str:
        """``station`` orders manual control: the same, with the time after which sticks are neutral."""
        owner = self._owner
        stopped = owner is not None and now_us - owner[1] > timeout_s * 1e6
        return self._hand_over(station, now_us) if station is not None and stopped else ""

    def _hand_over(self, station: Station | None, now_us: int) -> str:
        before = self._owner
        self._owner = (station, now_us)
        if before is None or before[0] is None or station is None or before[0] == station:
            return ""
        return f"{_start(station.beside(before[0]))} has the sticks now, not {before[0].beside(station)}"


def _is_one_program(one: Station | None, other: Station | None) -> bool:
    """Whether two stations are, by all that is known, one program on two links. A serial link tells no host."""
    if one is None or other is None or not one.host:
        return False
    return (one.system, one.component, one.host) == (other.system, other.component, other.host)


def _changed(body: RequestBody) -> str:
    """What somebody has changed, in words; what has none of its own yet is told by the name of its request."""
    match body:
        case LoadPlan():
            name = {PlanKind.MISSION: "plan", PlanKind.FENCE: "fence", PlanKind.RALLY: "rally points"}[body.kind]
            return f"replaced the {name}" if body.items else f"cleared the {name}"
        case SetHomePosition():
            return "set home here" if body.lat_rad is None else "set home"
        case EnableFence():
            return f"switched the fence {'on' if body.enable else 'off'}"
        case SetParameter():
            return f"set {body.name} to {body.value:g}"
        case _:
            return f"changed something ({type(body).__name__})"


def _no_operator(station: Station) -> str:
    return f"{station} is no operator here (operator.ids): it may hold, return, disarm"


def _start(text: str) -> str:
    return text[0].upper() + text[1:]


def _latest(by_kind: dict[bool, int], radio: bool, t_us: int) -> None:
    by_kind[radio] = max(by_kind.get(radio, t_us), t_us)


def _age_s(stamp_us: int | None, now_us: int) -> float | None:
    return None if stamp_us is None else (now_us - stamp_us) * 1e-6


def _parse(text: str) -> tuple[int, int | None]:
    system, _, component = text.partition("/")
    return int(system), int(component) if component else None
