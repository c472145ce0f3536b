"""What the mission servers of a vessel share: the plans in force, the patience of a link, and who is uploading."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from ...language.requests import PlanItem, PlanKind, Reply
from .plan_rules import MAX_ITEMS
from .upload import MAX_WINDOW, Upload

Sender = tuple[int, int]
"""System and component id of a ground station."""

ANOTHER_ABOARD: Final = "another one is aboard; read it first"
"""To who changes a part of a plan: what stands around it would come back with it."""
_FRAMES: Final = 256
"""A sender's frames are counted in one byte; of two numbers the one that lies less than half a round ahead is the newer one."""


@dataclass(frozen=True, slots=True)
class MissionTiming:
    """How patient the server is. ``hold_us`` set: keep an upload open while the vessel stores it, as a slow radio needs."""

    retry_us: int = 1_500_000
    """Longest wait for an item; must exceed the link's round trip."""
    retries: int = 5
    window: int = MAX_WINDOW
    """Most requests under way at once; 1 on a half-duplex link."""
    store_us: int | None = 30_000_000
    """How long the vessel may take to store a plan before the sender is told that it failed; None: for ever."""
    most_items: int = MAX_ITEMS
    """Items that may cross to the vessel at best: more are refused before the first one is asked for."""
    hold_us: int | None = None
    """Ask for the last two items in turn this often (0.4 s) until ``finish``, so that the sender goes on waiting."""
    hold_single_us: int = 1_800_000
    """How long a one-item plan can be held: some clients give up on repeats of the same item after 2 s. None of them changes a part of a
    plan, which is held as long as any other."""

    def collect(self, first: int, count: int, now_us: int) -> Upload:
        """What collects the items of an upload that begins now."""
        return Upload(
            first=first,
            count=count,
            now_us=now_us,
            retry_us=self.retry_us,
            retries=self.retries,
            window=self.window,
        )


class UploadLocks:
    """Which upload of each kind is under way, over all links of a vessel."""

    def __init__(self) -> None:
        self._holders: dict[PlanKind, tuple[object, int]] = {}

    def claim(self, kind: PlanKind, holder: object, now_us: int, silent_us: int) -> bool:
        """Take or refresh the lock. A holder that was silent for ``silent_us`` loses it."""
        if self.holder(kind, now_us, silent_us) not in (None, holder):
            return False
        self._holders[kind] = (holder, now_us)
        return True

    def holder(self, kind: PlanKind, now_us: int, silent_us: int) -> object | None:
        """Who uploads plans of a kind; None: nobody, or one who was silent for ``silent_us``."""
        current = self._holders.get(kind)
        return None if current is None or now_us - current[1] >= silent_us else current[0]

    def held(self, kind: PlanKind, holder: object) -> bool:
        current = self._holders.get(kind)
        return current is not None and current[0] is holder

    def release(self, kind: PlanKind, holder: object) -> None:
        if self.held(kind, holder):
            del self._holders[kind]


@dataclass(slots=True, eq=False)
class UploadSession:
    """An upload from its first message until its MISSION_ACK."""

    sender: Sender
    kind: PlanKind
    upload: Upload
    base: tuple[PlanItem, ...] = ()
    """What stands around a partial upload."""
    base_id: int | None = None
    """Id of the plan that this was taken from; None: no partial upload."""
    storing_us: int | None = None
    """When the items were complete; None while they come in."""
    held_us: int = 0
    held_seq: int | None = None
    """The item asked for last while holding; None: the station never had to be held."""
    given_up: bool = False
    """The station has given it up while the vessel was storing it: it is asked for no item more, and a text tells the end."""
    _frame: int = 0
    """Number of the newest frame of the station's that belongs to it."""

    def heard(self, message: Any) -> None:
        """A message of this upload came."""
        number = message.get_seq()
        if (number - self._frame) % _FRAMES < _FRAMES // 2 or not self.upload.items:
            self._frame = number

    @property
    def clears(self) -> bool:
        """Whether it leaves nothing, and was asked for no item: a station that misses its ACK asks for it again."""
        return self.upload.count == 0

    def is_copy(self, message: Any, upload: Upload) -> bool:
        """Whether the request for ``upload``, which comes when all items are here, is the late one that began this upload.

        Who answers for the items has been asked for them, and repeats no such request: one that was made after them begins another upload.
        """
        is_same = (upload.first, upload.count) == (self.upload.first, self.upload.count)
        is_late = (self._frame - message.get_seq()) % _FRAMES < _FRAMES // 2
        return is_same and is_late and not self.given_up


@dataclass(slots=True)
class Pending:
    """Something handed to the vessel whose outcome a ground station waits for."""

    sender: Sender
    mission_type: int
    waiting: int = 1
    session: UploadSession | None = None
    failed: Reply | None = None
    kind: PlanKind = PlanKind.MISSION
