"""Every telemetry message with every source of its values silenced on its wire: what the table says is what a station hears."""

from __future__ import annotations

import math
from functools import cache

import pytest

from companion.core.nmea.line import frame
from mavlink_bridge.mavlink.telemetry.ages import AGES, AHRS, Age, Told
from mavlink_bridge.mavlink.telemetry.streams import HEARTBEAT, STREAMED
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.world_station import Helm

RECEIVER = (b"ZDA", b"GGA", b"RMC", b"VTG")
SET_MESSAGE_INTERVAL = 511
NAMES = {number: dialect.mavlink_map[number].msgname for number in STREAMED}


class Wire:
    """The sensors' line and the board's, with scissors."""

    def __init__(self, helm: Helm) -> None:
        plant = helm.world.surroundings.plant
        self.cut: set[Told] = set()
        sensors, board = plant.sensors.step, plant.board.step
        plant.board.set_voltage(12.4)
        plant.sensors.step = lambda now_us, truth: self.sentences(sensors(now_us, truth))
        plant.board.step = lambda now_us: self.board(board(now_us))

    def sentences(self, sent: list[bytes]) -> list[bytes]:
        return [self.tilted(line) for line in sent if not self.dropped(line)]

    def dropped(self, line: bytes) -> bool:
        kind = line[3:6]
        return (
            (Told.RECEIVER in self.cut and kind in RECEIVER)
            or (Told.COMPASS in self.cut and kind == b"HDT")
            or (Told.SOUNDER in self.cut and kind == b"DPT")
            or (Told.TILT in self.cut and line.startswith(b"$PSXN"))
        )

    @staticmethod
    def tilted(line: bytes) -> bytes:
        """PSXN,23 without its heading: the roll and pitch sensor is a device of its own."""
        if not line.startswith(b"$PSXN"):
            return line
        fields = line.split(b"*")[0][1:].decode().split(",")
        return frame(f"PSXN,23,{5.0 + float(fields[2]):.2f},{-3.0 + float(fields[3]):.2f},,")

    def board(self, said: bytes) -> bytes:
        return b"" if Told.BOARD in self.cut else said


def asked_for_everything(*overrides: str) -> Helm:
    helm = Helm("ardurover", "world.sensors.attitude_sentence=PSXN", "operator.gcs_required=false", *overrides)
    helm.wire = Wire(helm)
    for number in sorted(STREAMED - {HEARTBEAT}):
        assert helm.command(SET_MESSAGE_INTERVAL, number, 500_000.0) == 0
    return helm


def heard(helm: Helm, seconds: float = 2.0) -> dict[str, object]:
    """The last message of each kind in a time."""
    helm.gcs.inbox.clear()
    helm.run(seconds)
    return {message.get_type(): message for message in helm.gcs.inbox}


@cache
def before_and_after(source: Told) -> tuple[dict[str, object], dict[str, object]]:
    """All messages of a vessel that knows everything, and 7 s after one source fell silent."""
    helm = asked_for_everything()
    helm.run(8.0)
    before = heard(helm)
    helm.wire.cut.add(source)
    helm.run(7.0)
    return before, heard(helm)


def is_as(found: object, expected: object) -> bool:
    if isinstance(expected, tuple):
        return tuple(found) == expected  # type: ignore[arg-type]
    if math.isnan(expected):  # type: ignore[arg-type]
        return math.isnan(found)  # type: ignore[arg-type]
    return found == expected


def test_every_message_has_a_row() -> None:
    assert {age.message for age in AGES} == set(NAMES.values())


@pytest.mark.parametrize(
    "age", [age for age in AGES if age.source is not Told.OWN], ids=lambda a: f"{a.message}-{a.source.name}"
)
def test_a_silent_source_is_told(age: Age) -> None:
    before, after = before_and_after(age.source)
    if age.ceases:
        assert age.message not in after
        return
    message = after[age.message]
    for field, expected in age.says.items():
        if field == "failure_flags":
            assert message.failure_flags & expected
            assert not before[age.message].failure_flags & expected
        else:
            assert is_as(getattr(message, field), expected), field
            unaware = field in (
                "alt",
                "h_acc",
                "v_acc",
                "epv",
                "eph",
                "wp_dist",
                "xtrack_error",
                "heading",
                "current_battery",
            )
            unaware |= field in ("battery_remaining", "battery")
            assert unaware or not is_as(getattr(before[age.message], field), expected), field
    health = after["SYS_STATUS"].onboard_control_sensors_health
    assert health & age.unhealthy == 0
    assert before["SYS_STATUS"].onboard_control_sensors_health & age.unhealthy == age.unhealthy


@pytest.mark.parametrize("source", [source for source in Told if source is not Told.OWN])
def test_what_a_silent_source_has_no_part_in_is_still_told(source: Told) -> None:
    """A row that ceases is in the table, and nothing else ceases."""
    before, after = before_and_after(source)
    gone = {name for name in before if name not in after and name in NAMES.values()}
    assert gone <= {age.message for age in AGES if age.ceases and age.source is source}


def test_a_source_that_is_back_is_told_again() -> None:
    helm = asked_for_everything()
    helm.run(8.0)
    before = heard(helm)
    helm.wire.cut.update(Told)
    helm.run(8.0)
    helm.wire.cut.clear()
    helm.run(12.0)
    after = heard(helm)
    assert {name for name in before if name in NAMES.values()} <= set(after)
    assert after["GPS_RAW_INT"].fix_type == before["GPS_RAW_INT"].fix_type == 6
    health = after["SYS_STATUS"].onboard_control_sensors_health
    assert health == before["SYS_STATUS"].onboard_control_sensors_health


def test_a_vessel_without_a_roll_and_pitch_sensor_claims_no_ahrs() -> None:
    helm = Helm("ardurover")
    helm.run(5.0)
    status = heard(helm)["SYS_STATUS"]
    assert not status.onboard_control_sensors_present & AHRS
    assert not status.onboard_control_sensors_health & AHRS
