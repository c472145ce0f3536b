"""Parameters out of a telemetry log, when the station fetched them as one file by MAVLink FTP."""

from __future__ import annotations

import struct

import pytest

from companion.cli import main
from companion.commands.plan.params import unpack
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import Bench
from tests.ftp_client import FtpClient


class Tapped:
    """An endpoint whose frames are logged, both ways."""

    def __init__(self, endpoint):
        self.endpoint, self.log = endpoint, b""

    def __getattr__(self, name):
        return getattr(self.endpoint, name)

    def receive(self, data, now_us):
        self.log += tlog.pack_output(10**15 + now_us, 0, data)
        return self.endpoint.receive(data, now_us)

    def take(self, now_us, size):
        data = self.endpoint.take(now_us, size)
        self.log += tlog.pack_output(10**15 + now_us, 0, data)
        return data


@pytest.fixture
def bench():
    made = Bench("ardurover")
    made.endpoint = Tapped(made.endpoint)
    made.tick()
    return made


def extracted(log, tmp_path):
    (tmp_path / "f.tlog").write_bytes(log)
    assert main(["plan", "extract", str(tmp_path / "f.tlog"), str(tmp_path / "f.params")]) == 0
    lines = (tmp_path / "f.params").read_text().splitlines()
    assert lines[0] == "# Vehicle-Id Component-Id Name Value Type"
    return lines[1:]


@pytest.mark.parametrize("query", ["", "?withdefaults=1"])
def test_a_file_of_parameters_gives_what_one_by_one_gives(bench, query, tmp_path, capsys):
    FtpClient(bench).download(f"@PARAM/param.pck{query}")
    fetched, bench.endpoint.log = bench.endpoint.log, b""
    bench.send(dialect.MAVLink_param_request_list_message(1, 1))
    bench.tick(200)
    assert extracted(fetched, tmp_path) == extracted(bench.endpoint.log, tmp_path)
    assert "parameters" in capsys.readouterr().out


def test_half_a_file_and_another_file_give_none(bench, tmp_path, capsys):
    client = FtpClient(bench)
    session, _ = client.open("@PARAM/param.pck")
    client.ask(5, session=session, offset=0, size=239)
    client.ask(1, session=session)
    client.download("general.json")
    (tmp_path / "f.tlog").write_bytes(bench.endpoint.log)
    assert main(["plan", "extract", str(tmp_path / "f.tlog"), str(tmp_path / "f.params")]) == 1
    assert "no vehicle told its parameters in this log, and no station fetched them whole" in capsys.readouterr().err
    assert not (tmp_path / "f.params").exists()


def test_whole_numbers_keep_their_types():
    data = struct.pack("<HHH", 0x671B, 2, 2) + b"\x01\x20abc\xff" + b"\0" + b"\x03\x11de\x40\x42\x0f\0"
    assert unpack(data) == {"abc": (-1.0, 2), "ade": (1_000_000.0, 6)}
    assert unpack(data[:-1]) is None
    assert unpack(b"") is None
    assert unpack(b"\0" * 40) is None
