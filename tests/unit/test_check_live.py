"""``companion check --live``: what it says of good, silent and damaged sensor links."""

from __future__ import annotations

import random
from collections.abc import Sequence

from companion.commands.check.live_data import watch
from companion.io.links.mem import MemLink
from companion.settings.schema import SensorConfig, Settings
from sitl.sensors.talkers import SensorSuite, SimulatedSensors as SimSensors
from tools.benches.cells.sensor_rig import straight, truth_at


class FedClock:
    """Virtual time; the simulated sensors write into the far end of the link while it passes."""

    def __init__(self, far: MemLink, suite: SensorSuite | None, garbage: bytes = b"") -> None:
        self._now_us = 0
        self._far = far
        self._suite = suite
        self._garbage = garbage

    def now_us(self) -> int:
        return self._now_us

    def utc_us(self) -> int | None:
        return None

    def sleep_until_us(self, t_us: int, filenos: Sequence[int] = ()) -> bool:
        self._now_us = t_us
        self._far.poll(t_us)
        if self._suite is not None:
            self._far.write(0, b"".join(self._suite.step(t_us, truth_at(straight(1.0, 0.5), t_us))))
        if self._garbage:
            self._far.write(0, self._garbage)
        return False


def listen(suite: SensorSuite | None, garbage: bytes = b"", seconds: float = 10.0) -> tuple[bool, str]:
    near, far = MemLink("compass"), MemLink("far")
    near.connect(far)
    lines: list[str] = []
    settings = Settings(sensors=(SensorConfig(name="compass", url="mem:x"),))
    good = watch(
        settings, seconds, make_link=lambda *_, **__: near, clock=FedClock(far, suite, garbage), say=lines.append
    )
    return good, "\n".join(lines)


def test_a_good_compass_shows_each_sentence_and_the_state() -> None:
    good, text = listen(SensorSuite(SimSensors(attitude_sentence="PASHR"), random.Random(1)))
    assert good
    for part in (
        "GPGGA",
        "GPHDT",
        "PASHR",
        "SDDPT",
        "5.0 Hz",
        "rtk fixed",
        "position 41.18",
        "heading  2",
        "used for heading: compass GPHDT",
        "depth    7.",
    ):
        assert part in text
    assert "checksum" not in text


def test_a_silent_link_fails() -> None:
    good, text = listen(None)
    assert not good
    assert "0 bytes" in text
    assert "position none, no receiver" in text


def test_a_wrong_baud_rate_is_named() -> None:
    good, text = listen(None, bytes(range(128, 160)))
    assert not good
    assert "baud rate" in text
    assert "noise bytes" in text
