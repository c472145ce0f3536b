"""``companion check F --live``: listen to the sensor links for some seconds and say what comes, how often, and what it means."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final

from mavlink_bridge.language.messages import EstimatedState, FixType, Severity

from ...core.estimate import Estimator
from ...core.nmea import NmeaReader
from ...io.clock import Clock, SystemClock
from ...io.links import Closed, Link, Opened, Received, open_link
from ...settings import Settings
from ...settings.schema import SensorConfig

_TICK_US: Final = 50_000


class LiveSensor:
    """One sensor link being listened to."""

    def __init__(self, item: SensorConfig, link: Link) -> None:
        self.item = item
        self.link = link
        self.reader = NmeaReader(item.nmea, item.name)
        self.condition = "never opened"
        self.received_bytes = 0

    def step(self, now_us: int, estimator: Estimator, source: int) -> None:
        """Read what has come."""
        for event in self.link.poll(now_us):
            if isinstance(event, Received):
                self.received_bytes += len(event.data)
                for item in self.reader.receive(event.data, now_us):
                    estimator.update(item, source)
            elif isinstance(event, Opened):
                self.condition = f"open to {event.peer}"
            elif isinstance(event, Closed):
                self.condition = f"closed: {event.reason}"
        for item in self.reader.poll(now_us):
            estimator.update(item, source)

    def report(self, now_us: int) -> list[str]:
        """Say what was heard: each sentence with rate and age, then every kind of damage that is not zero."""
        lines = [f"{self.item.name}: {self.item.url}, {self.condition}, {self.received_bytes} bytes"]
        counters = self.reader.counters
        for address, age_s in sorted(self.reader.sentence_ages(now_us).items()):
            rate = counters[address] / max(now_us * 1e-6, 0.1)
            lines.append(f"  {address:<6} {counters[address]:>6}  {rate:5.1f} Hz  {age_s:6.2f} s ago")
        other = {name: count for name, count in counters.items() if name.islower() and count}
        for name in ("bytes", "sentences"):
            other.pop(name, None)
        lines += [f"  {name.replace('_', ' '):<16} {count}" for name, count in sorted(other.items())]
        return lines


def watch(
    settings: Settings,
    seconds: float,
    *,
    make_link: Callable[..., Link] = open_link,
    clock: Clock | None = None,
    say: Callable[[str], None] = print,
) -> bool:
    """Listen for ``seconds`` and report; True when every link brought sentences and there are position and heading."""
    clock = clock or SystemClock()
    sensors = [
        LiveSensor(item, make_link(item.name, item.url, **({} if item.baud is None else {"baud": item.baud})))
        for item in settings.sensors
    ]
    estimator = Estimator(settings.estimate)
    start_us = clock.now_us()
    end_us = start_us + round(seconds * 1e6)
    texts: list[tuple[Severity, str]] = []
    now_us = start_us
    while now_us < end_us:
        clock.sleep_until_us(min(end_us, now_us + _TICK_US))
        now_us = clock.now_us()
        for source, sensor in enumerate(sensors):
            sensor.step(now_us, estimator, source)
            texts += sensor.reader.drain_texts()
        texts += estimator.drain_texts()
    state = estimator.predict(now_us)
    for line in _report(sensors, texts, state, estimator, now_us):
        say(line)
    for sensor in sensors:
        sensor.link.close()
    heard = all(sensor.reader.sentence_ages(now_us) for sensor in sensors)
    return heard and state.position_valid and state.heading_valid


def _report(
    sensors: Sequence[LiveSensor],
    texts: Sequence[tuple[Severity, str]],
    state: EstimatedState,
    estimator: Estimator,
    now_us: int,
) -> list[str]:
    lines = [line for sensor in sensors for line in sensor.report(now_us)]
    lines += [f"{severity.name.lower()}: {text}" for severity, text in texts]
    fix, distance = estimator.latest_fix, estimator.latest_distance
    lines.append(f"position {_position(state)}, {'no receiver' if fix is None else _kind(fix.fix_type)}")
    lines.append(f"heading  {_degrees(state.psi_rad)}{' (from the course)' if state.heading_from_course else ''}")
    lines.append(f"roll     {_degrees(state.phi_rad)}, pitch {_degrees(state.theta_rad)}")
    lines += [f"used for {quantity}: {source}" for quantity, source in estimator.used.items()]
    found = None if distance is None else distance.value_m
    lines.append("depth    none" if found is None else f"depth    {found:.2f} m below the transducer")
    return lines


def _kind(fix_type: FixType) -> str:
    return fix_type.name.replace("_", " ").lower()


def _position(state: EstimatedState) -> str:
    if state.lat_rad is None or state.lon_rad is None:
        return "none"
    return f"{math.degrees(state.lat_rad):.7f} {math.degrees(state.lon_rad):.7f}"


def _degrees(angle_rad: float | None) -> str:
    return "none" if angle_rad is None else f"{math.degrees(angle_rad):.1f} deg"
