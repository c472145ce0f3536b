"""Periodic telemetry: which message is due on a link, made once for all links that show it the same way.

``Composer`` belongs to the vessel and remembers what it packed for the present snapshot; ``Streams`` belongs to one
endpoint and knows its rates. Streams start at multiples of their period, so that links with equal rates share the work.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from heapq import heapify, heappop, heappush, heapreplace
from typing import Any, Final, NamedTuple

from mavlink_bridge import telemetry_motion as motion, telemetry_system as system
from mavlink_bridge.codec import dialect
from mavlink_bridge.endpoint_config import EndpointConfig
from mavlink_bridge.snapshot import Snapshot
from mavlink_bridge.wire import Packed, packed

Build = Callable[[Snapshot], Any]
BuildForPersona = Callable[[Snapshot, EndpointConfig], Any]

_COMMON: Final[dict[str, Build]] = {
    "SYSTEM_TIME": system.system_time,
    "GPS_RAW_INT": motion.gps_raw_int,
    "ATTITUDE": motion.attitude,
    "ATTITUDE_QUATERNION": motion.attitude_quaternion,
    "LOCAL_POSITION_NED": motion.local_position_ned,
    "GLOBAL_POSITION_INT": motion.global_position_int,
    "SERVO_OUTPUT_RAW": system.servo_output_raw,
    "NAV_CONTROLLER_OUTPUT": motion.nav_controller_output,
    "VFR_HUD": motion.vfr_hud,
    "POSITION_TARGET_GLOBAL_INT": motion.position_target_global_int,
    "DISTANCE_SENSOR": motion.distance_sensor,
    "ALTITUDE": motion.altitude,
    "BATTERY_STATUS": system.battery_status,
    "FENCE_STATUS": system.fence_status,
    "HOME_POSITION": motion.home_position,
    "EXTENDED_SYS_STATE": system.extended_sys_state,
    "ORBIT_EXECUTION_STATUS": motion.orbit_execution_status,
    "FIGURE_EIGHT_EXECUTION_STATUS": motion.figure_eight_execution_status,
    "SYS_STATUS": system.sys_status,
    "WATER_DEPTH": motion.water_depth,
}
_PERSONAL: Final[dict[str, BuildForPersona]] = {
    "HEARTBEAT": system.heartbeat,
    "MISSION_CURRENT": system.mission_current,
    "CURRENT_MODE": system.current_mode,
    "HIGH_LATENCY2": system.high_latency2,
}


def message_id(name: str) -> int:
    number: int = getattr(dialect, f"MAVLINK_MSG_ID_{name}")
    return number


_BUILDERS: Final[dict[int, Build]] = {message_id(name): build for name, build in _COMMON.items()}
_PERSONAL_BUILDERS: Final[dict[int, BuildForPersona]] = {message_id(name): build for name, build in _PERSONAL.items()}

HEARTBEAT: Final = message_id("HEARTBEAT")
MISSION_CURRENT: Final = message_id("MISSION_CURRENT")
CURRENT_MODE: Final = message_id("CURRENT_MODE")
SYS_STATUS: Final = message_id("SYS_STATUS")
FENCE_STATUS: Final = message_id("FENCE_STATUS")
HIGH_LATENCY2: Final = message_id("HIGH_LATENCY2")

STREAMED: Final = frozenset(_BUILDERS) | frozenset(_PERSONAL_BUILDERS)
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


class Composer:
    """Builds and packs a message at most once for each snapshot and face."""

    __slots__ = ("_cache", "_digest", "_snapshot")

    def __init__(self) -> None:
        self._snapshot: Snapshot | None = None
        self._cache: dict[object, Packed | None] = {}
        self._digest: Digest | None = None

    def digest(self, snapshot: Snapshot) -> Digest:
        """What of a snapshot is told at once when it changes; the very same object while nothing of it changed."""
        if snapshot is not self._snapshot:
            self._turn_to(snapshot)
        return self._digest or Digest((), (), ())

    def _turn_to(self, snapshot: Snapshot) -> None:
        self._snapshot = snapshot
        self._cache.clear()
        progress, health = snapshot.progress, snapshot.health
        fresh = Digest(
            (snapshot.mode, snapshot.armed, system.system_status(snapshot)),
            (progress.seq, progress.state, progress.total, progress.mission_id, progress.fence_id, progress.rally_id),
            (snapshot.fence.breached, health.fence_enabled, health.fence_ok),
        )
        if fresh != self._digest:
            self._digest = fresh

    def compose(self, number: int, snapshot: Snapshot, config: EndpointConfig) -> Packed | None:
        """Return the packed message of this id, None when there is nothing to say or no such stream."""
        if snapshot is not self._snapshot:
            self._turn_to(snapshot)
        personal = _PERSONAL_BUILDERS.get(number)
        key: object = number if personal is None else (number, config.persona, config.generic_mode_encoding)
        if key in self._cache:
            return self._cache[key]
        message: Any = None
        if personal is not None:
            message = personal(snapshot, config)
        elif number in _BUILDERS:
            message = _BUILDERS[number](snapshot)
        made = self._cache[key] = None if message is None else packed(message)
        return made


class Streams:
    """The periodic messages of one endpoint. Periods in microseconds; a message that is off has none."""

    def __init__(self, config: EndpointConfig) -> None:
        self._max_rate_hz = config.max_rate_hz
        self._caps = config.profile == "lora"
        self._defaults = {message_id(name): round(1e6 / rate) for name, rate in config.rates.items() if rate > 0}
        self._period_us: dict[int, int] = {}
        self._queue: list[tuple[int, int, int]] = []
        self._version: dict[int, int] = {}
        self._fresh: list[int] = []
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

    def due(self, now_us: int) -> list[int]:
        """Return the ids due at this time and plan their next ones."""
        if not self._fresh and (not self._queue or self._queue[0][0] > now_us):
            return []
        for number in self._fresh:
            period_us = self._period_us.get(number)
            if period_us is not None:
                start_us = now_us + (-now_us % period_us if period_us <= 1_000_000 else 0)
                heappush(self._queue, (start_us, number, self._version[number]))
        if self._fresh and len(self._queue) > 4 * len(STREAMED):
            self._queue = [entry for entry in self._queue if self._version[entry[1]] == entry[2]]
            heapify(self._queue)
        self._fresh.clear()
        queue, ready = self._queue, []
        while queue and queue[0][0] <= now_us:
            at_us, number, version = queue[0]
            if self._version[number] != version:
                heappop(queue)
                continue
            ready.append(number)
            period_us = self._period_us[number]
            heapreplace(queue, (max(at_us, now_us - period_us + 1) + period_us, number, version))
        return ready

    def _turn_on(self, number: int, period_us: int) -> None:
        if self._period_us.get(number) != period_us:
            self._turn_off(number)
            self._period_us[number] = period_us
            self._fresh.append(number)

    def _turn_off(self, number: int) -> None:
        self._period_us.pop(number, None)
        self._version[number] = self._version.get(number, 0) + 1
        if number in self._fresh:
            self._fresh.remove(number)
