"""What the vessel keeps, plans, parameters and home: told to a shore that asks, and by itself when others have changed it.

What is told by itself comes at no moment that the shore knows, so an order may meet it: it is short, and seldom.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

from ..language.requests import LoadPlan, PlanKind, Reply, RequestBody, Result, SetHomePosition, SetParameter
from ..mavlink.missions.plan_rules import plan_id
from ..mavlink.persona import VehiclePort
from .air import Priority
from .codec.info import WANTED_PLAN, HomePlace, Kept, Wanted, encode, encode_params, kept_by
from .codec.plan import PlanCodecError, encode_plan
from .codec.wire import Kind
from .link import CompactLink
from .transfer import TransferOutcome

_PUSH_LIMIT_US: Final = 20_000_000
_PUSH_GAP_US: Final = 60_000_000
_PLAN_GAP_US: Final = 10_000_000
"""No state tells of fence and rally points: until this is told a shore relies on a fence that is gone. Nobody changes them as often as
a parameter, and 23 bytes in so long are a twentieth of the hour at worst."""
_HOME_GAP_US: Final = 4_000_000
"""A boat that has just found out where it is tells its home soon: stations draw it elsewhere until then."""
_CHECK_GAP_US: Final = 1_000_000
_PRESENT_US: Final = 600_000_000


class Telling:
    """Compares what the vessel keeps with what the shore is known to know. ``home_e7``: where the vessel's home is."""

    def __init__(self, link: CompactLink, vehicle: VehiclePort, home_e7: Callable[[], tuple[int, int] | None]) -> None:
        self._link = link
        self._vehicle = vehicle
        self._home_e7 = home_e7
        self._kept: Kept | None = None
        """What the shore is known to know."""
        self._place: HomePlace | None = None
        self._pushing: dict[int, Kept | HomePlace] = {}
        self._push_us: dict[type[Kept | HomePlace], int] = {}
        self._checked_us: int | None = None

    def forget(self) -> None:
        """Another gateway, or another start of it: it is told without being asked."""
        self._kept = self._place = None
        self._push_us.clear()

    def look_again(self) -> None:
        """Something has changed: compare at once."""
        self._checked_us = None

    # ---- by itself ----------------------------------------------------------------------------------------------

    def step(self, now_us: int, quiet_us: int) -> bool:
        """Tell what others have changed, not before ``quiet_us``; never on a starved channel, never to nobody. Returns whether it did."""
        heard_us = self._link.heard_us
        if self._link.profile.link.batch > 1 or heard_us is None or now_us - heard_us > _PRESENT_US or self._pushing:
            return False
        if now_us < quiet_us or (self._checked_us is not None and now_us - self._checked_us < _CHECK_GAP_US):
            return False
        self._checked_us = now_us
        news = self._news()
        if news is None:
            return False
        last_us = self._push_us.get(type(news))
        if last_us is not None and now_us - last_us < self._gap_us(news):
            return False
        self._push_us[type(news)] = now_us
        try:
            self._submit(news, now_us)
        except ValueError:
            return False
        return True

    def _news(self) -> Kept | HomePlace | None:
        kept, place = kept_by(self._vehicle), self._place_now()
        told = self._place
        news: list[Kept | HomePlace] = [place] * (told is None or not place.is_like(told)) + [kept] * (
            kept != self._kept
        )
        # the one that was tried longer ago: a part that finds no answer must not keep the other back
        return min(news, key=lambda part: self._push_us.get(type(part), -1), default=None)

    def _gap_us(self, news: Kept | HomePlace) -> int:
        if isinstance(news, Kept):
            return _PLAN_GAP_US if self._kept is not None and not news.has_plans_of(self._kept) else _PUSH_GAP_US
        is_found = self._place is None or self._place.home_e7 is None
        return _HOME_GAP_US if is_found else _PUSH_GAP_US

    def _place_now(self) -> HomePlace:
        return HomePlace(self._home_e7(), self._vehicle.identity.version)

    def _answer(self, told: Kept | HomePlace, now_us: int) -> None:
        """Who asks waits for it: it goes right behind the answer, and if it is on its way already, that goes now. What is not so any more
        is called back.
        """
        same = {number: waiting for number, waiting in self._pushing.items() if type(waiting) is type(told)}
        for number, waiting in same.items():
            if waiting == told:
                self._link.hasten(number)
                return
        for number in same:
            del self._pushing[number]
        self._link.withdraw(same, Reply(Result.FAILED, "something else is so now"))
        self._submit(told, now_us)
        self._link.hasten(next(reversed(self._pushing)))

    def _submit(self, told: Kept | HomePlace, now_us: int) -> None:
        number = self._link.submit(Kind.INFO, encode(told), Priority.EVENT, now_us, _PUSH_LIMIT_US)
        self._pushing[number] = told

    def ended(self, outcome: TransferOutcome) -> None:
        """Note how a message of the link ended."""
        told = self._pushing.pop(outcome.id, None)
        if outcome.reply.result is not Result.ACCEPTED:
            return
        if isinstance(told, Kept):
            self._kept = told
        elif told is not None:
            self._place = told

    def shore_knows(self, body: RequestBody) -> None:
        """What came from the shore need not be told to it."""
        if self._kept is not None and isinstance(body, LoadPlan):
            number = plan_id(body.items) if body.items else 0
            self._kept = self._kept.with_plan(body.kind, number)
        elif self._kept is not None and isinstance(body, SetParameter):
            self._kept = replace(self._kept, params=kept_by(self._vehicle).params)
        elif self._place is not None and isinstance(body, SetHomePosition) and body.lat_rad is not None:
            self._place = self._place_now()

    # ---- when asked ---------------------------------------------------------------------------------------------

    def wanted(self, payload: bytes, now_us: int) -> Reply:
        """Answer a question for what the vessel keeps; the things themselves follow as messages."""
        wanted = Wanted(payload[0] & 31) if payload else Wanted(0)
        try:
            if wanted & Wanted.INFO:
                # what differs in the second makes the shore ask again, and it should not meet the other one
                for told in (self._place_now(), kept_by(self._vehicle)):
                    self._answer(told, now_us)
            if wanted & Wanted.PARAMS:
                self._submit_bulk(Kind.INFO, encode_params(self._vehicle.params), now_us)
            for kind, flag in WANTED_PLAN.items():
                if wanted & flag:
                    self._submit_bulk(Kind.PLAN, self._plan(kind), now_us)
        except (ValueError, PlanCodecError) as error:
            return Reply(Result.REJECTED_NOW, str(error))
        return Reply(Result.ACCEPTED)

    def _plan(self, kind: PlanKind) -> bytes:
        return encode_plan(kind, tuple(self._vehicle.plans.items(kind)), None)

    def _submit_bulk(self, kind: Kind, payload: bytes, now_us: int) -> None:
        limit_us = round(self._link.profile.link.upload_s * 1e6)
        self._link.submit(kind, payload, Priority.BULK, now_us, limit_us)
