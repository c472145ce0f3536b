"""A random walk of faults and recoveries, judged at the pins and by the truth: nothing moves that must not, and all that is healed sails.

One station on one link does what every station can (arm, modes, go-to, hold, home, silence), while sensors, board and operator
fail one over another. Every dozen events all is healed, and after 20 s the operator gives one order. Where the vessel has told
that it was stopped for what it sounded before, that order is preceded by the one which that text names (USER_2).
"""

from __future__ import annotations

import math
import random
from collections import Counter

import pytest

from sitl.sensors.config import SensorFaults
from tests.world_station import Helm

ARM, SET_MODE, GO_TO, FORGET = 400, 176, 192, 31011
HOLD, AUTO, GUIDED, RTL = 4.0, 10.0, 15.0, 11.0
DEPTH_M = 20.0
DENIED = {"Auto", "Guided"}
EPISODE = 12
"""Events between two recoveries."""
EVENTS = 2000
FAULTS = {
    **dict.fromkeys(
        ("gnss_silent", "no_fix", "stuck", "frozen", "dead_reckoning", "heading_silent", "rate_silent"), True
    ),
    **dict.fromkeys(("depth_silent", "depth_no_bottom", "utc_blank", "no_line_end"), True),
    **dict.fromkeys(("flip_share", "cut_share", "loss_share"), 0.4),
    **{"jump_east_m": 150.0, "jump_north_m": -80.0, "heading_bias_deg": 180.0, "flood": 4},
    "depth_bias_m": -17.5,
}
NO_POSITION = ("gnss_silent", "no_fix")
GOOD = SensorFaults()


class Judge:
    """Looks at the pins after each tick. Knows orders and faults, and nothing of what the vessel thinks, but for its mode."""

    def __init__(self, walk):
        self.walk = walk
        self.forbidden = []
        self.since_us = {}
        self.may_move = False
        """Armed by an order since whatever disarms."""

    def look(self):
        walk, now_us = self.walk, self.walk.world.now_us
        faults, board = walk.faults, walk.world.surroundings.plant.board
        moves = any(abs(pulse - 1500.0) > 10.0 for pulse in board.pulses_us[:2] if pulse)
        mode = walk.world.snapshot.mode.value if walk.world.snapshot.armed else ""
        rules = {
            # what must not be: since when it would be forbidden, after how many seconds it is
            "not armed by anybody": (not self.may_move and moves, 0.3),
            "emergency stop": (walk.stopped and moves, 0.15),
            "no position": (any(getattr(faults, name) for name in NO_POSITION) and moves, 4.0),
            # fault row 24: a receiver that repeats itself is known after 10 s
            "receiver stuck": (faults.stuck and moves, 11.5),
            "shallow": (faults.depth_bias_m < -10.0 and not faults.depth_silent and moves, 5.0),
            "nobody there": (not walk.present and mode in DENIED, 5.3),
        }
        for name, (holds, limit_s) in rules.items():
            if not holds:
                self.since_us.pop(name, None)
            elif now_us - self.since_us.setdefault(name, now_us) > limit_s * 1e6:
                self.since_us[name] = now_us
                self.forbidden.append(f"{now_us * 1e-6:.2f} {name}: {mode} {board.pulses_us}")


