"""The companion's side of the actuator line as bytes and verdicts: start-up, levels, rates, faults. Virtual time."""

from __future__ import annotations

import math

import pytest

from companion.core.board import wire
from companion.core.board.actuator_map import ActuatorConfig
from companion.core.board.arduino import Arduino
from companion.core.guard.board_watch import BoardWatch
from mavlink_bridge.language.messages import ActuatorOutput

NEUTRAL = b"m1500M1500l1500L1500*4B\n"
NEUTRAL_0 = b"m1500\nM1500\nl1500\nL1500\n"
QUERY = b"#VERS?*58\n"
VERSION = wire.checked("#V,1,1.0,UNO,500")
BANNER = wire.checked("#B,1,1.0,UNO,P")


def status(state="C", good=10, bad=0, applied=(1500, 1500, 1500, 1500), strict=1, cause="P", millivolts=0):
    pulses = ",".join(map(str, applied))
    return wire.checked(f"#S,{state},{strict},20,{good},{bad},{pulses},{cause},{millivolts}")


class Line:
    """Ticks of 50 ms with a scripted board."""

    def __init__(self, answers=True, seen=False, **config):
        self.board = Arduino(ActuatorConfig(**config), math.radians(30.0), seen=seen)
        self.now_us = 0
        self.thrust = 0.0
        self.written = []
        self.answers = answers
        self.applied = None
        self.state = "C"
        self.good = 0
        self.accepts = None
        self.version = VERSION

    def open(self):
        self.board.opened(self.now_us)
        return self

    def tick(self, count=1):
        for _ in range(count):
            self.now_us += 50_000
            output = ActuatorOutput(self.now_us, self.thrust, self.thrust, 0.0, 0.0, "demand")
            data = self.board.encode(output, self.now_us)
            if data:
                taken = len(data) if self.accepts is None else min(self.accepts, len(data))
                self.board.note_written(taken, len(data), self.now_us)
                self.written.append(data[:taken])
                self.good += 1
            if self.answers:
                self.answer(data)
        return self

    def answer(self, data):
        if QUERY in data:
            self.board.receive(self.version, self.now_us)
        if self.now_us % 100_000 == 0 and self.board.commanded_us:
            applied = self.applied or self.board.commanded_us
            self.board.receive(status(self.state, self.good, applied=applied), self.now_us)

    def running(self):
        self.open()
        self.board.receive(BANNER, self.now_us)
        return self.tick(10)

    @property
    def ready(self):
        return self.board.ready(self.now_us)

    @property
    def faults(self):
        return self.board.faults(self.now_us)

    def said(self):
        return " | ".join(text for _, text in self.board.drain_texts())


def test_closed_says_lost_and_writes_nothing():
    line = Line().tick(5)
    assert line.written == []
    assert line.faults == ("lost",)
    assert line.ready == (False, "actuator port is not open")


def test_silent_until_the_banner_then_neutral_before_anything():
    line = Line().open().tick(20)
    assert line.written == []
    line.board.receive(BANNER, line.now_us)
    line.thrust = 1.0
    line.tick(5)
    assert line.written[0] == NEUTRAL + QUERY
    assert line.written[1:5] == [NEUTRAL] * 4
    line.tick()
    assert line.written[5] == wire.encode_level1((2000, 2000, 1500, 1500))


def test_without_a_banner_neutral_comes_after_two_and_a_half_seconds():
    line = Line(answers=False).open().tick(49)
    assert line.written == []
    line.tick()
    assert line.written == [NEUTRAL_0 + QUERY]


def test_a_board_that_runs_on_is_known_by_its_status():
    line = Line().open()
    line.board.receive(status("F"), 0)
    line.tick(8)
    assert line.written[0] == NEUTRAL + QUERY
    assert line.ready == (True, "")


@pytest.mark.parametrize("level", ["auto", "1"])
def test_row_17_a_line_that_never_answers_is_no_board(level):
    """Not level 0: a dead board, a wrong baud rate and crossed wires look the same."""
    line = Line(answers=False, level=level).open().tick(200)
    assert line.board.status.level is None
    assert line.faults == ("mute",)
    ready, reason = line.ready
    assert ready is False
    for cause in ("baud", "cable", "firmware"):
        assert cause in reason
    said = line.said()
    assert "does not answer" in said
    for switch in ("LEVEL0", "level", "allow"):
        assert switch not in reason + said, "a mute line must not teach how to sail with it"
    assert all(NEUTRAL_0 in data for data in line.written), "neutral for ever, and asked again"
    assert sum(QUERY in data for data in line.written) > 20


