"""One suite for every kind of link: whatever carries the bytes, the app sees the same behaviour.

Each kind brings a far end that speaks with the kernel directly. Device time is given; where a kernel must hand bytes
across, the suite polls until they are there.
"""

from __future__ import annotations

import os
import select
import socket
import time
import tty
from itertools import pairwise

import pytest

from companion.io.links.link import Closed, Opened, Received
from companion.io.links.mem import MemLink
from companion.io.links.table import SCHEMES, open_link
from tests.patience import PATIENCE_S, waits


class Far:
    """The other end of a link under test."""

    can_refill = True

    def send(self, data: bytes) -> None: ...
    def recv(self) -> bytes: ...
    def hang_up(self) -> None: ...
    def come_back(self) -> None: ...
    def close(self) -> None: ...


class SocketFar(Far):
    sock: socket.socket | None = None

    def send(self, data):
        self.sock.sendall(data)

    def recv(self):
        self.sock.setblocking(False)
        try:
            return self.sock.recv(65536)
        except BlockingIOError:
            return b""

    def hang_up(self):
        self.sock.close()

    def close(self):
        if self.sock:
            self.sock.close()


class TcpServerFar(SocketFar):
    """The link under test is a client."""

    def __init__(self, tmp_path):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.listener.settimeout(5)
        self.url = f"tcp://127.0.0.1:{self.listener.getsockname()[1]}"

    def come_back(self):
        self.sock, _ = self.listener.accept()

    def close(self):
        super().close()
        self.listener.close()


class TcpClientFar(SocketFar):
    """The link under test is a server."""

    def __init__(self, tmp_path):
        self.url = "tcp-listen://127.0.0.1:0"

    def come_back(self):
        self.sock = socket.create_connection(("127.0.0.1", self.link.port))


class UdpFar(SocketFar):
    """The link under test sends to us."""

    can_refill = False

    def __init__(self, tmp_path):
        self.sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sock.bind(("127.0.0.1", 0))
        self.url = f"udp://127.0.0.1:{self.sock.getsockname()[1]}"

    def send(self, data):
        self.sock.sendto(data, ("127.0.0.1", self.link_port()))

    def link_port(self):
        fileno = self.link.filenos()[0]
        with socket.socket(fileno=os.dup(fileno)) as twin:
            return twin.getsockname()[1]


class UdpListenFar(SocketFar):
    can_refill = False

    def __init__(self, tmp_path):
        self.url = "udp-listen://127.0.0.1:0"

    def come_back(self):
        self.sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sock.connect(("127.0.0.1", self.link.port))
        self.sock.send(b"hello")


class SerialFar(Far):
    """A pseudo-terminal's master; a stable name points at the slave."""

    def __init__(self, tmp_path):
        self.path = tmp_path / "by-id"
        self.master = -1
        self.url = f"serial:{self.path}?baud=9600&parity=E&stop=2"

    def send(self, data):
        os.write(self.master, data)

    def recv(self):
        os.set_blocking(self.master, False)
        try:
            return os.read(self.master, 65536)
        except OSError:
            return b""

    def come_back(self):
        self.master, slave = os.openpty()
        tty.setraw(slave)
        self.slave_name = os.ttyname(slave)
        self.keep = slave
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(self.slave_name)

    def hang_up(self):
        os.close(self.keep)
        os.close(self.master)
        self.master = -1

    def close(self):
        if self.master >= 0:
            self.hang_up()


