"""The traffic watch: reports in, one picture a tick out, texts on change.

Every vessel is looked at once a second and when she is heard, at most 24 in one tick, so that a harbour costs no deadline.
The picture is the same object until something in it changes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import itemgetter
from typing import Final

from mavlink_bridge.language.messages import EstimatedState, Severity
from mavlink_bridge.language.traffic import NO_TRAFFIC, Danger, OtherVessel, TrafficPicture, VesselKind
from mavlink_bridge.language.units import wrap_pi

from ..ais.identity import MmsiKind, station_of
from ..ais.receiver import AisWord, ReceivedReport
from ..ais.reports import AidToNavigation, PositionReport, SafetyText, StaticReport, StationClass
from . import words
from .aids import Aids
from .beacons import DistressBeacons
from .config import TrafficConfig
from .flags import TrafficFlags, flags_of
from .health import ReceiverHealth
from .judge import NO_DEALING, Dealing, Own, TrafficLook, look, own_of
from .own import OwnNumbers
from .table import JudgedTrack, Table, fix_age_s, is_beacon
from .throttle import Throttle
from .track import Track
from .words import Text

LOOK_US: Final = 1_000_000
"""A vessel is judged again after this: AIS of the fastest comes every two."""
LOOKS_A_TICK: Final = 24
"""Some 25 us each: a tick's share stays far below 5 ms."""
_CLOSE_AGAIN_US: Final = 60_000_000
"""One danger is told once: who sways about the limit of close is not called close again before, unless she was past and clear."""
_RANK: Final = {Danger.CLOSE: 0, Danger.RISK: 1, Danger.NONE: 2}


_Key = tuple[int, float, int]
"""Danger, range and number: the picture's order."""
_PERSON: Final = -1
"""Before every danger: what is told of ships may wait, and what is cut off at the end must not be a life."""


def _key(vessel: OtherVessel) -> _Key:
    rank = _PERSON if vessel.kind is VesselKind.PERSON else _RANK[vessel.danger]
    return rank, math.inf if vessel.range_m is None else vessel.range_m, vessel.mmsi