def test_a_mute_line_that_begins_to_answer_is_taken():
    line = Line(answers=False).open().tick(200)
    line.answers = True
    line.tick(20)
    assert line.board.status.level == 1
    assert line.ready == (True, "")
    assert line.faults == ()


@pytest.mark.parametrize("level", ["auto", "1"])
def test_a_board_of_another_protocol_gets_neutral_only_and_is_named(level):
    line = Line(level=level).open()
    line.version = wire.checked("#V,2,9.9,UNO,500")
    line.board.receive(wire.checked("#B,2,9.9,UNO,P"), line.now_us)
    line.thrust = 1.0
    line.tick(100)
    told = "actuator board speaks protocol 2, this program 1: put this program's firmware on it"
    assert line.ready == (False, told)
    assert all(data.startswith(NEUTRAL) for data in line.written)
    said = line.said()
    assert said.lower().count(told.lower()) == 1
    assert "ready" not in said
    line.version = VERSION
    line.board.receive(BANNER, line.now_us)
    line.tick(10)
    assert line.ready == (True, ""), "the firmware was put on it"


def test_a_board_that_turns_out_to_speak_another_protocol_under_way_is_lost():
    line = Line().running().tick(4)
    assert line.ready == (True, "")
    line.board.receive(wire.checked("#V,2,9.9,UNO,500"), line.now_us)
    line.tick()
    assert line.ready[0] is False
    report = BoardWatch().step(line.board.status, line.faults, ready=False, armed=True)
    assert report.flags.actuator_lost


def test_level_0_is_the_owners_choice_and_needs_a_person_who_saw_the_outputs_move():
    line = Line(answers=False, level="0").open().tick(80)
    assert line.board.status.level == 0
    assert line.ready[0] is False
    assert "bench-actuators" in line.ready[1]
    seen = Line(answers=False, level="0", seen=True).open().tick(80)
    assert seen.ready == (True, "")
    assert "does not stop if this computer dies" in seen.said()
    assert set(seen.written) == {NEUTRAL_0}


def test_level_0_tells_what_was_commanded_and_never_that_it_was_applied():
    line = Line(answers=False, level="0", seen=True).open().tick(80)
    line.thrust = 0.5
    line.tick(2)
    found = line.board.status
    assert (found.applied_us, found.commanded_us) == (None, (1750, 1750, 1500, 1500))
    assert Line().running().tick(5).board.status.commanded_us is None


def test_level_0_at_the_originals_one_hertz_arms_and_is_told_what_is_true_of_it():
    """Its board does not stop between two commands; that it does and that nothing arms was said of it."""
    line = Line(answers=False, level="0", seen=True, frequency_hz=1.0).open().tick(120)
    assert line.ready == (True, "")
    said = line.said()
    assert "does not stop if this computer dies" in said
    assert "up to 1000 ms late" in said
    assert "no arming" not in said


def test_level_0_warns_again_and_again():
    line = Line(answers=False, level="0", seen=True).open().tick(80)
    line.said()
    line.tick(20 * 60)
    assert line.said().count("does not stop") >= 2


def test_level_0_can_be_demanded():
    line = Line(level="0", sketch="fixed-block", seen=True).open()
    line.tick(60)
    assert line.ready == (True, "")
    assert set(line.written) == {b"m1500M1500l1500L1500"}


@pytest.mark.parametrize(
    ("sketch", "frame"),
    [
        ("parse-int", NEUTRAL_0),
        ("read-line", NEUTRAL_0),
        ("next-byte", NEUTRAL_0),
        ("fixed-block", b"m1500M1500l1500L1500"),
    ],
)
def test_each_sketch_style_gets_its_terminator(sketch, frame):
    line = Line(level="0", sketch=sketch).open().tick(60)
    assert line.written[-1] == frame


def test_every_tick_repeats_all_four_changed_or_not():
    line = Line().running()
    line.written.clear()
    line.tick(40)
    assert line.written == [NEUTRAL] * 40


