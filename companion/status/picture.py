"""The picture: all that a watcher is shown, in degrees, metres and m/s, as flat values that JSON can carry.

Made of a ``Snapshot`` in the vessel's process, read by terminals and by the page. Unknown is None.
"""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any, Final

from pydantic import TypeAdapter, ValidationError

from mavlink_bridge.language.messages import FixType, LogText
from mavlink_bridge.language.snapshot import LinkHealth, Outlook, Snapshot
from mavlink_bridge.language.value import value

from . import words
from .others import Other, others_of, person_of

_PLACES_DEG: Final = 7
"""A centimetre on the ground."""
MAY_BE_ALONE: Final = frozenset({"endpoint", "plotter"})
"""Kinds of links that may have nobody at their other end as long as they listen; each other kind that is not open is missing."""
_PERSON_ROW: Final = "person_in_water"
"""The failsafe's row that means nothing without a place."""


@value
class Warned:
    """One failsafe condition that acts or warns."""

    name: str
    cause: str
    doing: str
    """What the vessel does meanwhile; "" where the name is all that is known."""
    next: str = ""
    """Name of the action that follows by itself."""
    next_in_s: float | None = None
    runs: bool = True
    """Whether the clock of what follows runs: the cause stands."""
    until: str = ""
    """What ends it, with the order that goes on."""
    sentence: str = ""


@value
class ToldText:
    """One text for the operator."""

    number: int
    t_s: float
    severity: str
    text: str


@value
class LinkSeen:
    """One link."""

    name: str
    kind: str
    is_open: bool
    age_s: float | None
    text: str
    bytes_in: int = 0
    bytes_out: int = 0
    is_listening: bool = True

    @property
    def is_missing(self) -> bool:
        """Whether it ought to be open and is not."""
        return is_missing(self)


def is_missing(link: LinkSeen | LinkHealth) -> bool:
    """Whether a link ought to be open and is not."""
    return not link.is_open and not (link.kind in MAY_BE_ALONE and link.is_listening)


@value
class Picture:
    """The vessel as a watcher sees it."""

    t_s: float
    """Of the vessel's own clock, which no watcher shares."""
    utc_s: float | None = None
    mode: str = ""
    armed: bool = False
    action: str = "NONE"
    """What the failsafe does: an ``Action`` by its name."""
    now: str = ""
    next: tuple[str, ...] = ()
    failsafes: tuple[Warned, ...] = ()
    not_ready: tuple[str, ...] = ()
    """Why it cannot be armed now; empty: it can, or is."""
    lat_deg: float | None = None
    lon_deg: float | None = None
    receiver: str = ""
    heading_deg: float | None = None
    course_deg: float | None = None
    speed_mps: float | None = None
    plan: str = ""
    """State of the plan in words."""
    item: int = 0
    """Counted from 0, without home."""
    items: int = 0
    at_item: str = ""
    """The two in words; empty without a plan."""
    to_go_m: float | None = None
    cross_track_m: float | None = None
    heading_error_deg: float | None = None
    speed_error_mps: float | None = None
    keel_m: float | None = None
    """Water under the keel."""
    keel_limit_m: float | None = None
    """The least that is allowed, as the texts name it."""
    keel_stop_m: float | None = None
    """Below this she is stopped now: more than the limit while the bottom closes, since stopping uses up water."""
    guard: str = ""
    """State of the depth guard; "off": nothing stops the boat before a shoal."""
    thrust: tuple[float, float] = (0.0, 0.0)
    """Port and starboard, -1...1."""
    rudders_deg: tuple[float, float] = (0.0, 0.0)
    output: str = ""
    """Why the actuators get what they get."""
    actuators_ok: bool = False
    battery_v: float | None = None
    fence_on: bool = False
    fence_m: float | None = None
    """To the nearest edge, positive inside."""
    home_deg: tuple[float, float] | None = None
    target_deg: tuple[float, float] | None = None
    links: tuple[LinkSeen, ...] = ()
    others: tuple[Other, ...] = ()
    """Other vessels, the most dangerous first, then by range."""
    others_known: int = 0
    """How many are known in all."""
    texts: tuple[ToldText, ...] = ()
    """The newest, oldest first."""
    airtime: str = ""
    plan_ids: tuple[int, int] = (0, 0)
    """Of plan and fence: who draws them asks again when they change."""


