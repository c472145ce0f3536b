"""Periodic telemetry: which message is due on a link, made once for all links that show it the same way.

``Composer`` belongs to the vessel and remembers what it packed for the present snapshot; ``Streams`` belongs to one
endpoint and knows its rates. Streams start at multiples of their period, so that links with equal rates share the work.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

from ...language.snapshot import Snapshot
from ..persona import EndpointConfig
from ..wire.payload import Packed, Teller, message_id
from . import motion, system

_COMMON: Final[dict[int, Teller[[Snapshot]]]] = {
    teller.message_id: teller
    for teller in (
        system.system_time,
        motion.gps_raw_int,
        motion.attitude,
        motion.attitude_quaternion,
        motion.local_position_ned,
        motion.global_position_int,
        system.servo_output_raw,
        motion.nav_controller_output,
        motion.vfr_hud,
        motion.position_target_global_int,
        motion.distance_sensor,
        motion.altitude,
        system.battery_status,
        system.fence_status,
        motion.home_position,
        motion.gps_global_origin,
        system.extended_sys_state,
        motion.orbit_execution_status,
        motion.figure_eight_execution_status,
        system.sys_status,
        motion.water_depth,
    )
}
_PERSONAL: Final[dict[int, Teller[[Snapshot, EndpointConfig]]]] = {
    teller.message_id: teller
    for teller in (system.heartbeat, system.mission_current, system.current_mode, system.high_latency2)
}
"""What looks different under another persona."""

HEARTBEAT: Final = message_id("HEARTBEAT")
MISSION_CURRENT: Final = message_id("MISSION_CURRENT")
CURRENT_MODE: Final = message_id("CURRENT_MODE")
SYS_STATUS: Final = message_id("SYS_STATUS")
FENCE_STATUS: Final = message_id("FENCE_STATUS")
HIGH_LATENCY2: Final = message_id("HIGH_LATENCY2")

STREAMED: Final = frozenset(_COMMON) | frozenset(_PERSONAL)
"""Every message that SET_MESSAGE_INTERVAL and REQUEST_MESSAGE can ask for from the snapshot."""

DATA_STREAMS: Final[dict[int, tuple[int, ...]]] = {
    1: (message_id("GPS_RAW_INT"),),
    2: tuple(
        message_id(name)
        for name in (
            "SYS_STATUS",
            "GPS_RAW_INT",
            "NAV_CONTROLLER_OUTPUT",
            "MISSION_CURRENT",
            "FENCE_STATUS",
            "POSITION_TARGET_GLOBAL_INT",
        )
    ),
    3: (message_id("SERVO_OUTPUT_RAW"),),
    6: (message_id("GLOBAL_POSITION_INT"), message_id("LOCAL_POSITION_NED")),
    10: (message_id("ATTITUDE"),),
    11: (message_id("VFR_HUD"),),
    12: tuple(
        message_id(name) for name in ("BATTERY_STATUS", "SYSTEM_TIME", "DISTANCE_SENSOR", "ALTITUDE", "WATER_DEPTH")
    ),
}
"""MAV_DATA_STREAM groups of REQUEST_DATA_STREAM."""


SLOW_LINK_US: Final = 10_000_000
"""The shortest period that a slow link grants to a message it does not stream by itself."""


class Digest(NamedTuple):
    """The parts of a snapshot whose change is worth a message of its own."""

    face: tuple[object, ...]
    plan: tuple[object, ...]
    fence: tuple[object, ...]


class Batch(NamedTuple):
    """Messages that are due together."""

    made: dict[int, Packed]
    silent: list[int]
    """Those that have nothing true to say at present."""


class Composer:
    """Packs a message at most once for each snapshot and face, and a batch once for all links on which it is due."""

    __slots__ = ("_batches", "_common", "_personal", "_seen", "digest", "is_eventful", "snapshot")

    def __init__(self) -> None:
        self.snapshot: Snapshot | None = None
        """The one of this tick."""
        self.digest = Digest((), (), ())
        """What of the snapshot is told at once when it changes; the very same object while nothing of it changed."""
        self.is_eventful = False
        """Whether the snapshot brings texts, or items that were reached."""
        self._seen: tuple[object, ...] = ()
        self._common: dict[int, Packed | None] = {}
        self._personal: dict[tuple[int, str, str], Packed | None] = {}
        self._batches: dict[tuple[tuple[int, ...], str, str], Batch] = {}

    def turn_to(self, snapshot: Snapshot) -> None:
        """Take up a new snapshot."""
        self.snapshot = snapshot
        if self._common or self._personal:
            self._common.clear()
            self._personal.clear()
            self._batches.clear()
        progress, health = snapshot.progress, snapshot.health
        self.is_eventful = bool(snapshot.texts or progress.reached)
        plan = progress.seq, progress.state, progress.total, progress.mission_id, progress.fence_id, progress.rally_id
        fence = snapshot.fence.breached, health.fence_enabled, health.fence_ok
        seen = (snapshot.mode, snapshot.armed, snapshot.action, snapshot.guard, snapshot.terminated, plan, fence)
        if seen == self._seen:
            return
        self._seen = seen
        fresh = Digest((snapshot.mode, snapshot.armed, system.system_status(snapshot)), plan, fence)
        if fresh != self.digest:
            self.digest = fresh

    def compose(self, number: int, snapshot: Snapshot, config: EndpointConfig) -> Packed | None:
        """Return the packed message of this id, None when there is nothing to say or no such stream."""
        if snapshot is not self.snapshot:
            self.turn_to(snapshot)
        teller = _COMMON.get(number)
        if teller is not None:
            if number not in self._common:
                values = teller.values(snapshot)
                self._common[number] = None if values is None else teller.packed(values)
            return self._common[number]
        personal = _PERSONAL.get(number)
        if personal is None:
            return None
        key = number, config.persona, config.generic_mode_encoding
        if key not in self._personal:
            self._personal[key] = personal(snapshot, config)
        return self._personal[key]

    def batch(self, numbers: tuple[int, ...], snapshot: Snapshot, config: EndpointConfig) -> Batch:
        """Return the messages of these ids, packed, in this order."""
        if snapshot is not self.snapshot:
            self.turn_to(snapshot)
        key = numbers, config.persona, config.generic_mode_encoding
        batch = self._batches.get(key)
        if batch is None:
            batch = self._batches[key] = Batch({}, [])
            common = self._common
            for number in numbers:
                packed = common[number] if number in common else self.compose(number, snapshot, config)
                if packed is None:
                    batch.silent.append(number)
                else:
                    batch.made[number] = packed
        return batch


_NEVER_US: Final = 1 << 62


class _Pace:
    """Messages that come at the same times."""

    __slots__ = ("at_us", "numbers", "period_us")

    def __init__(self, at_us: int, period_us: int) -> None:
        self.at_us = at_us
        self.period_us = period_us
        self.numbers: list[int] = []


class Streams:
    """The periodic messages of one endpoint. Periods in microseconds; a message that is off has none."""

    def __init__(self, config: EndpointConfig) -> None:
        self._max_rate_hz = config.max_rate_hz
        self._caps = config.profile == "lora"
        self._defaults = {message_id(name): round(1e6 / rate) for name, rate in config.rates.items() if rate > 0}
        self._period_us: dict[int, int] = {}
        self._paces: list[_Pace] = []
        self._fresh: list[int] = []
        """Turned on since the last look, so without a time."""
        self.due_us = _NEVER_US
        """Before this time nothing is due."""
        for number in self._defaults:
            self._turn_on(number, self._defaults[number])

    def interval_us(self, number: int) -> int:
        """MESSAGE_INTERVAL.interval_us: the period, -1 off, 0 not available."""
        if number not in STREAMED:
            return 0
        return self._period_us.get(number, -1)

    def set_interval(self, number: int, interval_us: float) -> bool:
        """Set a period (0 = default, -1 = off). False when the message does not exist or the rate cannot be reached."""
        if number not in STREAMED or not -1 <= interval_us <= 0x7FFFFFFF or -1 < interval_us < 0:
            return False
        if interval_us == 0:
            interval_us = self._defaults.get(number, -1)
        if interval_us < 0:
            self._turn_off(number)
            return True
        if self._caps:
            interval_us = max(interval_us, self._defaults.get(number, SLOW_LINK_US))
        if interval_us < 0.999e6 / self._max_rate_hz:
            return False
        self._turn_on(number, round(interval_us))
        return True

    def set_group(self, group: int, rate_hz: float, start: bool) -> None:
        """REQUEST_DATA_STREAM: set a group's rate, at most what can be reached. Group 0 is all; an unknown one is ignored."""
        groups: Iterable[tuple[int, ...]] = DATA_STREAMS.values() if group == 0 else (DATA_STREAMS.get(group, ()),)
        interval_us = 1e6 / min(max(rate_hz, 0.1), self._max_rate_hz) if start and rate_hz > 0 else -1.0
        for numbers in groups:
            for number in numbers:
                self.set_interval(number, interval_us)

    def due(self, now_us: int) -> tuple[int, ...]:
        """Return the ids due at this time, those that wait longest first, and plan their next ones."""
        if now_us < self.due_us:
            return ()
        for number in self._fresh:
            self._plan(number, now_us)
        self._fresh.clear()
        waiting: dict[int, list[int]] = {}
        next_us = _NEVER_US
        for pace in self._paces:
            at_us = pace.at_us
            if at_us <= now_us:
                waiting.setdefault(at_us, []).extend(pace.numbers)
                at_us = pace.at_us = max(at_us, now_us - pace.period_us + 1) + pace.period_us
            if at_us < next_us:
                next_us = at_us
        self.due_us = next_us
        due: list[int] = []
        for at_us in sorted(waiting):
            due += sorted(waiting[at_us])
        return tuple(due)

    def _plan(self, number: int, now_us: int) -> None:
        """Give a message its first time and those that keep the same times for company."""
        period_us = self._period_us[number]
        at_us = now_us + (-now_us % period_us if period_us <= 1_000_000 else 0)
        for pace in self._paces:
            if pace.period_us == period_us and pace.at_us == at_us:
                break
        else:
            pace = _Pace(at_us, period_us)
            self._paces.append(pace)
        pace.numbers.append(number)

    def _turn_on(self, number: int, period_us: int) -> None:
        if self._period_us.get(number) != period_us:
            self._turn_off(number)
            self._period_us[number] = period_us
            self._fresh.append(number)
            self.due_us = 0

    def _turn_off(self, number: int) -> None:
        self._period_us.pop(number, None)
        if number in self._fresh:
            self._fresh.remove(number)
        for pace in self._paces:
            if number in pace.numbers:
                pace.numbers.remove(number)
        self._paces = [pace for pace in self._paces if pace.numbers]