def test_message_frequency_sets_the_rate_but_never_delays_a_stop():
    line = Line(frequency_hz=4.0).running()
    line.thrust = 0.5
    line.tick(40)
    line.written.clear()
    line.tick(40)
    assert len(line.written) == 8
    line.tick(1)
    line.written.clear()
    line.thrust = 0.0
    line.tick(1)
    assert line.written == [NEUTRAL]


@pytest.mark.parametrize(("hertz", "text"), [(1.0, "no arming"), (5.0, "200 ms late"), (20.0, "every 50 ms")])
def test_a_new_rate_says_what_it_costs(hertz, text):
    line = Line(frequency_hz=10.0).running()
    line.said()
    line.board.configure(ActuatorConfig(frequency_hz=hertz))
    assert text in line.said()


def test_slower_than_the_silence_limit_never_arms():
    assert "slower" in Line(frequency_hz=1.0).running().tick(30).ready[1]


@pytest.mark.parametrize(("hertz", "silence_ms", "arms"), [(5.0, 200, False), (2.2, 500, False), (2.5, 500, True)])
def test_a_command_that_a_tick_may_delay_past_the_silence_limit_is_too_late(hertz, silence_ms, arms):
    """At 5 Hz and 200 ms the board stopped the thrusters several times a second, and nothing was said."""
    line = Line(frequency_hz=hertz, silence_ms=silence_ms).running().tick(40)
    assert line.ready[0] is arms


def test_one_hertz_with_a_long_silence_limit_is_allowed():
    line = Line(frequency_hz=1.0, silence_ms=2000).running().tick(30)
    assert wire.silence_word(2000) in b"".join(line.written)
    assert line.ready == (True, "")


def test_a_late_cycle_skips_what_is_past_and_counts_it():
    line = Line().running()
    line.now_us += 400_000
    line.written.clear()
    line.tick()
    assert line.written == [NEUTRAL]
    assert line.board.overruns == 8


def test_a_stale_output_is_neutral():
    line = Line().running()
    old = ActuatorOutput(line.now_us - 300_000, 1.0, 1.0, 0.0, 0.0, "demand")
    assert line.board.encode(old, line.now_us + 50_000) == NEUTRAL


def test_row_10_a_blocked_port_is_told_within_300_ms_and_nothing_is_queued():
    line = Line().running()
    line.accepts = 0
    line.thrust = 0.5
    line.tick(6)
    assert "blocked" in line.faults
    assert line.board.dropped == 6
    line.accepts = None
    line.thrust = 0.2
    line.written.clear()
    line.tick(2)
    assert line.written == [wire.encode_level1((1600, 1600, 1500, 1500))] * 2  # nothing old
    assert "blocked" not in line.faults


def test_a_cut_line_is_closed_before_the_next():
    line = Line().running()
    line.accepts = 7
    line.tick()
    line.accepts = None
    line.written.clear()
    line.tick(2)
    assert line.written == [b"\n" + NEUTRAL, NEUTRAL]


def test_a_cut_level_0_command_is_completed():
    line = Line(answers=False, level="0", sketch="fixed-block").open().tick(60)
    line.accepts = 7
    line.tick()
    line.accepts = None
    line.written.clear()
    line.tick(1)
    assert line.written == [b"500" + b"m1500M1500l1500L1500"]


def test_a_repair_that_was_not_taken_is_tried_again():
    line = Line(answers=False, level="0", sketch="fixed-block").open().tick(60)
    line.written.clear()
    for accepts in (7, 0, 2, None):
        line.accepts = accepts
        line.tick()
    assert b"".join(line.written) == b"m1500M1" + b"50" + b"0" + b"m1500M1500l1500L1500"
    checked = Line().running()
    checked.written.clear()
    for accepts in (7, 0, None):
        checked.accepts = accepts
        checked.tick()
    assert b"".join(checked.written) == NEUTRAL[:7] + b"\n" + NEUTRAL


def test_silence_is_told_within_350_ms():
    line = Line().running().tick(2)
    line.answers = False
    line.tick(7)
    assert line.faults == ("silent",)
    assert line.ready == (False, "actuator board is silent")


def test_a_board_that_falls_silent_again_and_again_is_told_now_and_then():
    """A board that answers each 0.4 s: a hundred critical texts in 40 s hid all others."""
    line = Line().running().tick(2)
    line.said()
    told = []
    for spell in range(104):
        line.answers = spell % 2 == 1
        line.tick(8 if spell % 2 == 0 else 4)
        told += [text for _, text in line.board.drain_texts()]
    assert told == ["Actuator board is silent", "Actuator board is silent: 50 times in 30 s"]
    line.answers = True
    line.tick(20 * 11)
    line.answers = False
    line.tick(8)
    assert line.said() == "Actuator board is silent"