class Walk(Helm):
    def __init__(self, seed):
        self.stopped = False
        self.judge = None
        super().__init__(
            "ardurover",
            "world.bottom.kind=flat",
            f"world.bottom.depth_m={DEPTH_M}",
            "mission.cruise_speed_mps=2.0",
            seed=seed,
        )
        self.chance = random.Random(f"walk/{seed}")
        self.faults = self.world.surroundings.plant.sensors.faults
        self.ends = []
        self.counts = Counter()
        self.stuck = []
        self.false_shoal = False
        self.judge = Judge(self)

    @property
    def board(self):
        return self.world.surroundings.plant.board

    def step(self):
        super().step()
        if self.judge is None:
            return
        self.judge.look()
        self.false_shoal = self.false_shoal or any("USER_2" in text.text for text in self.world.snapshot.texts)
        for due_us, undo in [each for each in self.ends if each[0] <= self.world.now_us]:
            self.ends.remove((due_us, undo))
            undo()

    # ---- what happens

    def event(self):
        what = self.chance.choices(("sensor", "board", "operator"), (6, 2, 4))[0]
        {"sensor": self.sensor, "board": self.board_fails, "operator": self.operator}[what]()
        self.run(self.chance.uniform(0.2, 5.0))

    def for_a_while(self, undo, least_s, most_s):
        self.ends.append((self.world.now_us + round(self.chance.uniform(least_s, most_s) * 1e6), undo))

    def sensor(self):
        name = self.chance.choice(sorted(FAULTS))
        self.counts[name] += 1
        self.faults.set(name, FAULTS[name])
        most_s = 3.0 if name == "depth_bias_m" else 15.0
        self.for_a_while(lambda: setattr(self.faults, name, getattr(GOOD, name)), 0.5, most_s)

    def board_fails(self):
        what = self.chance.choice(("reset", "hang", "emergency stop"))
        self.counts[what] += 1
        if what == "reset":
            self.board.reset(self.world.now_us, self.chance.choice((0, 800_000)))
        elif what == "hang":
            self.board.hang(self.world.now_us)
        else:
            self.press(True)
            self.for_a_while(lambda: self.press(False), 0.3, 8.0)
        self.judge.may_move = False

    def press(self, pressed):
        self.stopped = pressed
        self.board.set_estop(pressed)

    def operator(self):
        what = self.chance.choice(("silent", "arm", "disarm", "hold", "auto", "home", "go", "go"))
        self.counts[what] += 1
        if what == "silent":
            self.present = False
            self.for_a_while(lambda: setattr(self, "present", True), 2.0, 20.0)
        elif not self.present:
            return
        elif what in ("arm", "disarm"):
            self.arm(what == "arm")
        elif what == "go":
            self.go()
        else:
            self.command(SET_MODE, 1.0, {"hold": HOLD, "auto": AUTO, "home": RTL}[what])

    def arm(self, arm):
        accepted = self.command(ARM, float(arm)) == 0
        if accepted:
            self.judge.may_move = arm and not self.stopped
        return accepted

    def go(self):
        """To a place 30 to 60 m off, near the start."""
        bearing = math.atan2(-self.truth.east_m, -self.truth.north_m) + self.chance.uniform(-0.8, 0.8)
        far_m = self.chance.uniform(30.0, 60.0)
        lat, lon = self.world.surroundings.plant.frame.to_geodetic(
            self.truth.north_m + far_m * math.cos(bearing), self.truth.east_m + far_m * math.sin(bearing)
        )
        return self.command(GO_TO, -1.0, 1.0, 0.0, math.nan, math.degrees(lat), math.degrees(lon)) == 0

    # ---- and how it ends

    def heal(self):
        for _, undo in self.ends:
            undo()
        self.ends.clear()
        for name in FAULTS:
            setattr(self.faults, name, getattr(GOOD, name))
        self.press(False)
        self.present = True
        self.run(20.0)

    def recover(self):
        """One order, arm and go-to as one, gets the healed boat on; a stop for what a false echo left takes the one that its text names."""
        self.counts["recoveries"] += 1
        self.gcs.clear()
        for _ in range(2):
            if self.false_shoal:
                self.counts["forgotten"] += 1
                self.command(FORGET)
            self.false_shoal = False
            if self.sails():
                return
            if not self.false_shoal:
                break
        self.stuck.append(f"{self.now_s:.1f}: {self.texts()[-600:]}")

    def sails(self):
        """Whether arm and go-to bring it 12 m on."""
        place, end_s = (self.truth.north_m, self.truth.east_m), self.now_s + 60.0
        went = self.arm(True) and self.go()
        while went and self.now_s < end_s and not self.false_shoal:
            self.run(1.0)
            if math.dist(place, (self.truth.north_m, self.truth.east_m)) > 12.0:
                return True
        return False


def walked(seed, events):
    walk = Walk(seed)
    walk.arm(True)
    walk.go()
    for number in range(1, events + 1):
        walk.event()
        if number % EPISODE == 0 or number == events:
            walk.heal()
            walk.recover()
    return walk


def test_a_short_walk():
    walk = walked(1, 36)
    assert walk.judge.forbidden == []
    assert walk.stuck == []


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 6))
def test_two_thousand_events(seed):
    walk = walked(seed, EVENTS)
    print(
        f"seed {seed}: {dict(walk.counts)}, {walk.now_s:.0f} s, {len(walk.judge.forbidden)} forbidden, {len(walk.stuck)} stuck"
    )
    assert walk.judge.forbidden == []
    assert walk.stuck == []