def picture_of(s: Snapshot, texts: tuple[LogText, ...] = (), airtime: str = "") -> Picture:
    """Take a picture. ``texts``: the newest for the operator, oldest first."""
    state, path, output, plan = s.state, s.path, s.output, s.progress
    return Picture(
        t_s=round(s.t_us * 1e-6, 2),
        utc_s=None if s.utc_us is None else round(s.utc_us * 1e-6, 1),
        mode=s.mode.value,
        armed=s.armed,
        action=s.action.name,
        now=words.doing(s),
        next=words.coming(s),
        failsafes=tuple(_warned(each, s) for each in s.outlook)
        if s.outlook or not s.causes
        else tuple(map(_named, s.causes)),
        not_ready=() if s.armed or s.health.prearm_ok else s.health.prearm_reasons,
        lat_deg=_deg(state.lat_rad, _PLACES_DEG),
        lon_deg=_deg(state.lon_rad, _PLACES_DEG),
        receiver=_receiver(s),
        heading_deg=_compass(state.psi_rad),
        course_deg=_compass(state.cog_rad),
        speed_mps=_round(state.sog_mps, 2),
        plan="none" if not plan.total else plan.state.name.replace("_", " ").lower(),
        item=plan.seq if plan.total else 0,
        items=plan.total,
        at_item=words.item_words(plan.seq, plan.total) if plan.total else "",
        to_go_m=_round(path.distance_m, 1),
        cross_track_m=_round(path.cross_track_m, 2),
        heading_error_deg=_deg(s.trace.heading_error_rad, 1),
        speed_error_mps=_round(s.trace.speed_error_mps, 2),
        keel_m=_round(state.alt_m, 2),
        keel_limit_m=_round(s.altitude_least_m, 2),
        keel_stop_m=_round(s.altitude_limit_m, 2),
        guard="off" if s.health.depth is None else s.guard.name.lower(),
        thrust=(round(output.thruster_port, 2), round(output.thruster_starboard, 2)),
        rudders_deg=(
            round(math.degrees(output.rudder_port_rad), 1),
            round(math.degrees(output.rudder_starboard_rad), 1),
        ),
        output=output.cause,
        actuators_ok=s.health.actuators,
        battery_v=None if s.supply is None else _round(s.supply.voltage_v, 2),
        fence_on=s.health.fence_enabled,
        fence_m=_round(s.fence.distance_m, 1),
        home_deg=_place(s.home_lat_rad, s.home_lon_rad),
        target_deg=_place(path.target_lat_rad, path.target_lon_rad),
        links=tuple(map(_link, s.links)),
        others=others_of(s.traffic, s.t_us),
        others_known=len(s.traffic.vessels),
        texts=tuple(ToldText(each.number, round(each.t_us * 1e-6, 2), each.severity.name, each.text) for each in texts),
        airtime=airtime,
        plan_ids=(plan.mission_id, plan.fence_id),
    )


def dumps(picture: Picture) -> str:
    """Write a picture as one line of JSON."""
    return json.dumps(fields_of(picture), separators=(",", ":"), ensure_ascii=False)


def fields_of(thing: Any) -> Any:
    """A picture or a part of it as JSON has it."""
    if isinstance(thing, tuple):
        return [fields_of(each) for each in thing]
    if dataclasses.is_dataclass(thing):
        return {each.name: fields_of(getattr(thing, each.name)) for each in dataclasses.fields(thing)}
    return thing


_ADAPTER: Final = TypeAdapter(Picture)


class NoPictureError(ValueError):
    """What came is no picture, or one of another version."""


def from_fields(data: Any) -> Picture:
    """Read a picture; fields that this version does not know are passed over. Raises NoPictureError."""
    try:
        return _ADAPTER.validate_python(data)
    except ValidationError as error:
        raise NoPictureError(f"not a picture of this version: {error.error_count()} fields differ") from None


def _warned(each: Outlook, s: Snapshot) -> Warned:
    if each.name == _PERSON_ROW and (place := person_of(s.traffic)):
        each = dataclasses.replace(each, cause=f"{each.cause}, {place}")
    return Warned(
        name=each.name,
        cause=each.cause,
        doing=each.doing,
        next=each.next_action.name if each.next_in_s is not None else "",
        next_in_s=_round(each.next_in_s, 3),
        runs=each.runs,
        until=each.until,
        sentence=each.sentence(),
    )


def _named(name: str) -> Warned:
    """Of a picture that came over the radio, which carries names only."""
    return Warned(name, words.cause(name), "", sentence=words.cause(name))


def _link(link: LinkHealth) -> LinkSeen:
    return LinkSeen(
        name=link.name,
        kind=link.kind,
        is_open=link.is_open,
        age_s=_round(link.last_rx_age_s, 1),
        text=link.text,
        bytes_in=link.bytes_in,
        bytes_out=link.bytes_out,
        is_listening=link.is_listening,
    )


def _receiver(s: Snapshot) -> str:
    """What the receiver says, and where that is no position, why."""
    if s.fix is None:
        return "no receiver heard"
    if s.fix.fix_type is FixType.NONE:
        return "receiver has no fix"
    kind = s.fix.fix_type.name.replace("_", " ")
    return kind if s.state.position_valid else f"receiver says {kind}, not believed"


def _round(number: float | None, digits: int) -> float | None:
    return None if number is None else round(number, digits)


def _deg(value_rad: float | None, digits: int) -> float | None:
    return None if value_rad is None else round(math.degrees(value_rad), digits)


def _compass(value_rad: float | None) -> float | None:
    return None if value_rad is None else round(math.degrees(value_rad) % 360.0, 1) % 360.0


def _place(lat_rad: float | None, lon_rad: float | None) -> tuple[float, float] | None:
    if lat_rad is None or lon_rad is None:
        return None
    return round(math.degrees(lat_rad), _PLACES_DEG), round(math.degrees(lon_rad), _PLACES_DEG)
