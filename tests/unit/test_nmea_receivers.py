"""One receiver that changes its talker, and two receivers on one line: told apart, whatever their rates and phases."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from companion.core.estimate.estimator import Estimator, EstimatorConfig
from companion.core.nmea.reader import NmeaConfig, NmeaReader
from mavlink_bridge.language.messages import GpsFix, Severity
from sitl.sensors import nmea_writer as write

LAT, LON = math.radians(41.1850123), math.radians(-8.7062154)
START_US = 1_767_268_800_000_000
EARTH_M = 6.371e6
TICK_US = 50_000


@dataclass
class Receiver:
    """One receiver: its talker may change with time; its antenna lies somewhere."""

    talker: Callable[[float], str]
    hz: float = 1.0
    phase_s: float = 0.0
    late_s: float = 0.12
    kinds: str = "GGA RMC VTG"
    north_m: float = 0.0
    whole_seconds: bool = False
    on: tuple[float, float] = (0.0, 1e9)

    def epochs(self, until_s: float) -> list[tuple[int, bytes]]:
        """(When sent, sentence) of everything, in order; sentences 2 ms apart."""
        sent = []
        for number in range(math.ceil(until_s * self.hz)):
            t_s = number / self.hz + self.phase_s
            if not self.on[0] <= t_s < self.on[1]:
                continue
            for place, sentence in enumerate(self.sentences(t_s)):
                sent.append((round((t_s + self.late_s) * 1e6) + 2_000 * place, sentence))
        return sent

    def sentences(self, t_s: float) -> list[bytes]:
        utc_us = START_US + round((math.floor(t_s) if self.whole_seconds else t_s) * 1e6)
        time, talker = write.time_fields(utc_us), self.talker(t_s)
        fix = write.fix_text(LAT + (self.north_m + 1.5 * t_s) / EARTH_M, LON, 1.5, 0.0)
        made = {
            "ZDA": write.zda(talker, time),
            "GGA": write.gga(talker, time[0], fix, 4, 12, 0.8, 2.1, 52.3),
            "RMC": write.rmc("GN" if talker == "GP+GN" else talker, time, fix, None, "R"),
            "VTG": write.vtg(talker, fix, "R"),
        }
        return [made[kind] for kind in self.kinds.split()]


class Line:
    """Everything on one line, through reader and estimator at 20 Hz."""

    def __init__(self, *receivers: Receiver, seconds: float = 45.0, config: NmeaConfig | None = None) -> None:
        self.reader = NmeaReader(config or NmeaConfig(), "compass")
        self.estimator = Estimator(EstimatorConfig())
        self.valid: list[bool] = []
        self.off_m: list[float] = []
        self.texts: list[tuple[Severity, str]] = []
        self.fixes: list[GpsFix] = []
        sent = sorted((item for each in receivers for item in each.epochs(seconds)), key=lambda item: item[0])
        now_us = 0
        while now_us < seconds * 1e6:
            now_us += TICK_US
            while sent and sent[0][0] <= now_us:
                at_us, sentence = sent.pop(0)
                self._take(self.reader.receive(sentence, at_us))
            self._tick(now_us)

    def _take(self, found: list) -> None:
        self.fixes += [item for item in found if self.estimator.update(item) and isinstance(item, GpsFix)]

    def _tick(self, now_us: int) -> None:
        self._take(self.reader.poll(now_us))
        self.texts += [*self.reader.drain_texts(), *self.estimator.drain_texts()]
        state = self.estimator.predict(now_us)
        self.valid.append(state.position_valid)
        if state.lat_rad is not None:
            self.off_m.append((state.lat_rad - LAT) * EARTH_M - 1.5 * now_us * 1e-6)

    def share_valid(self) -> float:
        """Share of ticks with a position, from the third second on."""
        judged = self.valid[60:]
        return sum(judged) / len(judged)

    def wander_m(self) -> float:
        """From the sixth second on: by then the receivers are told apart and the choice is made."""
        return max(self.off_m[120:]) - min(self.off_m[120:])

    def said(self, what: str) -> list[str]:
        return [text for _, text in self.texts if what in text]


def turns(*runs_s: float) -> Callable[[float], str]:
    """GN, GP, GN ... for so many seconds each, over and over."""

    def talker(t_s: float) -> str:
        left = t_s % sum(runs_s)
        for number, run_s in enumerate(runs_s):
            if left < run_s:
                return ("GN", "GP")[number % 2]
            left -= run_s
        return "GN"

    return talker


@pytest.mark.parametrize("hz", [1.0, 2.0, 5.0])
@pytest.mark.parametrize("runs_s", [(2.0, 2.0), (4.0, 4.0), (3.0, 2.0, 4.0, 3.0), (1.0, 5.0), (2.4, 3.4), (20.0, 1.0)])
@pytest.mark.parametrize("kinds", ["ZDA GGA RMC VTG", "VTG RMC GGA"])
def test_a_receiver_that_changes_its_talker_keeps_its_position(
    hz: float, runs_s: tuple[float, ...], kinds: str
) -> None:
    line = Line(Receiver(turns(*runs_s), hz=hz, kinds=kinds))
    assert line.share_valid() >= 0.99
    assert len(line.fixes) >= 0.99 * 45.0 * hz - 2
    assert line.said("receivers") == line.said("silent") == []
    assert line.wander_m() < 1.5


def test_a_talker_that_counts_whole_seconds_may_change_within_one() -> None:
    line = Line(Receiver(turns(2.5, 3.3), hz=5.0, whole_seconds=True))
    assert line.share_valid() >= 0.99
    assert line.said("receivers") == []


def test_each_sentence_may_have_its_own_talker_all_the_time() -> None:
    mixed = Receiver(lambda t: "GP")
    mixed_too = Receiver(lambda t: "GN", kinds="RMC", late_s=0.13)
    mixed.kinds = "GGA VTG"
    line = Line(mixed, mixed_too)
    assert line.share_valid() >= 0.99
    assert line.said("receivers") == []


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ({}, {}),
        ({}, {"late_s": 0.121}),
        ({}, {"late_s": 0.9}),
        ({"hz": 5.0}, {}),
        ({"hz": 5.0}, {"phase_s": 0.05}),
        ({}, {"phase_s": 0.3}),
        ({"hz": 10.0}, {"hz": 10.0, "phase_s": 0.03}),
        ({}, {"kinds": "RMC", "whole_seconds": True}),
        ({"kinds": "GGA"}, {"kinds": "VTG GGA RMC"}),
    ],
)
@pytest.mark.parametrize("talkers", [("GP", "GN"), ("GN", "II"), ("II", "GP")])
def test_two_receivers_are_never_mixed(first: dict, second: dict, talkers: tuple[str, str]) -> None:
    line = Line(
        Receiver(lambda t: talkers[0], **first),
        Receiver(lambda t: talkers[1], north_m=30.0, **{"late_s": 0.125, **second}),
    )
    assert line.share_valid() >= 0.99
    assert line.wander_m() < 2.0
    late = [fix for fix in line.fixes[20:] if fix.has_position]
    north = [(fix.lat_rad - LAT) * EARTH_M - 1.5 * (fix.utc_us - START_US) * 1e-6 for fix in late]
    assert max(north) - min(north) < 2.0  # whole seconds: up to 1.5 m
    (text,) = line.said("two receivers")
    assert talkers[0] in text
    assert talkers[1] in text
    assert len(line.said("30 m from")) == 1


def test_the_second_receiver_steps_in_when_the_first_dies_and_the_first_does_not_flap_back() -> None:
    dies = Receiver(lambda t: "GP", hz=5.0, on=(0.0, 20.0))
    again = Receiver(lambda t: "GP", hz=5.0, on=(22.0, 25.0))
    line = Line(dies, again, Receiver(lambda t: "GN", hz=5.0, north_m=2.0, late_s=0.125))
    assert line.share_valid() >= 0.99
    assert len(line.said("silent, using")) == 1
    assert line.wander_m() < 3.0


def test_named_receivers_lead_in_their_order_and_forbidden_ones_are_not_heard() -> None:
    both = (Receiver(lambda t: "GP"), Receiver(lambda t: "GN", north_m=30.0, late_s=0.125))
    for talkers, north_m in (
        (("GN",), 30.0),
        (("GN", "GP"), 30.0),
        (("GP", "GN"), 0.0),
        (("-GP",), 30.0),
        (("-GN",), 0.0),
    ):
        line = Line(*both, config=NmeaConfig(talkers=talkers), seconds=20.0)
        north = [(fix.lat_rad - LAT) * EARTH_M - 1.5 * (fix.utc_us - START_US) * 1e-6 for fix in line.fixes[5:]]
        assert north == pytest.approx([north_m] * len(north), abs=0.1), talkers
        assert len(north) >= 13


def test_three_receivers_on_one_line() -> None:
    three = [
        Receiver(lambda t, n=n: ("GP", "GN", "II")[n], north_m=40.0 * n, late_s=0.12 + 0.003 * n) for n in range(3)
    ]
    line = Line(*three)
    assert line.share_valid() >= 0.99
    assert line.wander_m() < 2.0


def test_a_speed_from_elsewhere_is_not_mixed_with_the_receivers_own() -> None:
    """A plotter's VTG (its log's speed, say) beside a receiver that sends no VTG; without an RMC it is all there is."""

    def vtg(fix_mps: float) -> Receiver:
        made = Receiver(lambda t: "II", kinds="VTG", late_s=0.13)
        made.sentences = lambda t_s: [write.vtg("II", write.fix_text(LAT, LON, fix_mps, 0.0), "R")]
        return made

    own = Line(Receiver(lambda t: "GP", kinds="GGA RMC"), vtg(4.0))
    assert {round(fix.sog_mps, 1) for fix in own.fixes[2:-1]} == {1.5}
    only = Line(Receiver(lambda t: "GP", kinds="GGA"), vtg(4.0))
    assert {round(fix.sog_mps, 1) for fix in only.fixes[5:-1]} == {4.0}
