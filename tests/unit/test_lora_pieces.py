"""Long messages that end half way: they hinder nobody, and leave nothing behind."""

from mavlink_bridge.language.requests import PlanKind
from mavlink_bridge.radio.codec.frames import Sealer
from mavlink_bridge.radio.codec.wire import Kind
from tools.benches.lora import settled, survey_items


def heard_of(rig, origin, kind):
    """How many frames of a kind got through."""
    return sum(
        item.origin == origin and item.fate == "received" and item.data[0] >> 4 == kind for item in rig.pair.air.log
    )


def test_a_message_given_up_half_way_does_not_silence_the_gateways_beacons():
    rig = settled()
    rig.vessel.plans.put(PlanKind.MISSION, survey_items(100))
    while heard_of(rig, "vessel", Kind.PIECE) < 3:
        rig.step()
    rig.pair.air.jammed = True
    rig.run(60.0)
    rig.pair.air.jammed = False
    rig.vessel.plans.put(PlanKind.MISSION, ())  # nothing more to be told: the rest never comes
    before = heard_of(rig, "shore", Kind.BEACON)
    rig.run(300.0)
    assert heard_of(rig, "shore", Kind.BEACON) - before >= 300.0 / rig.profile.link.beacon_s - 2
    assert rig.now_us - rig.radio.last_heartbeat_us <= 2.5e6 * rig.profile.link.beacon_s


def test_rows_of_a_message_given_up_do_not_mix_with_a_later_one_of_its_number():
    rig = settled()
    shore = rig.twin.link.pairing
    sealer = Sealer(shore)
    rig.pair.air.jammed = True

    def send(row, data):
        """One of two pieces of message 9, with a question for what has come."""
        rig.radio.receive(sealer.seal(Kind.PIECE, bytes((9, row, 0x81)) + data, rig.now_us, shore.current), rig.now_us)
        since_us = rig.now_us
        rig.run(2.0)
        return [
            item.data[3]
            for item in rig.pair.air.log
            if item.start_us >= since_us and item.origin == "vessel" and item.data[0] >> 4 == Kind.MISSING
        ]

    assert send(0, b"old rows") == [1]
    rig.run(rig.profile.link.upload_s + 5.0)
    assert send(1, b"new rows") == [1]