def test_a_board_of_another_firmware_is_not_called_silent_nor_its_line_unreadable():
    line = Line().running().tick(2)
    line.said()
    line.answers = False
    for _ in range(40):
        line.board.receive(wire.checked("#S,C,1,20,10,0,1500,1500,1500,1500,B,0"), line.now_us)
        line.tick()
    other = "actuator board sends lines that this program does not know: other firmware?"
    assert line.ready == (False, other)
    said = line.said()
    assert "unreadable" not in said
    assert said.lower().endswith(other.lower())
    assert BoardWatch().step(line.board.status, line.faults, ready=False, armed=True).flags.actuator_lost


def test_the_echo_of_our_own_lines_is_no_other_firmware():
    line = Line(answers=False).open()
    for _ in range(100):
        line.tick()
        for data in line.written[-1:]:
            line.board.receive(data, line.now_us)
    assert line.faults == ("mute",)


def test_row_13_something_else_at_the_pins_is_told_within_400_ms():
    line = Line().running().tick(4)
    line.applied = (1700, 1500, 1500, 1500)
    line.tick(7)
    assert line.faults == ("mismatch",)
    line.applied = None
    line.tick(2)
    assert line.faults == ()


def test_a_command_on_its_way_is_no_mismatch():
    line = Line().running()
    history = []
    for step in range(60):
        line.thrust = (step % 10) / 10
        history.append(line.board.commanded_us)
        line.applied = history[-4] if len(history) > 4 else None  # 200 ms behind
        line.tick()
        assert line.faults == ()


def test_reset_is_told_and_answered_with_neutral():
    line = Line().running()
    line.thrust = 0.5
    line.tick(4)
    line.board.receive(wire.checked("#B,1,1.0,UNO,W"), line.now_us)
    assert "reset" in line.faults
    assert line.ready[0] is False
    line.written.clear()
    line.good = 0
    line.tick()
    assert line.written == [NEUTRAL + QUERY]
    assert "restarted (watchdog)" in line.said()


def test_a_reset_is_found_without_its_banner():
    line = Line().running().tick(4)
    line.board.receive(status("B", good=0, strict=0, cause="X"), line.now_us)
    assert "reset" in line.faults


def test_the_boards_own_stop_is_a_fault():
    line = Line().running().tick(2)
    line.state = "F"
    line.tick(2)
    assert line.faults == ("failsafe",)


def test_emergency_stop_and_voltage_are_passed_on():
    line = Line().running()
    line.board.receive(status("E", good=99, millivolts=12650), line.now_us)
    assert line.board.status.emergency_stop
    assert line.board.status.voltage_v == 12.65
    assert line.faults == ("estop",)


def test_interlock_is_not_ready():
    line = Line().running()
    line.state = "I"
    line.tick(2)
    assert line.ready == (False, "actuator board is in state interlock")


def test_row_16_wrong_baud_refuses_within_three_seconds_and_says_so():
    line = Line(answers=False).open()
    for _ in range(60):
        line.board.receive(bytes((0x80, 0xF3, 0x1C, 0xFE)), line.now_us)
        line.tick()
        assert line.ready[0] is False
    assert line.now_us == 3_000_000
    assert line.faults[0] == "baud"
    assert "wrong baud" in line.said()


def test_bad_lines_are_noise_then_garbage():
    line = Line().running().tick(40)
    for _ in range(4):
        line.board.receive(b"#S,broken*00\n", line.now_us)
        line.tick(4)
    assert line.faults == ("noise",)
    assert line.ready == (True, "")  # a warning, not a stop
    for _ in range(20):
        line.board.receive(b"x\ny\nz\nw\n", line.now_us)
        line.tick()
    assert "garbage" in line.faults
    assert line.ready[0] is False


def test_loss_of_the_port_forgets_everything():
    line = Line().running()
    line.board.closed(line.now_us)
    assert line.board.commanded_us is None
    assert line.board.status.connected is False
    assert "port lost" in line.said()
    line.written.clear()
    line.open().tick(5)
    assert line.written == []
