"""The companion on four common old sketches, on the chip: with the sketch named, every command arrives; and consent is asked.

Row 17 of the fault matrix, and the table of firmware-reliability §A.4 turned round: the picker's choice always works.
"""

from __future__ import annotations

import pytest

from companion.core.board import wire
from companion.core.board.actuator_map import ActuatorConfig
from sitl.board.avr import BUILD, AvrArduino
from tools.benches.cells.actuator_bench import ActuatorBench

STYLES = ("parse-int", "read-line", "fixed-block", "next-byte")


@pytest.fixture(params=STYLES)
def sketch(avr_build, request):
    avr_build("level0", "sim")
    chip = AvrArduino("uno", elf=BUILD / f"level0-{request.param}.elf")
    yield request.param, chip
    chip.close()


def started(style, chip, *, seen=False, **config):
    bench = ActuatorBench(chip, ActuatorConfig(sketch=style, **config), seen=seen)
    bench.run(4.2)  # no banner: 2.5 s, then a second for an answer
    return bench


@pytest.mark.parametrize(
    ("level", "says"),
    [("auto", "does not answer"), ("1", "does not answer"), ("0", "does not stop if this computer dies")],
)
def test_needs_the_owners_choice_and_a_person_who_saw_it_move(sketch, level, says):
    bench = started(*sketch, level=level)
    bench.thrust = 1.0
    bench.run(1.0)
    assert bench.companion.ready(bench.now_us)[0] is False
    assert bench.stopped()
    assert any(says in text for text in bench.texts)


def test_every_command_reaches_all_four_pins_within_a_tick(sketch):
    """The last one too: suppression of unchanged values would lose the final neutral for ever."""
    bench = started(*sketch, level="0", seen=True)
    for step in range(20):
        bench.thrust = (step % 5 - 2) * 0.4
        bench.rudder_rad = (step % 3 - 1) * 0.3
        bench.run(0.05)
        wanted = bench.companion.commanded_us
        bench.run(0.05)
        assert bench.board.pulses_us == pytest.approx(wanted, abs=10)
    bench.thrust = 0.6
    bench.run(0.5)
    bench.thrust = 0.0
    assert bench.until(bench.stopped, 0.2) is not None


def test_a_checked_single_line_is_understood_by_all_but_block_readers(sketch):
    style, chip = sketch
    chip.step(0)
    chip.step(100_000)
    chip.receive(wire.encode_level1((1600, 1601, 1602, 1603), batch=False), 100_000)
    chip.step(400_000)
    if style != "fixed-block":
        assert chip.pulses_us == pytest.approx((1600, 1601, 1602, 1603), abs=8)
