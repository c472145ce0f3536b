"""The attack list: forged, replayed, future-dated, unsigned, downgraded, replayed across links. None gets in, the genuine station stays."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import all as library

from mavlink_bridge.mavlink.wire import signing
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.mavlink.wire.signing import (
    SIGNED,
    TELEMETRY_ONLY,
    TRUSTED,
    FrameVerdict,
    Signer,
    SigningState,
    Verifier,
)

KEY = bytes(range(32))
NOW_UNITS = signing.units_from_utc(1_760_000_000_000_000)
ARM = dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 21196, 0, 0, 0, 0, 0)


class Station:
    """A ground station with its own key and clock."""

    def __init__(self, key=KEY, units=NOW_UNITS, link_id=1, system=255):
        self.state = SigningState(key, units)
        self.codec = Codec(system, 190, signer=Signer(self.state, link_id) if key else None)

    def frame(self, message=ARM):
        (frame,) = Deframer().receive(self.codec.encode(message), 0)
        return frame


@pytest.fixture
def vessel():
    return SigningState(KEY, NOW_UNITS)


def test_pymavlink_accepts_our_signature_and_we_accept_its(vessel):
    mav = library.MAVLink(None, 255, 190)
    mav.signing.secret_key, mav.signing.sign_outgoing, mav.signing.link_id = KEY, True, 3
    mav.signing.timestamp = NOW_UNITS + 5
    (theirs,) = Deframer().receive(library.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(mav), 0)
    assert Verifier(vessel, SIGNED).check(theirs, 0) is FrameVerdict.ACCEPTED
    reader = library.MAVLink(None)
    reader.signing.secret_key = KEY
    ours = Codec(1, 1, signer=Signer(vessel, 0)).encode(dialect.MAVLink_heartbeat_message(11, 3, 81, 0, 4, 3))
    assert reader.parse_buffer(ours)[0].get_signed()


def test_genuine_frames_are_accepted_in_order_and_each_once(vessel):
    station, verifier = Station(), Verifier(vessel, SIGNED)
    frames = [station.frame() for _ in range(20)]
    assert all(verifier.check(frame, 0) is FrameVerdict.ACCEPTED for frame in frames)
    assert all(verifier.check(frame, 0) is FrameVerdict.REPLAYED for frame in frames)


def test_row_47_a_forged_frame_changes_nothing(vessel):
    # pymavlink stored the time stamp first: one such frame locked the genuine station out until restart
    station, verifier = Station(), Verifier(vessel, SIGNED)
    assert verifier.check(station.frame(), 0).ok
    before = vessel.export()
    for units in (0, NOW_UNITS, (1 << 48) - 10):
        thief = Station(key=b"\xff" * 32, units=units)
        assert verifier.check(thief.frame(), 0) is FrameVerdict.FORGED
    assert vessel.export() == before
    assert verifier.check(station.frame(), 0) is FrameVerdict.ACCEPTED


def test_wrongly_signed_is_refused_even_where_unsigned_is_allowed(vessel):
    assert Verifier(vessel, TRUSTED).check(Station(key=b"\x01" * 32).frame(), 0) is FrameVerdict.FORGED
    assert Verifier(vessel, TRUSTED).check(Station(key=None).frame(), 0) is FrameVerdict.ACCEPTED_UNSIGNED


def test_row_49_unsigned_and_mavlink_1_frames_are_refused_on_a_signed_link(vessel):
    verifier = Verifier(vessel, SIGNED)
    assert verifier.check(Station(key=None).frame(), 0) is FrameVerdict.UNSIGNED
    old = library.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0).pack(
        library.MAVLink(None, 255, 190), force_mavlink1=True
    )
    (downgraded,) = Deframer().receive(old, 0)
    assert verifier.check(downgraded, 0) is FrameVerdict.UNSIGNED


def test_radio_status_alone_may_be_unsigned(vessel):
    radio = Station(key=None).frame(dialect.MAVLink_radio_status_message(1, 1, 1, 1, 1, 0, 0))
    assert Verifier(vessel, SIGNED).check(radio, 0) is FrameVerdict.ACCEPTED_UNSIGNED
    assert Verifier(vessel, TELEMETRY_ONLY).check(radio, 0) is FrameVerdict.CLOSED


def test_a_frame_heard_on_one_link_is_not_new_on_another(vessel):
    station = Station()
    frame = station.frame()
    assert Verifier(vessel, SIGNED).check(frame, 0) is FrameVerdict.ACCEPTED
    assert Verifier(vessel, SIGNED).check(frame, 0) is FrameVerdict.REPLAYED
    assert Verifier(vessel, TRUSTED).check(frame, 0) is FrameVerdict.REPLAYED


def test_what_the_vessel_signed_does_not_come_back_as_an_order(vessel):
    raw = Codec(1, 1, signer=Signer(vessel, 0)).encode(ARM)
    (echo,) = Deframer().receive(raw, 0)
    assert Verifier(vessel, SIGNED).check(echo, 0) is FrameVerdict.REPLAYED


def test_a_new_stream_may_be_one_minute_behind_and_no_more(vessel):
    verifier = Verifier(vessel, SIGNED)
    late = Station(units=NOW_UNITS - 59 * signing.UNITS_PER_S, system=250)
    too_late = Station(units=NOW_UNITS - 61 * signing.UNITS_PER_S, system=251)
    assert verifier.check(late.frame(), 0) is FrameVerdict.ACCEPTED
    assert verifier.check(too_late.frame(), 0) is FrameVerdict.TOO_OLD
    assert "system 251 are 61 s behind" in verifier.drain_texts()[0]


def test_thousands_of_forged_streams_fill_no_table(vessel):
    verifier = Verifier(vessel, SIGNED)
    for system in range(1, 200):
        for link_id in range(20):
            verifier.check(Station(key=b"\x07" * 32, link_id=link_id, system=system).frame(), 0)
    assert not vessel.streams
    assert len(verifier.drain_texts()) <= 4


def test_the_table_is_bounded_and_forgets_only_what_cannot_return(vessel):
    verifier = Verifier(vessel, SIGNED)
    first = Station(system=1)
    captured = first.frame()
    assert verifier.check(captured, 0).ok
    for system in range(2, 2 + signing.MAX_STREAMS - 1):
        assert verifier.check(Station(system=system).frame(), 0).ok
    assert verifier.check(Station(system=200).frame(), 0) is FrameVerdict.TABLE_FULL
    # two minutes later the old streams may go, and their captured frames are too old to come back
    later = Station(system=201, units=NOW_UNITS + 120 * signing.UNITS_PER_S)
    vessel.timestamp = NOW_UNITS + 120 * signing.UNITS_PER_S
    assert verifier.check(later.frame(), 0) is FrameVerdict.ACCEPTED
    assert len(vessel.streams) == signing.MAX_STREAMS
    assert not verifier.check(captured, 0).ok


def test_row_48_time_stamps_survive_a_restart_so_captured_frames_stay_refused(vessel):
    station = Station()
    captured = [station.frame() for _ in range(5)]
    assert all(Verifier(vessel, SIGNED).check(frame, 0).ok for frame in captured)
    restarted = SigningState(KEY)
    restarted.restore(vessel.export())
    verifier = Verifier(restarted, SIGNED)
    assert not any(verifier.check(frame, 0).ok for frame in captured)
    assert verifier.check(station.frame(), 0) is FrameVerdict.ACCEPTED


@pytest.mark.parametrize(
    "saved", [{}, {"timestamp": "x"}, {"timestamp": -1, "streams": 5}, {"streams": [[1, 2], None]}]
)
def test_a_damaged_store_is_ignored(saved):
    state = SigningState(KEY, 5)
    state.restore(saved)
    assert state.export() == {"timestamp": 5, "streams": []}


def test_the_clock_moves_the_time_stamp_forward_only(vessel):
    vessel.advance(0)
    assert vessel.timestamp == NOW_UNITS
    vessel.advance(1_760_000_100_000_000)
    assert vessel.timestamp == NOW_UNITS + 100 * signing.UNITS_PER_S


def test_operator_texts_are_rare(vessel):
    verifier = Verifier(vessel, SIGNED)
    for second in range(120):
        verifier.check(Station(key=None).frame(), second * 1_000_000)
    assert len(verifier.drain_texts()) == 2
    assert verifier.counters[FrameVerdict.UNSIGNED] == 120


@pytest.mark.parametrize(
    ("key", "verdict", "version", "armed", "radio", "word"),
    [
        (None, FrameVerdict.ACCEPTED_UNSIGNED, 2, False, False, "first key"),
        (KEY, FrameVerdict.ACCEPTED_UNSIGNED, 2, False, False, "old one"),
        (KEY, FrameVerdict.ACCEPTED, 1, False, False, "old one"),
        (KEY, FrameVerdict.ACCEPTED, 2, True, False, "armed"),
        (KEY, FrameVerdict.ACCEPTED, 2, False, True, "radio"),
        (KEY, FrameVerdict.ACCEPTED, 2, False, False, ""),
    ],
)
def test_keys_change_only_by_the_old_key_disarmed_and_not_over_a_radio(key, verdict, version, armed, radio, word):
    refusal = signing.setup_refusal(
        SigningState(key), verdict, key=b"\x01" * 32, version=version, armed=armed, radio=radio
    )
    assert (word in refusal) if word else refusal == ""
