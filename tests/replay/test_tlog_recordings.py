"""Logs recorded by others: every message that pymavlink finds is found, damage and all."""

from __future__ import annotations

import math
from collections import Counter

import pytest

from companion.cli import main
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.mavlink.wire.signing import Signer, SigningState

# file: messages, MAVLink version, seconds, vehicle heartbeats (counted by pymavlink, data/mavlink/README.md)
LOGS = {
    "ardusub_qgc_2023-05-04.tlog": (35_912, 2, 263, 263),
    "crawler_real_type10_generic_82s.tlog": (2_347, 2, 82, 76),
    "dronekit_copter_mav1_radio.tlog": (75_477, 1, 1_377, 1_047),
    "robosub_real_mav2.tlog": (10_071, 2, 70, 72),
    "vtol_plane_sitl_mav1.tlog": (23_894, 1, 208, 199),
}


@pytest.mark.parametrize("name", LOGS)
def test_every_message_of_a_recorded_log_is_read(shared_data, name):
    count, version, seconds, beats = LOGS[name]
    records = list(tlog.iterate((shared_data / "mavlink" / name).read_bytes()))
    assert len(records) == count
    assert {record.frame.version for record in records} == {version}
    assert (records[-1].t_us - records[0].t_us) / 1e6 == pytest.approx(seconds, abs=1.0)
    kinds = Counter(
        record.frame.message_id for record in records if (record.frame.system, record.frame.component) == (1, 1)
    )
    assert kinds[dialect.MAVLINK_MSG_ID_HEARTBEAT] == beats
    assert all(decode(record.frame) is not None for record in records[:: max(1, count // 2_000)])


@pytest.mark.parametrize("name", ["crawler_real_type10_generic_82s.tlog", "robosub_real_mav2.tlog"])
def test_fields_have_the_values_that_pymavlink_reads(shared_data, name):
    records = list(tlog.iterate((shared_data / "mavlink" / name).read_bytes()))
    reader = dialect.MAVLink(None)
    reader.robust_parsing = True
    theirs = reader.parse_buffer(b"".join(record.frame.raw for record in records))
    assert len(theirs) == len(records)
    for record, message in zip(records, theirs, strict=True):
        ours = decode(record.frame).to_dict()  # knows more extension fields
        assert repr({name: ours[name] for name in message.to_dict()}) == repr(message.to_dict())


PARAMS = {"ardusub_qgc_2023-05-04": 887, "crawler_real_type10_generic_82s": 4, "dronekit_copter_mav1_radio": 491}
PARAMS |= {"robosub_real_mav2": 885, "vtol_plane_sitl_mav1": 1053}


@pytest.mark.parametrize("name", PARAMS)
def test_parameters_are_taken_out_of_a_log(shared_data, tmp_path, name):
    """As many as the vehicle says that it has (PARAM_VALUE.param_count), but the crawler's, whose log has four of 120."""
    out = tmp_path / "out.params"
    assert main(["plan", "extract", str(shared_data / "mavlink" / f"{name}.tlog"), str(out)]) == 0
    lines = [line.split("\t") for line in out.read_text().splitlines()[1:]]
    assert len({line[2] for line in lines}) == PARAMS[name]
    assert all(len(line) == 5 and math.isfinite(float(line[3])) for line in lines)


@pytest.mark.parametrize("name", LOGS)
def test_the_deframer_finds_the_same_frames_between_the_stamps(shared_data, name):
    data = (shared_data / "mavlink" / name).read_bytes()
    deframer = Deframer()
    frames = [frame for at in range(0, len(data), 1_000) for frame in deframer.receive(data[at : at + 1_000], 0)]
    frames += deframer.receive(b"", 10_000_000)
    assert len(frames) == LOGS[name][0]


def test_a_raw_stream_without_stamps_is_read(shared_data):
    deframer = Deframer()
    data = (shared_data / "mavlink" / "crawler_real_type10_generic_82s.raw").read_bytes()
    assert len(deframer.receive(data, 0)) == 1_435
    assert deframer.counters.skipped_bytes == 0


def test_what_is_packed_is_read_back_with_its_link():
    codec = Codec(1, 1)
    raws = [codec.encode(dialect.MAVLink_heartbeat_message(11, 3, 81, 0, 4, 3)) for _ in range(4)]
    stamp = 1_655_288_676_000_000
    log = b"".join(tlog.pack(stamp + 50_000 * place, place, raw) for place, raw in enumerate(raws))
    records = list(tlog.iterate(log))
    assert [(record.t_us, record.link, record.frame.raw) for record in records] == [
        (stamp + 50_000 * place, place, raw) for place, raw in enumerate(raws)
    ]


def test_signatures_do_not_get_into_a_log():
    codec = Codec(1, 1, signer=Signer(SigningState(bytes(32)), 1))
    raw = codec.encode(dialect.MAVLink_heartbeat_message(11, 3, 81, 7, 4, 3))
    (record,) = tlog.iterate(tlog.pack(0, 0, raw))
    assert not record.frame.signed
    assert raw[-6:] not in record.frame.raw
    assert decode(record.frame).custom_mode == 7


def test_a_log_cut_anywhere_gives_the_records_before_the_cut():
    codec = Codec(1, 1)
    log = b"".join(
        tlog.pack(1_000_000 * place, 0, codec.encode(dialect.MAVLink_heartbeat_message(11, 3, 81, 0, 4, 3)))
        for place in range(3)
    )
    size = len(log) // 3
    for length in range(len(log)):
        assert len(list(tlog.iterate(log[:length]))) == length // size
        assert len(list(tlog.iterate(log[length:]))) >= 3 - -(-length // size)