class Traffic:
    """All other vessels. Never raises, whatever is received; memory is bounded."""

    def __init__(self, config: TrafficConfig) -> None:
        self.config = config
        self.health = ReceiverHealth()
        self.table = Table(config.track_life_s)
        self.own_numbers = OwnNumbers(config.own_mmsi)
        self.aids = Aids()
        self.picture: TrafficPicture = NO_TRAFFIC
        self.flags = TrafficFlags()
        """What the failsafe warns of."""
        self._seen: dict[JudgedTrack, tuple[Dealing, OtherVessel, _Key]] = {}
        """What the last look at each gave, with her place in the picture's order."""
        self.beacons = DistressBeacons()
        self._texts: list[Text] = []
        self._throttle = Throttle()
        self._changed = False
        self._own: Own | None = None

    def configure(self, config: TrafficConfig) -> None:
        """Take new settings."""
        self.config = config
        if not config.enabled:
            self.flags = TrafficFlags()
        self.table.life_s = config.track_life_s
        self.own_numbers.configured = config.own_mmsi
        self._changed = True

    def drain_texts(self) -> list[Text]:
        """Operator texts since the last call."""
        texts, self._texts = self._texts, []
        return texts

    # ---- in

    def _receive(self, received: Sequence[ReceivedReport | AisWord], own: Own | None, utc_us: int | None) -> None:
        """Take reports as they came, with our own state and UTC."""
        for item in received:
            if isinstance(item, AisWord):
                self.health.receiver_text(item.fields, item.t_us)
                continue
            self.health.sentence(item.t_us)
            if item.own:
                self.own_numbers.said(item.report.mmsi)
                self.table.forget_number(item.report.mmsi)
            elif item.report.mmsi not in self.own_numbers or self._is_apart(item.report, own, item.t_us):
                self._take(item, own, utc_us)

    def _is_apart(self, report: object, own: Own | None, now_us: int) -> bool:
        """Whether a number that was found to move with us does so no more."""
        if isinstance(report, PositionReport) and own is not None:
            self._compare(report, own, now_us)
            return report.mmsi not in self.own_numbers
        return False

    def _take(self, item: ReceivedReport, own: Own | None, utc_us: int | None) -> None:
        match item.report:
            case PositionReport() as report:
                self._take_position(report, item.t_us, own, utc_us)
            case StaticReport() as report:
                self.table.take_static(report)
                for entry in self.table.of(report.mmsi):
                    entry.due_us = 0
            case AidToNavigation() as report:
                self._texts += self.aids.take(report, item.t_us)
                self._changed = True
            case SafetyText() as report if is_beacon(report.mmsi):
                self.beacons.take_text(report)
            case _:
                pass  # a base station is no vessel and no mark

    def _take_position(self, report: PositionReport, now_us: int, own: Own | None, utc_us: int | None) -> None:
        if not report.has_position and is_beacon(report.mmsi):
            self._take_unplaced(report, now_us)
        if not report.has_position or station_of(report.mmsi) in (MmsiKind.COAST, MmsiKind.GROUP, MmsiKind.AID):
            return
        if own is not None and not is_beacon(report.mmsi) and self._compare(report, own, now_us):
            self.table.forget_number(report.mmsi)
            text = f"AIS: MMSI {report.mmsi} moves with us, taken for our own transponder: set traffic.own_mmsi"
            self._texts.append((Severity.NOTICE, text))
            return
        age_s = fix_age_s(report, utc_us)
        if age_s is not None:
            self.health.fix_age(age_s)
        place = None if own is None else (own.lat_rad, own.lon_rad)
        self.table.take_position(report, now_us, utc_us, place)

    def _take_unplaced(self, report: PositionReport, now_us: int) -> None:
        """Take a beacon's report without a position; where it was tested says nothing of where it is in earnest."""
        known = [self.beacons.kind_of(entry.track.report) for entry in self.table.of(report.mmsi)]
        if VesselKind.PERSON in known:
            return
        if self.beacons.kind_of(report) is VesselKind.PERSON:
            self.table.forget_number(report.mmsi)
        self._texts += self.beacons.take_unplaced(report, now_us)
        self._changed = True

    def _compare(self, report: PositionReport, own: Own, now_us: int) -> bool:
        assert report.lat_rad is not None
        assert report.lon_rad is not None
        north = (report.lat_rad - own.lat_rad) * own.metres[0]
        east = wrap_pi(report.lon_rad - own.lon_rad) * own.metres[1]
        speed, course = report.sog_mps or 0.0, report.cog_rad
        off = math.pi if course is None else wrap_pi(course - math.atan2(own.ve_mps, own.vn_mps))
        # her report is a second or two old
        apart = max(0.0, math.hypot(north, east) - 2.0 * own.sog_mps), speed - own.sog_mps, off
        return self.own_numbers.compare(report.mmsi, apart, own.sog_mps, now_us)

    # ---- one tick

    def step(
        self,
        now_us: int,
        state: EstimatedState,
        utc_us: int | None = None,
        received: Sequence[ReceivedReport | AisWord] = (),
        *,
        line_alive: bool = False,
    ) -> TrafficPicture:
        """Take what was received in this tick, look at those whose turn it is; return what is known.

        ``line_alive``: a line that carries AIS has brought something, if only other sentences.
        """
        if not self.config.enabled:
            return NO_TRAFFIC
        if line_alive:
            self.health.line_alive(now_us)
        if received:
            self._receive(received, own_of(state), utc_us)
        self.health.step(now_us, required=self.config.required, every_s=self.table.every_s)
        if self.health.texts:
            self._texts += self.health.texts
            self.health.texts = []
            self._changed = True
        if self.table.count:
            self._look_around(now_us, own_of(state))
        if len(self._seen) > self.table.count:
            # pushed out by a flood, told apart from a double, or found to be us
            present = set(map(id, self.table))
            self._seen = {entry: seen for entry, seen in self._seen.items() if id(entry) in present}
            self._changed = True
        if self.aids.expire(now_us) or self.beacons.expire(now_us):
            self._changed = True
        if self._changed:
            self._changed = False
            self.picture = self._compose()
            self.flags = flags_of(self.picture)
        return self.picture

    def _look_around(self, now_us: int, own: Own | None) -> None:
        due = [entry for entry in self.table if entry.due_us <= now_us]
        if len(due) > LOOKS_A_TICK:
            due = sorted(due, key=lambda entry: entry.due_us)[:LOOKS_A_TICK]
        for entry in due:
            entry.due_us = now_us + LOOK_US
            self._changed = True
            if self.table.is_over(entry, now_us):
                self._forget(entry)
            else:
                self._look_at(entry, own, now_us)

    def _forget(self, entry: JudgedTrack) -> None:
        self.table.drop(entry)
        seen = self._seen.pop(entry, None)
        if seen is not None and seen[1].danger is not Danger.NONE:
            self._speak(words.gone(seen[1]), seen[1].t_us)

    def _look_at(self, entry: JudgedTrack, own: Own | None, now_us: int) -> None:
        track = entry.track
        before = self._seen[entry][0] if entry in self._seen else NO_DEALING
        kind = self._kind(track)
        if own is None:
            vessel = self._vessel(entry, kind, None, now_us)
            self._seen[entry] = before, vessel, _key(vessel)
            if is_beacon(track.mmsi):
                self._texts += self.beacons.tell(vessel)
            return
        static = self.table.static_of(track.mmsi)
        seen = look(before, track, static, own=own, now_us=now_us, config=self.config)
        if kind not in (VesselKind.CLASS_A, VesselKind.CLASS_B):
            seen = TrafficLook(NO_DEALING, seen.range_m, seen.bearing_rad, seen.opening, None)
        entry.range_m, entry.opening = seen.range_m, seen.opening
        entry.in_danger = seen.dealing.danger is not Danger.NONE
        vessel = self._vessel(entry, kind, seen, now_us)
        self._seen[entry] = seen.dealing, vessel, _key(vessel)
        self._tell(entry, before, vessel, now_us)
        if seen.dealing.lost and not before.lost:
            self._speak(words.lost(vessel, now_us), now_us)

    def _tell(self, entry: JudgedTrack, before: Dealing, vessel: OtherVessel, now_us: int) -> None:
        if is_beacon(vessel.mmsi):
            self._texts += self.beacons.tell(vessel)
            return
        text = words.change(before.danger, vessel)
        if text is None or (vessel.danger is Danger.CLOSE and now_us < entry.close_again_us):
            return
        entry.close_again_us = now_us + _CLOSE_AGAIN_US if vessel.danger is Danger.CLOSE else 0
        self._speak(text, now_us)

    def _speak(self, text: Text, now_us: int) -> None:
        if self._throttle.has_room(now_us) or text[0] <= Severity.CRITICAL:  # danger at hand is told in any crowd
            self._throttle.spend(now_us)
            self._texts.append(text)

    # ---- out

    def _kind(self, track: Track) -> VesselKind:
        report = track.report
        if is_beacon(track.mmsi):
            return self.beacons.kind_of(report)
        match report.sent:
            case StationClass.CLASS_A:
                return VesselKind.CLASS_A
            case StationClass.CLASS_B:
                return VesselKind.CLASS_B
            case StationClass.SAR_AIRCRAFT:
                return VesselKind.SAR_AIRCRAFT
            case StationClass.LONG_RANGE:
                return VesselKind.LONG_RANGE

    def _vessel(self, entry: JudgedTrack, kind: VesselKind, seen: TrafficLook | None, now_us: int) -> OtherVessel:
        track, report = entry.track, entry.track.report
        static = self.table.static_of(track.mmsi)
        lat_rad, lon_rad = track.place(now_us)
        assert report.lat_rad is not None
        assert report.lon_rad is not None
        closest = None if seen is None else seen.closest
        dealing = NO_DEALING if seen is None else seen.dealing
        return OtherVessel(
            mmsi=track.mmsi,
            kind=kind,
            t_us=now_us,
            lat_rad=lat_rad,
            lon_rad=lon_rad,
            reported_lat_rad=report.lat_rad,
            reported_lon_rad=report.lon_rad,
            reported_us=track.t_us,
            sigma_m=track.sigma_m(track.age_s(now_us)),
            sog_mps=track.sog_mps,
            cog_rad=track.cog_rad,
            heading_rad=track.heading_rad,
            at_rest=track.at_rest,
            turn_radps=report.turn_radps,
            turn_sign=report.turn_sign,
            accurate=report.accurate,
            sog_is_least=report.sog_is_least,
            status=report.status,
            ship_type=static.ship_type,
            sides=static.sides,
            name=static.name,
            callsign=static.callsign,
            range_m=None if seen is None else seen.range_m,
            bearing_rad=None if seen is None else seen.bearing_rad,
            hull_m=None if closest is None else closest.now_m,
            cpa_m=None if closest is None else closest.distance_m,
            tcpa_s=None if closest is None else closest.time_s,
            going_away=dealing.going_away,
            role=dealing.role,
            danger=dealing.danger,
        )

    def _compose(self) -> TrafficPicture:
        nearest: dict[int, tuple[_Key, OtherVessel]] = {}
        lost = False
        for entry in self.table:
            seen = self._seen.get(entry)
            if seen is None:
                continue
            dealing, vessel, key = seen
            lost = lost or dealing.lost
            best = nearest.get(vessel.mmsi)
            if best is None or key < best[0]:
                nearest[vessel.mmsi] = key, vessel
        ordered = [*nearest.values(), *((_key(mark), mark) for mark in self.aids.vessels())]
        ordered.sort(key=itemgetter(0))
        vessels = [vessel for _, vessel in ordered]
        return TrafficPicture(
            vessels=tuple(vessels),
            heard=self.health.heard,
            silent=self.health.silent,
            close=any(vessel.danger is Danger.CLOSE for vessel in vessels),
            lost=lost,
            person=any(vessel.kind is VesselKind.PERSON for vessel in vessels) or self.beacons.are_unplaced,
            range_m=self.config.shown_range_m,
            as_adsb=self.config.show_as_adsb,
        )