class PtyFar(Far):
    """Another program that opens the device."""

    def __init__(self, tmp_path):
        self.path = tmp_path / "arduino"
        self.url = f"pty:{self.path}"
        self.fd = -1

    def come_back(self):
        self.fd = os.open(self.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def send(self, data):
        os.write(self.fd, data)

    def recv(self):
        try:
            return os.read(self.fd, 65536)
        except BlockingIOError:
            return b""

    def hang_up(self):
        os.close(self.fd)
        self.fd = -1

    def close(self):
        if self.fd >= 0:
            self.hang_up()


class MemFar(Far):
    def __init__(self, tmp_path):
        self.url = "mem:conformance"
        self.far: MemLink | None = None

    def come_back(self):
        if self.far is None:
            self.far = open_link("far", self.url)
        self.far.plug()
        self.far.poll(0)

    def send(self, data):
        assert self.far.write(0, data) == len(data)

    def recv(self):
        return b"".join(event.data for event in self.far.poll(0) if isinstance(event, Received))

    def hang_up(self):
        self.far.unplug()

    def close(self):
        if self.far:
            self.far.close()


KINDS = {
    "tcp": TcpServerFar,
    "tcp-listen": TcpClientFar,
    "udp": UdpFar,
    "udp-listen": UdpListenFar,
    "serial": SerialFar,
    "pty": PtyFar,
    "mem": MemFar,
}
ONE_WAY = {"file": "is read and written to no far end", "udp-broadcast": "is udp-listen's class, in a network"}
REOPENING = [kind for kind in KINDS if not kind.startswith("udp")]


class Bench:
    """A link, its far end and a device clock."""

    def __init__(self, kind: str, tmp_path):
        self.far = KINDS[kind](tmp_path)
        self.link = open_link("bench", self.far.url)
        self.far.link = self.link
        self.now_us = 0

    def poll_until(self, wanted, step_us: int = 50_000):
        """Poll with device time running until ``wanted(events)``; return every event since the call."""
        events = []
        deadline = time.monotonic() + PATIENCE_S
        while not wanted(events):
            assert time.monotonic() < deadline, f"never came; events {events}, {self.link.describe()}"
            self.now_us += step_us
            events += self.link.poll(self.now_us)
            time.sleep(0.001)
        return events

    def open(self) -> int:
        events = self.link.poll(self.now_us) if isinstance(self.far, TcpServerFar) else []
        self.far.come_back()
        if not any(isinstance(event, Opened) for event in events):
            events += self.poll_until(lambda seen: any(isinstance(event, Opened) for event in seen))
        if isinstance(self.far, UdpListenFar):
            events += self.poll_until(lambda seen: True)
        return next(event.channel for event in events if isinstance(event, Opened))

    def received(self, count: int) -> bytes:
        def enough(seen):
            return sum(len(event.data) for event in seen if isinstance(event, Received)) >= count

        return b"".join(event.data for event in self.poll_until(enough) if isinstance(event, Received))


@pytest.fixture
def bench(request, tmp_path):
    made = Bench(request.param, tmp_path)
    yield made
    made.link.close()
    made.far.close()


every_kind = pytest.mark.parametrize("bench", list(KINDS), indirect=True)
reopening = pytest.mark.parametrize("bench", REOPENING, indirect=True)


def test_every_kind_is_held_to_the_same_promises():
    assert set(KINDS) | set(ONE_WAY) == set(SCHEMES)


@every_kind
def test_opens_once_and_says_so(bench):
    bench.open()
    assert bench.link.describe()
    assert not any(isinstance(event, Opened) for event in bench.link.poll(bench.now_us + 1))


@every_kind
def test_bytes_arrive_unchanged_in_order_both_ways(bench):
    channel = bench.open()
    every_byte = bytes(range(256))
    bench.far.send(every_byte[:100])
    bench.far.send(every_byte[100:])
    assert bench.received(256) == every_byte
    assert bench.link.write(channel, every_byte) == 256
    got = b""
    deadline = time.monotonic() + PATIENCE_S
    while len(got) < 256 and time.monotonic() < deadline:
        got += bench.far.recv()
        time.sleep(0.001)
    assert got == every_byte


@every_kind
def test_an_idle_poll_is_empty_and_does_not_wait(bench):
    bench.open()
    bench.poll_until(lambda seen: bench.link.poll(bench.now_us) == [])
    before = waits()
    for _ in range(100):
        assert bench.link.poll(bench.now_us) == []
    assert waits() - before < 50


@every_kind
def test_a_strange_channel_takes_nothing(bench):
    bench.open()
    assert bench.link.write(99, b"x") == 0


@every_kind
def test_nothing_is_taken_before_the_channel_is_open_or_after_close(bench):
    assert bench.link.write(0, b"x") == 0
    bench.open()
    bench.link.close()
    bench.link.close()
    assert bench.link.write(0, b"x") == 0
    assert bench.link.poll(bench.now_us) == []
    assert bench.link.filenos() == []


@reopening
def test_a_far_end_that_goes_is_closed_with_a_reason_and_found_again(bench):
    channel = bench.open()
    for _ in range(3):
        bench.far.hang_up()
        events = bench.poll_until(lambda seen: any(isinstance(event, Closed) for event in seen))
        closed = next(event for event in events if isinstance(event, Closed))
        assert closed.channel == channel
        assert closed.reason
        assert bench.link.write(channel, b"x") == 0
        started_us = bench.now_us
        if isinstance(bench.far, TcpServerFar):
            bench.now_us += 2_000_000
        channel = bench.open()
        assert bench.now_us - started_us <= 2_100_000 + 50_000
        bench.far.send(b"again")
        assert bench.received(5) == b"again"


@reopening
def test_the_last_bytes_before_a_hang_up_arrive(bench):
    if bench.far.url.startswith(("serial", "mem")):
        pytest.skip("a pulled cable loses what was under way")
    bench.open()
    bench.far.send(b"last words")
    bench.far.hang_up()
    events = bench.poll_until(lambda seen: any(isinstance(event, Closed) for event in seen))
    assert b"".join(event.data for event in events if isinstance(event, Received)) == b"last words"
    assert isinstance(events[-1], Closed)


@every_kind
def test_a_reader_that_never_reads_does_not_make_writing_wait_or_grow(bench):
    channel = bench.open()
    block = bytes(1024)
    before = waits()
    taken = sum(bench.link.write(channel, block) for _ in range(4096))
    assert waits() - before < 2048
    if bench.far.can_refill:
        assert taken < 2 * 1024 * 1024


@pytest.mark.parametrize("bench", ["tcp", "tcp-listen", "udp", "udp-listen", "serial", "pty"], indirect=True)
def test_filenos_wake_a_select(bench):
    bench.open()
    bench.poll_until(lambda seen: not select.select(bench.link.filenos(), [], [], 0)[0])
    bench.far.send(b"wake")
    assert select.select(bench.link.filenos(), [], [], 5.0)[0]


@pytest.mark.parametrize("bench", ["tcp", "serial"], indirect=True)
def test_an_absent_device_is_tried_again_with_growing_pauses_for_ever(bench, monkeypatch):
    bench.far.close()
    attempts = []
    original = type(bench.link)._connect

    def counting(link, now_us):
        attempts.append(now_us)
        return original(link, now_us)

    monkeypatch.setattr(type(bench.link), "_connect", counting)
    for now_us in range(0, 60_000_000, 50_000):
        assert bench.link.poll(now_us) == []
    if bench.far.url.startswith("serial"):
        gaps = [later - earlier for earlier, later in pairwise(attempts)]
        assert gaps[:4] == [250_000, 500_000, 1_000_000, 2_000_000]
        assert set(gaps[4:]) == {2_000_000}
    assert "waiting" in bench.link.describe()
