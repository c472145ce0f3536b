"""MAVLink FTP (checks 60 to 62)."""

import random
import struct

import pytest

from mavlink_bridge.mavlink.files.ftp import MAX_SESSIONS, crc32
from tests.ftp_client import ACK, BURST, CRC, LIST, NAK, OPEN, READ, RESET, TERMINATE, FtpClient


@pytest.mark.parametrize(
    "path", ["@PARAM/none.pck", "/etc/passwd", "../../etc/passwd", "..", "", "a" * 239, "@SYS/threads.txt", "\xff\xfe"]
)
def test_check_60_unknown_files(bench, path):
    client = FtpClient(bench)
    (reply,) = client.ask(OPEN, path.encode("latin-1"), session=7, sequence=41)
    assert (reply.op, reply.size, reply.data[0]) == (NAK, 1, 10)
    assert (reply.session, reply.req_op, reply.sequence) == (7, OPEN, 42)
    assert reply.target == (255, 190)


def test_check_61_the_same_request_gets_the_same_bytes(bench):
    client = FtpClient(bench)
    (first,) = client.ask(OPEN, b"general.json", sequence=9)
    (again,) = client.ask(OPEN, b"general.json", sequence=9)
    assert first.raw == again.raw
    (part,) = client.ask(READ, session=first.session, size=20, sequence=11)
    (copy,) = client.ask(READ, session=first.session, size=20, sequence=11)
    assert part.raw == copy.raw


def test_check_61_lost_terminates_do_not_lock_anybody_out(bench):
    client = FtpClient(bench)
    for _ in range(3 * MAX_SESSIONS):
        assert client.open("general.json") is not None
    (reply,) = client.ask(RESET)
    assert reply.op == ACK
    (reply,) = client.ask(RESET)
    assert reply.op == ACK
    assert client.open("general.json") is not None


def test_check_60_a_session_that_the_station_names_is_kept(bench):
    """MAVProxy names its session when it opens and ignores replies that carry another."""
    client = FtpClient(bench)
    (reply,) = client.ask(OPEN, b"@PARAM/param.pck?withdefaults=1", session=45)
    assert (reply.op, reply.session) == (ACK, 45)
    (part,) = client.ask(READ, session=45, size=30)
    assert part.op == ACK
    other = FtpClient(bench).open("general.json")
    assert other is not None
    assert other[0] != 45


def test_check_61_sessions_end(bench):
    client = FtpClient(bench)
    session, size = client.open("parameters.json")
    assert size > 239
    (reply,) = client.ask(TERMINATE, session=session)
    assert reply.op == ACK
    (reply,) = client.ask(READ, session=session, size=10)
    assert (reply.op, reply.data[0]) == (NAK, 4)


@pytest.mark.parametrize("seed", range(5))
def test_check_62_a_burst_with_losses_comes_whole(bench, seed):
    dice = random.Random(seed)
    client = FtpClient(
        bench, lose=lambda reply: reply.op == ACK and reply.req_op in (READ, BURST) and dice.random() < 0.05
    )
    data = client.download("parameters.json")
    (reply,) = client.ask(CRC, b"parameters.json")
    assert struct.unpack("<I", reply.data)[0] == crc32(data)


def test_check_62_reading_past_the_end(bench):
    client = FtpClient(bench)
    session, size = client.open("general.json")
    for op in (READ, BURST):
        for offset in (size, size + 1, 2**32 - 1):
            (reply,) = client.ask(op, session=session, offset=offset, size=239)
            assert (reply.op, reply.data[0]) == (NAK, 6)
    (reply,) = client.ask(READ, session=session, size=0)
    assert reply.op == ACK


@pytest.mark.parametrize("op", [6, 7, 8, 9, 10, 11, 12, 13])
def test_check_62_nothing_can_be_written(bench, op):
    (reply,) = FtpClient(bench).ask(op, b"general.json")
    assert (reply.op, reply.data[0]) == (NAK, 9)


@pytest.mark.parametrize(("op", "size", "error"), [(99, 0, 7), (OPEN, 255, 3), (READ, 240, 3)])
def test_check_62_nonsense_is_refused(bench, op, size, error):
    (reply,) = FtpClient(bench).ask(op, b"", size=size)
    assert (reply.op, reply.data[0]) == (NAK, error)


def test_the_folder_can_be_listed(bench):
    client = FtpClient(bench)
    (reply,) = client.ask(LIST, b"/")
    assert b"Fgeneral.json\t" in reply.data
    assert b"D@PARAM" in reply.data
    (reply,) = client.ask(LIST, b"/", offset=50)
    assert (reply.op, reply.data[0]) == (NAK, 6)
