"""The shore's end of the compact link: a twin that ground stations see as the vessel.

It answers reads from what it keeps and sends only changes over the air. What the vessel has not confirmed is never
called done: a request ends with the vessel's own answer or, when none comes in time, as failed. While the last
authentic state is too old there is no snapshot, and so no heartbeat for the stations.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Hashable
from typing import Final

from ...language.deeds import Deeds
from ...language.messages import ActuatorOutput, Severity
from ...language.requests import (
    Arm,
    LoadPlan,
    Origin,
    PlanItem,
    PlanKind,
    Reply,
    RequestBody,
    Result,
    SetHomePosition,
    SetParameter,
)
from ...language.snapshot import Snapshot
from ...language.units import rad_to_e7
from ...mavlink.missions.plan_rules import plan_id
from ...mavlink.persona import Identity, ParamTable
from ..air import RadioProfile
from ..codec.batch import decode_batch
from ..codec.bits import BitsError
from ..codec.brief import STANDING_BYTES, decode_position, with_brief, with_standing
from ..codec.frames import RadioFrame
from ..codec.info import WANTED_PLAN, HomePlace, Kept, Wanted, decode, params_check
from ..codec.old_format import GAP_US, HEARD, OldEar
from ..codec.plan import PlanCodecError, decode_plan
from ..codec.request import OVERRULED
from ..codec.state import delta_parts, reached_in
from ..codec.state_fields import RadioState, plan_hash
from ..codec.wire import SEVERITY, VERSION, Kind
from ..link import CompactLink
from ..session import Pairing, RadioDirection
from ..transfer import TransferOutcome, WholeMessage
from ..vessel_clock import VesselClock
from .beacon import Beacons
from .edits import ANOTHER, Edit, Edits
from .grid import StateGrid
from .memory import ShorePicture, heard_us
from .orders import OVERTAKEN, PendingOrder, PendingOrders, message_of, stops_word, submit, words_at_a_stop
from .sayings import SAID_GAP_US, Sayings
from .sync import Sync
from .view import CachedParams, CachedPlans, snapshot_of, with_health

_NO_BEACON: Final = "Armed. This radio profile has no beacon: the vessel will not notice the loss of its ground station"
_FOREIGN: Final = (
    "Radio: the vessel speaks format {}, this gateway {}: only Hold and Disarm cross; update the older one"
)
_SHOWN_US: Final = 500_000
"""What an answer tells is shown so long, which is once, however old the place is."""


class ShoreTwin:
    """The vessel as the shore knows it; a ``VehiclePort`` for endpoints.

    ``params``: the parameter table of the vessel's software at its defaults; ``neutral``: what stands for the actuators in a snapshot.
    """

    def __init__(
        self,
        profile: RadioProfile,
        key: bytes,
        params: ParamTable,
        identity: Identity,
        neutral: ActuatorOutput,
        rng: random.Random,
        *,
        nonce: bytes,
        memory: str = "",
        save: Callable[[str], None] | None = None,
        now_us: int = 0,
        system_id: int = 1,
    ) -> None:
        """``nonce``: six bytes that no earlier start had."""
        self.profile = profile
        self._address = (system_id, 1)
        pairing = Pairing(key, system_id, RadioDirection.TO_VESSEL, nonce, profile)
        self.link = CompactLink(profile, pairing, rng, memory=memory, save=save, now_us=now_us)
        self._ear = OldEar(key, RadioDirection.TO_SHORE)
        self.params, self.plans = CachedParams(params), CachedPlans()
        self.identity = identity
        self.deeds = Deeds()
        self.logs: None = None  # the vessel's never cross the radio
        self.state: RadioState | None = None
        self.state_us: int | None = None
        """When the newest state was true."""
        self._recalled: RadioState | None = None  # of before the start, disarmed: not shown
        self.stood_us: int | None = None  # when an answer last told mode and armed bit
        self.changed_params: list[str] = []
        """Names of parameters that changed otherwise than by a request from here; the gateway empties it."""
        self._neutral = neutral
        self._beacons = Beacons(self.link)
        self._grid = StateGrid(self.link, self._beacons.keys)
        self._clock = VesselClock(profile.link)
        self._pending = PendingOrders()
        self._replies: list[tuple[Hashable, Reply]] = []
        self._sayings = Sayings()
        self._reached: list[int] = []
        self._sync = Sync(profile, self.link)
        self._edits = Edits(self.link, self._pending, self._send_edit)
        self._unsure: dict[PlanKind, tuple[PlanItem, ...]] = {}
        """Plans whose upload was given up without the vessel's word."""
        self._verified = False
        """Whether the vessel has said since the start what it has."""

    def picture(self, utc_us: int, now_us: int) -> ShorePicture:
        """What is known, for the next start. ``utc_us``: the calendar now, 0 = unknown."""
        age_us = 0 if self.state_us is None else now_us - self.state_us
        plans = {kind: self.plans.items(kind) for kind in PlanKind}
        home_e7, state_utc_us = self.plans.home_e7, utc_us - age_us if utc_us else 0
        return ShorePicture(
            plans=plans,
            unsure=dict(self._unsure),
            params=self.params.known,
            home_e7=home_e7,
            state=self.state,
            state_utc_us=state_utc_us,
        )

    def restore(self, picture: ShorePicture, utc_us: int, now_us: int) -> None:
        """Take over an earlier run's picture. The vessel is asked at its first word whether it still holds."""
        for kind, items in picture.plans.items():
            self.plans.put(kind, items)
        self.plans.home_e7 = picture.home_e7
        self._unsure = dict(picture.unsure)
        self.params.restore(picture.params)
        if picture.state is not None:
            self.state, self.state_us = picture.state, heard_us(picture, utc_us, now_us)
            self._recalled = None if picture.state.armed else picture.state

    # ---- radio side ---------------------------------------------------------------------------------------------

    def receive(self, data: bytes, now_us: int) -> None:
        """Take bytes from the modem as read. Never raises on input."""
        items = self.link.receive(data, now_us)
        if self.link.pairing.is_foreign:
            self.say(Severity.WARNING, _FOREIGN.format(self.link.pairing.version, VERSION), now_us, gap_us=GAP_US)
        before = self._ear.hellos
        self._ear.receive(data)
        if self._ear.hellos > before:
            self.say(Severity.WARNING, HEARD, now_us, gap_us=GAP_US)
        self._beacons.keys.of_session(self.link.pairing.other)
        if self._clock.of_session(self.link.pairing.other):
            self.say(Severity.NOTICE, "Radio: the vessel has started anew", now_us)
        for item in items:
            if isinstance(item, WholeMessage):
                self._on_message(item, now_us)
            else:
                self._on_frame(item, now_us)
        self._collect(now_us)

    def take(self, now_us: int) -> bytes:
        """The next frame for the modem when the air is free."""
        before = self.link.last_posted
        frame = self.link.take(now_us)
        if self.link.last_posted is not None and self.link.last_posted is not before:
            self._grid.said(self.link.last_posted[1], now_us)
        self._collect(now_us)
        return frame

    def tick(self, now_us: int, *, station_present: bool) -> None:
        """Serve beacon and synchronisation; call a few times a second."""
        self._collect(now_us)
        self._edits.tick(now_us)
        self._beacons.tick(now_us, station_present=station_present)

    def age_s(self, now_us: int) -> float | None:
        """Age of the newest authentic state."""
        return None if self.state_us is None else (now_us - self.state_us) * 1e-6

    def is_fresh(self, now_us: int) -> bool:
        """Whether heartbeats may be sent for the vessel."""
        if self.state_us is None or self.state is self._recalled:
            return False
        # an answer tells mode and armed bit, and not where the boat is: it keeps nobody's picture alive
        return (now_us - self.state_us) * 1e-6 <= self.profile.link.stale_after_s

    # ---- stations' side -----------------------------------------------------------------------------------------

    def submit(
        self, owner: Hashable, body: RequestBody, now_us: int, origin: Origin | None = None, *, station: Hashable = None
    ) -> None:
        """Take a request; its answer comes by ``replies`` under ``owner``. An equal one that is on its way already is joined.

        ``origin``: the command that it came in, which then crosses the air itself. ``station``: who asks, else the command's.
        """
        station = origin.source if station is None and origin is not None else station
        if body.nature.stops:
            self._overrule(self._pending.yielding, OVERRULED, now_us)
        self._overrule(self._pending.unwanted(body, station), OVERTAKEN, now_us)
        if (joined := self._pending.join(owner, body, station)) is not None:
            return self.link.press(joined, now_us)
        try:
            if not self._edits.take(owner, body, station, now_us):
                self._send(owner, body, now_us, origin, station)
        except ValueError as error:
            self._replies.append((owner, Reply(Result.DENIED, str(error))))

    def _send(self, owner: Hashable, body: RequestBody, now_us: int, origin: Origin | None, station: Hashable) -> None:
        """Give it to the air. Raises ValueError for what does not cross."""
        message = message_of(body, origin, self._address, self._near_e7())
        number = submit(self.link, message, now_us, is_stop=body.nature.stops)
        self.link.withdraw(replaced := self._pending.put(number, body, owner, station), OVERTAKEN)
        if replaced and isinstance(body, LoadPlan):
            self._sync.lacks(Wanted.INFO)  # what was withdrawn may have been carried out
        if body.nature.stops:
            for word in words_at_a_stop(self.link, now_us):
                self._tell(word, now_us)

    def _send_edit(self, edit: Edit, now_us: int) -> None:
        self._send(edit.owner, edit.body, now_us, None, edit.station)

    def _overrule(self, numbers: set[int], reply: Reply, now_us: int) -> None:
        """What was given before and is still under way must not be carried out after what is given now."""
        self.link.withdraw(numbers, reply)
        self._collect(now_us)

    def ignore(self, body: RequestBody, now_us: int) -> None:
        """Say, now and then, that a stream of set-points does not cross the air."""
        self.say(Severity.WARNING, f"{type(body).__name__} does not cross the radio link", now_us)

    def replies(self) -> list[tuple[Hashable, Reply]]:
        """Answers since the last call, with the owners given to ``submit``."""
        found, self._replies = self._replies + self._edits.replies(), []
        return found

    def snapshot(self, now_us: int, tick: int) -> Snapshot | None:
        """The vessel as last heard; None while that is too old to show. Reached items and texts are handed out once."""
        is_told = self.stood_us is not None and now_us - self.stood_us < _SHOWN_US
        if self.state is None or self.state_us is None or not (is_told or self.is_fresh(now_us)):
            return None
        texts = self._sayings.logged(now_us)
        reached, self._reached = tuple(self._reached), []
        # a state of before the start is shown with the time of the start; its age is told apart
        heard = max(self.state_us, 0)
        return snapshot_of(self.state, heard, tick, self._neutral, self.plans, reached=reached, texts=texts)

    def say(self, severity: Severity, text: str, now_us: int, *, gap_us: int = SAID_GAP_US) -> None:
        """Queue a text of the gateway's own; the same one at most every ``gap_us``."""
        self._sayings.say(severity, text, now_us, gap_us=gap_us)

    def drain_texts(self) -> list[tuple[Severity, str]]:
        """Texts since the last call or snapshot, for when there is no snapshot to carry them."""
        return self._sayings.drain_texts()

    def _near_e7(self) -> tuple[int, int] | None:
        state = self.state
        if state is None or state.lat_rad is None or state.lon_rad is None:
            return None
        return rad_to_e7(state.lat_rad), rad_to_e7(state.lon_rad)

    # ---- what comes ---------------------------------------------------------------------------------------------

    def _on_frame(self, frame: RadioFrame, now_us: int) -> None:
        self._grid.heard(frame, now_us)
        try:
            if frame.kind is Kind.KEY:
                self._on_key(frame, now_us)
            elif frame.kind is Kind.DELTA:
                self._on_delta(frame, now_us)
            elif frame.kind is Kind.BATCH:
                samples, _ = decode_batch(frame.body)
                self._take_state(samples[-1], self._clock.made_us(samples[-1].t_s, now_us), now_us)
            elif frame.kind is Kind.POSITION:
                self.state, self.state_us = decode_position(frame.body), now_us
            elif frame.kind is Kind.REPLY:
                self._on_standing(frame, now_us)
        except BitsError:
            return
        if frame.kind is Kind.EVENT and frame.body:
            self._reached.extend(frame.body)
        elif frame.kind is Kind.TEXT and len(frame.body) > 1:
            self.say(SEVERITY.member(frame.body[0] & 7), frame.body[1:].decode("utf-8", "replace"), now_us)

    def _on_standing(self, frame: RadioFrame, now_us: int) -> None:
        """What an answer tells of the vessel is shown at once; where it is comes with the next state, and keeps its age."""
        before, body = self.state, frame.body
        if before is None or self.link.pairing.is_foreign or len(body) <= STANDING_BYTES:
            return
        tells_all = not frame.is_brief
        self.state = with_standing(before, body[1:]) if tells_all else with_brief(before, body[2:], body[1])
        self.stood_us = None if before is self._recalled else now_us
        self._grid.stands(before, self.state, now_us)

    def _on_key(self, frame: RadioFrame, now_us: int) -> None:
        state = self._beacons.key(frame, now_us)
        self._take_state(state, self._clock.made_us(state.t_s, now_us), now_us)

    def _on_delta(self, frame: RadioFrame, now_us: int) -> None:
        self._reached.extend(reached_in(frame.body))
        state = self._beacons.keys.apply(frame, now_us)
        if state is None:
            return
        if (newest := self.state) is not None:
            # a difference is sent only while the status is its key's, or brings its own; of the rest a later key may have told
            state = with_health(state, newest, flags=not delta_parts(frame.body).changes)
        self._take_state(state, now_us, now_us)

    def _take_state(self, state: RadioState, made_us: int | None, now_us: int) -> None:
        if made_us is not None:
            self.state, self.state_us = state, made_us
        self._overrule(self._pending.changes_of_another(state.plan_hash), ANOTHER, now_us)
        differs = state.plan_hash != plan_hash(self.plans.plan_id(PlanKind.MISSION))
        if not self._verified or (differs and not self._pending.is_on_its_way(PlanKind.MISSION)):
            self._sync.lacks(Wanted.INFO)
        self._sync.step(now_us)

    def _on_message(self, message: WholeMessage, now_us: int) -> None:
        reply = Reply(Result.ACCEPTED)
        if message.kind is Kind.INFO:
            found = decode(message.payload)
            if isinstance(found, Kept):
                self._on_kept(found, now_us)
            elif isinstance(found, HomePlace):
                self.plans.home_e7 = found.home_e7
            elif found is not None:
                self._sync.has(Wanted.PARAMS)
                self.changed_params += self.params.put_changed(found)
        elif message.kind is Kind.PLAN:
            try:
                kind, items = decode_plan(message.payload, self._near_e7())
                self._keep_plan(kind, items, now_us)
            except PlanCodecError as error:
                reply = Reply(Result.FAILED, str(error))
        else:
            reply = Reply(Result.UNSUPPORTED)
        self.link.answer(message.id, reply, now_us)

    def _on_kept(self, kept: Kept, now_us: int) -> None:
        """Compare what the vessel has with what is kept here, and ask for what differs."""
        self._verified = True
        self._sync.has(Wanted.INFO)
        for kind, flag in WANTED_PLAN.items():
            number = kept.plan_id(kind)
            if number == self.plans.plan_id(kind):
                self._sync.has(flag)
                continue
            unsure = self._unsure.pop(kind, None)
            if number == 0:
                self._keep_plan(kind, (), now_us)
            elif unsure is not None and plan_id(unsure) == number:
                self._keep_plan(kind, unsure, now_us)
                self.say(Severity.INFO, "the vessel has stored the plan that was not confirmed before", now_us)
            else:
                self._sync.lacks(flag)
        if kept.params != params_check(self.params.changed):
            self._sync.lacks(Wanted.PARAMS)
        self._sync.step(now_us)
        self._edits.told(kept, now_us)

    def _keep_plan(self, kind: PlanKind, items: tuple[PlanItem, ...], now_us: int) -> None:
        self.plans.put(kind, items)
        self._unsure.pop(kind, None)
        self._sync.has(WANTED_PLAN[kind])

    # ---- how requests end ---------------------------------------------------------------------------------------

    def _collect(self, now_us: int) -> None:
        for outcome in self.link.outcomes():
            if self._sync.ended(outcome.id) or self._edits.ended(outcome):
                continue
            if (pending := self._pending.pop(outcome.id)) is not None:
                self._settle(pending, outcome, now_us)

    def _settle(self, pending: PendingOrder, outcome: TransferOutcome, now_us: int) -> None:
        body, reply = pending.body, outcome.reply
        if reply.result is Result.ACCEPTED:
            self._accepted(body, now_us)
        elif isinstance(body, LoadPlan) and reply.result is Result.FAILED:
            self._unsure[body.kind] = body.items
        self._replies += [(owner, reply) for owner in pending.owners]

    def _accepted(self, body: RequestBody, now_us: int) -> None:
        self._grid.ordered(now_us)
        self._beacons.obeyed(now_us)
        if isinstance(body, LoadPlan):
            self._keep_plan(body.kind, body.items, now_us)
        elif isinstance(body, SetParameter):
            self.params.put(body.name, body.value)
        elif isinstance(body, SetHomePosition) and body.lat_rad is not None and body.lon_rad is not None:
            self.plans.home_e7 = rad_to_e7(body.lat_rad), rad_to_e7(body.lon_rad)
        elif isinstance(body, Arm) and body.arm:
            self._tell(stops_word(self.link.ledger, now_us, at_most=20), now_us)
            self._tell("" if self.profile.link.beacon_s else _NO_BEACON, now_us)

    def _tell(self, warning: str, now_us: int) -> None:
        if warning:
            self.say(Severity.WARNING, warning, now_us)
