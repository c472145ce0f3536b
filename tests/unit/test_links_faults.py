"""What goes wrong on links: the rows of the fault matrix that a link answers for. Device time is given, not waited for."""

from __future__ import annotations

import fcntl
import os
import resource
import select
import socket
import subprocess
import sys
import threading
import time
import tty
from pathlib import Path

import pytest

from companion.io.links.link import Closed, Opened, Received
from companion.io.links.mem import pair
from companion.io.links.table import open_link
from companion.io.links.tcp import MAX_CLIENTS
from companion.io.links.udp import MAX_PEERS
from tests.patience import PATIENCE_S, waits


def poll_until(link, wanted, now_us=0, step_us=10_000):
    """Poll until ``wanted(event)`` is true of some event; return (all events, device time)."""
    events = []
    deadline = time.monotonic() + PATIENCE_S
    while not any(wanted(event) for event in events):
        assert time.monotonic() < deadline, events
        now_us += step_us
        events += link.poll(now_us)
        time.sleep(0.001)
    return events, now_us


def is_a(kind):
    return lambda event: isinstance(event, kind)


@pytest.fixture
def server():
    link = open_link("server", "tcp-listen://127.0.0.1:0")
    yield link
    link.close()


def connect(link):
    client = socket.create_connection(("127.0.0.1", link.port), timeout=5)
    events, _ = poll_until(link, is_a(Opened))
    return client, events[-1].channel


def test_row_45_a_client_that_does_not_read_is_closed_at_its_size_limit_and_others_go_on(server):
    slow, slow_channel = connect(server)
    good, good_channel = connect(server)
    block = bytes(4096)
    taken = 0
    while server.write(slow_channel, block):
        taken += len(block)
        assert taken < 8 * 1024 * 1024
    assert server.write(good_channel, b"served") == 6
    events, _ = poll_until(server, is_a(Closed))
    assert [event.channel for event in events] == [slow_channel]
    assert "slowly" in events[0].reason
    assert good.recv(100) == b"served"
    slow.close()
    good.close()


def test_row_45_a_client_that_does_not_read_is_closed_after_two_seconds(server):
    slow = socket.socket()
    slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    slow.connect(("127.0.0.1", server.port))
    events, _ = poll_until(server, is_a(Opened))
    assert server.write(events[-1].channel, bytes(250 * 1024)) == 250 * 1024
    now_us = 0
    closed_at = None
    while closed_at is None and now_us < 10_000_000:
        now_us += 50_000
        if any(isinstance(event, Closed) for event in server.poll(now_us)):
            closed_at = now_us
    assert closed_at is not None
    assert 2_000_000 <= closed_at <= 2_200_000
    slow.close()


def test_row_46_two_hundred_connects_leave_sixteen_and_no_leak(server):
    before = len(open_descriptors())
    clients = [socket.create_connection(("127.0.0.1", server.port), timeout=5) for _ in range(1)]
    events = []
    for number in range(199):
        clients.append(socket.create_connection(("127.0.0.1", server.port), timeout=5))
        events += server.poll(number)
    deadline = time.monotonic() + PATIENCE_S
    while server.refused + MAX_CLIENTS < 200 and time.monotonic() < deadline:
        events += server.poll(1000)
    assert sum(isinstance(event, Opened) for event in events) == MAX_CLIENTS
    for client in clients:
        client.close()
    poll_until(server, lambda event: len(open_descriptors()) == before)
    assert len(open_descriptors()) == before


def open_descriptors():
    return [int(path.name) for path in Path("/proc/self/fd").iterdir()]


def try_dup():
    try:
        return os.dup(0)
    except OSError:
        return -1


def test_row_7_out_of_descriptors_keeps_what_works_and_pauses_accepting(server):
    good, channel = connect(server)
    extra = socket.socket()
    extra.settimeout(5)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    used = max(open_descriptors()) + 1
    hoard = []
    try:
        extra.connect(("127.0.0.1", server.port))
        resource.setrlimit(resource.RLIMIT_NOFILE, (used + 2, hard))
        while (fd := try_dup()) >= 0:
            hoard.append(fd)
        assert server.poll(1_000_000) == []
        assert select.select(server.filenos(), [], [], 0)[0] == []
        good.sendall(b"still here")
        deadline = time.monotonic() + PATIENCE_S
        events = []
        while not events and time.monotonic() < deadline:
            events = server.poll(1_100_000)
        assert events == [Received(channel, b"still here")]
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        for fd in hoard:
            os.close(fd)
    assert server.poll(1_900_000) == []
    assert isinstance(server.poll(2_100_000)[0], Opened)
    extra.close()
    good.close()


def test_row_28_a_restarted_server_is_found_again_within_two_seconds():
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    link = open_link("nmea", f"tcp://127.0.0.1:{port}")
    _, now_us = poll_until(link, is_a(Opened))
    server_side, _ = listener.accept()
    listener.close()
    server_side.close()
    _, now_us = poll_until(link, is_a(Closed), now_us)
    for _ in range(200):
        now_us += 50_000
        assert link.poll(now_us) == []
    listener = socket.create_server(("127.0.0.1", port))
    back_at = now_us
    _, now_us = poll_until(link, is_a(Opened), now_us, step_us=50_000)
    assert now_us - back_at <= 2_100_000
    link.close()
    listener.close()


def test_row_29_a_server_that_accepts_and_stays_silent_is_left_and_tried_again():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        link = open_link("nmea", f"tcp://127.0.0.1:{listener.getsockname()[1]}", silence=5)
        _, opened_us = poll_until(link, is_a(Opened))
        events, closed_us = poll_until(link, is_a(Closed), opened_us, step_us=50_000)
        assert 5_000_000 <= closed_us - opened_us <= 5_200_000
        assert "silent" in events[-1].reason
        _, again_us = poll_until(link, is_a(Opened), closed_us, step_us=50_000)
        assert again_us - closed_us <= 2_000_000
        link.close()


def make_device(path):
    """A pty whose slave appears under ``path``; return (master, slave)."""
    master, slave = os.openpty()
    tty.setraw(slave)
    temporary = path.with_name("new")
    temporary.symlink_to(os.ttyname(slave))
    temporary.replace(path)
    return master, slave


def test_row_8_a_vanished_device_is_noticed_at_the_next_poll(tmp_path):
    path = tmp_path / "arduino"
    master, slave = make_device(path)
    link = open_link("arduino", str(path))
    assert isinstance(link.poll(0)[0], Opened)
    os.close(slave)
    os.close(master)
    assert isinstance(link.poll(50_000)[0], Closed)
    assert link.write(0, b"x") == 0


def test_row_9_a_device_that_comes_back_under_another_name_is_found(tmp_path):
    path = tmp_path / "by-id"
    first = make_device(path)
    link = open_link("arduino", str(path))
    _, now_us = poll_until(link, is_a(Opened))
    second = make_device(path)
    replaced_us = now_us
    events, now_us = poll_until(link, is_a(Opened), now_us, step_us=50_000)
    assert now_us - replaced_us <= 2_000_000
    assert any("another device" in event.reason for event in events if isinstance(event, Closed))
    os.write(second[0], b"new")
    events, _ = poll_until(link, is_a(Received), now_us)
    assert events[-1].data == b"new"
    link.close()
    for fd in (*first, *second):
        os.close(fd)


def test_row_9_a_device_that_appears_after_long_absence_is_opened_at_once(tmp_path):
    path = tmp_path / "by-id"
    link = open_link("arduino", str(path))
    for now_us in range(0, 600_000_000, 50_000):
        assert link.poll(now_us) == []
    fds = make_device(path)
    assert isinstance(link.poll(600_000_000)[0], Opened)
    link.close()
    for fd in fds:
        os.close(fd)


def test_row_10_a_blocked_peer_never_blocks_a_write(tmp_path):
    path = tmp_path / "arduino"
    fds = make_device(path)
    link = open_link("arduino", str(path))
    link.poll(0)
    before = waits()
    taken = [link.write(0, bytes(100)) for _ in range(1000)]
    assert waits() - before < 500
    # the kernel hands on some of what it holds when it likes: the last write may find room again
    assert 0 in taken
    assert sum(taken) < 72 * 1024, "a pty's 64 KiB, and what its other end has before it is read"
    link.close()
    for fd in fds:
        os.close(fd)


def test_row_18_a_port_in_use_names_its_holder_and_is_not_fought_over(tmp_path):
    path = tmp_path / "arduino"
    fds = make_device(path)
    holder = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import fcntl,os,sys,time;fd=os.open(sys.argv[1],os.O_RDWR|os.O_NOCTTY);fcntl.flock(fd,fcntl.LOCK_EX);"
            "print('held',flush=True);time.sleep(60)",
            str(path),
        ],
        stdout=subprocess.PIPE,
    )
    try:
        assert holder.stdout.readline() == b"held\n"
        link = open_link("arduino", str(path))
        assert link.poll(0) == []
        assert f"in use by process {holder.pid}" in link.describe()
    finally:
        holder.kill()
        holder.wait()
        holder.stdout.close()
    poll_until(link, is_a(Opened), step_us=250_000)
    probe = os.open(path, os.O_RDWR | os.O_NOCTTY)
    with pytest.raises(BlockingIOError):
        fcntl.flock(probe, fcntl.LOCK_EX | fcntl.LOCK_NB)
    link.close()
    for fd in (probe, *fds):
        os.close(fd)


@pytest.fixture
def listening():
    link = open_link("gcs", "udp-listen://127.0.0.1:0")
    yield link
    link.close()


def udp_peer(port):
    peer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    peer.connect(("127.0.0.1", port))
    peer.settimeout(5)
    return peer


def test_every_udp_sender_is_answered_where_it_came_from(listening):
    peers = [udp_peer(listening.port) for _ in range(3)]
    for number, peer in enumerate(peers):
        peer.send(bytes([number]))
        events, _ = poll_until(listening, is_a(Received))
        assert listening.write(events[-1].channel, b"re" + events[-1].data) == 3
    for number, peer in enumerate(peers):
        assert peer.recv(100) == b"re" + bytes([number])
        peer.close()


def test_each_datagram_is_one_event(listening):
    peer = udp_peer(listening.port)
    for size in (1, 1400, 280):
        peer.send(bytes(size))
    time.sleep(0.01)
    events, _ = poll_until(listening, is_a(Received))
    events += listening.poll(1)
    assert [len(event.data) for event in events if isinstance(event, Received)] == [1, 1400, 280]
    peer.close()


def test_the_peer_table_is_bounded_and_idle_peers_make_room(listening):
    peers = [udp_peer(listening.port) for _ in range(MAX_PEERS + 4)]
    events = []
    for number, peer in enumerate(peers):
        peer.send(b"x")
        select.select(listening.filenos(), [], [], 5)
        events += listening.poll(number)
    assert sum(isinstance(event, Opened) for event in events) == MAX_PEERS
    assert listening.dropped == 4
    peers[0].send(b"x")
    select.select(listening.filenos(), [], [], 5)
    assert [type(event) for event in listening.poll(20_000_000)] == [Received]
    peers[-1].send(b"x")
    select.select(listening.filenos(), [], [], 5)
    assert [type(event) for event in listening.poll(20_000_001)] == [Closed, Opened, Received]
    kinds = [type(event) for event in listening.poll(100_000_000)]
    assert kinds == [Closed] * MAX_PEERS
    for peer in peers:
        peer.close()


def test_row_44_a_flooding_source_is_muted_and_the_others_are_served(listening):
    """10 000 datagrams/s for two seconds of device time, one poll a millisecond, as the loop's pumps would."""
    flooder, station = udp_peer(listening.port), udp_peer(listening.port)
    passed, heard = 0, 0
    channels = {}
    for ms in range(2000):
        for _ in range(10):
            flooder.send(b"flood")
        if ms % 100 == 0:
            station.send(b"heartbeat")
        for event in listening.poll(ms * 1000):
            if isinstance(event, Received):
                channels[event.data] = event.channel
                passed += event.data == b"flood"
                heard += event.data == b"heartbeat"
    assert heard == 20
    assert passed < 6000
    assert listening.dropped > 12_000
    events = []
    for _ in range(20):
        events += listening.poll(3_000_000)
    assert not any(isinstance(event, Received) for event in events)
    flooder.send(b"quiet again")
    select.select(listening.filenos(), [], [], 5)
    assert Received(channels[b"flood"], b"quiet again") in listening.poll(8_000_000)
    flooder.close()
    station.close()


def test_a_fixed_udp_peer_is_open_from_the_start_and_nobody_else_is_heard():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
        station.bind(("127.0.0.1", 0))
        station.settimeout(5)
        link = open_link("gcs", f"udp://127.0.0.1:{station.getsockname()[1]}")
        assert link.poll(0) == [Opened(0, link.where)]
        assert link.write(0, b"hello") == 5
        data, address = station.recvfrom(100)
        assert data == b"hello"
        station.sendto(b"answer", ("127.0.0.1", address[1]))
        events, _ = poll_until(link, is_a(Received))
        assert events == [Received(0, b"answer")]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.sendto(b"me too", ("127.0.0.1", address[1]))
            station.sendto(b"still me", ("127.0.0.1", address[1]))
            events, _ = poll_until(link, is_a(Received))
        assert events == [Received(0, b"still me")]
        assert link.strangers == 1
        link.close()


def own_address(link):
    with socket.socket(fileno=os.dup(link.filenos()[0])) as twin:
        return twin.getsockname()


def test_other_machines_cannot_reach_the_socket_of_a_peer_on_this_one():
    for host, own in (("127.0.0.1", "127.0.0.1"), ("[::1]", "::1")):
        link = open_link("gcs", f"udp://{host}:14550")
        link.poll(0)
        assert own_address(link)[0] == own
        link.close()


def test_a_peer_on_another_machine_is_heard_by_address_and_port_only(monkeypatch):
    """The peer's machine stands in as one of this machine's own addresses; the program takes it for another's."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
        station.bind(("127.0.0.3", 0))
        link = open_link("gcs", f"udp://127.0.0.3:{station.getsockname()[1]}")
        link.poll(0)
        link._on_loopback = False
        port = own_address(link)[1]
        for host in ("127.0.0.4", "127.0.0.3"):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
                other.bind((host, 0 if host == "127.0.0.3" else station.getsockname()[1]))
                other.sendto(b"arm", ("127.0.0.1", port))
        station.sendto(b"heartbeat", ("127.0.0.1", port))
        events, _ = poll_until(link, is_a(Received))
        assert events == [Received(0, b"heartbeat")]
        assert link.strangers == 2
        link.close()


def test_a_named_peer_that_moves_is_followed_and_its_old_address_is_not_heard_any_more(monkeypatch):
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as old,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as new,
    ):
        old.bind(("127.0.0.1", 0))
        new.bind(("127.0.0.1", 0))
        new.settimeout(5)
        at = old.getsockname()

        def look_up(host, port, *, flags, **options):
            if flags:
                raise socket.gaierror(socket.EAI_NONAME, "not a number")
            return [(socket.AF_INET, options["type"], 0, "", at)]

        monkeypatch.setattr(socket, "getaddrinfo", look_up)
        link = open_link("gcs", "udp://laptop.local:14550")
        poll_until(link, is_a(Opened))
        old.sendto(b"old", own_address(link))
        poll_until(link, is_a(Received))
        at = new.getsockname()
        events, _ = poll_until(link, is_a(Opened), step_us=1_000_000)
        assert [type(event) for event in events] == [Closed, Opened]
        assert "laptop.local is at 127.0.0.1 now" in events[0].reason
        assert link.write(0, b"hello") == 5
        assert new.recv(100) == b"hello"
        old.sendto(b"arm", own_address(link))
        new.sendto(b"here", own_address(link))
        events, _ = poll_until(link, is_a(Received))
        assert events == [Received(0, b"here")]
        link.close()


def test_a_fixed_udp_peer_that_nobody_listens_at_is_no_fault():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    link = open_link("gcs", f"udp://127.0.0.1:{port}")
    link.poll(0)
    for now_us in range(0, 10_000_000, 50_000):
        assert link.write(0, b"heartbeat") == 9
        assert link.poll(now_us) == []
    link.close()


def test_broadcast_stops_while_a_peer_answers_and_returns_when_it_is_gone():
    link = open_link("lan", "udp-broadcast://127.255.255.255:14599")
    assert [type(event) for event in link.poll(0)] == [Opened]
    link.write(0, b"anybody?")
    with socket.socket(fileno=os.dup(link.filenos()[0])) as twin:
        port = twin.getsockname()[1]
    with udp_peer(port) as peer:
        peer.send(b"here")
        events, now_us = poll_until(link, is_a(Received))
        events += link.poll(now_us)
    assert [type(event) for event in events] == [Opened, Received, Closed]
    assert events[-1].channel == 0
    assert link.write(0, b"x") == 0
    assert [(type(event), event.channel) for event in link.poll(100_000_000)] == [
        (Closed, events[0].channel),
        (Opened, 0),
    ]
    link.close()


def test_a_host_name_without_an_address_is_waited_for_not_raised(monkeypatch):
    goes_on, answered = threading.Event(), []

    def look_up(*_, flags, **__):
        if flags & socket.AI_NUMERICHOST:
            raise socket.gaierror(socket.EAI_NONAME, "no number")
        answered.append(goes_on.wait(PATIENCE_S))
        raise socket.gaierror(socket.EAI_NONAME, "no such name")

    monkeypatch.setattr(socket, "getaddrinfo", look_up)
    link = open_link("nmea", "tcp://no-such-host.invalid:3000")
    now_us = 0
    for _ in range(20):
        now_us += 50_000
        assert link.poll(now_us) == []
    assert answered == [], "no poll has waited for the name's answer"
    goes_on.set()
    deadline = time.monotonic() + PATIENCE_S
    while "waiting" not in link.describe() and time.monotonic() < deadline:
        now_us += 50_000
        assert link.poll(now_us) == []
        time.sleep(0.01)
    assert "no address for no-such-host.invalid" in link.describe()
    link.close()


def test_a_serial_line_with_parity_works_on_a_pty(tmp_path):
    """Pseudo-terminals refuse parity; the seed's 8E2 radio must still run on the bench."""
    near = open_link("modem", f"pty:{tmp_path}/lora")
    far = open_link("radio", f"serial:{tmp_path}/lora", baud=9600, parity="E", stop=2)
    assert isinstance(far.poll(0)[0], Opened)
    assert isinstance(near.poll(0)[0], Opened)
    assert far.write(0, bytes(range(256))) == 256
    events, _ = poll_until(near, is_a(Received))
    assert events[0].data == bytes(range(256))
    far.close()
    assert isinstance(near.poll(1)[-1], Closed)
    near.close()
    assert not (tmp_path / "lora").exists()


def test_nothing_stale_waits_for_who_opens_a_pty_late(tmp_path):
    near = open_link("modem", f"pty:{tmp_path}/lora")
    near.poll(0)
    assert near.write(0, b"nobody is here") == 0
    fd = os.open(tmp_path / "lora", os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    near.poll(1)
    near.write(0, b"fresh")
    assert select.select([fd], [], [], 5)[0]
    assert os.read(fd, 100) == b"fresh"
    os.close(fd)
    near.close()


def test_a_memory_link_unplugged_loses_what_was_under_way():
    near, far = pair("cable")
    near.poll(0)
    far.poll(0)
    near.write(0, b"lost")
    near.unplug("cut")
    assert far.poll(1) == [Closed(0, "cut")]
    assert near.poll(1) == [Closed(0, "cut")]
    assert near.write(0, b"x") == 0
    near.plug()
    assert [type(event) for event in far.poll(2)] == [Opened]


def test_a_memory_link_has_a_bounded_buffer():
    near, far = pair("cable", capacity=10)
    near.poll(0)
    far.poll(0)
    assert [near.write(0, b"1234567") for _ in range(3)] == [7, 3, 0]
    assert far.poll(1) == [Received(0, b"1234567123")]


LOG = (
    b"$GPHDT,10.0,T*00\r\n"
    b"$GPGGA,235959.50,4110.0,N,00840.0,W,4,12,0.8,3.0,M,50.0,M,,*00\r\n"
    b"$GPHDT,11.0,T*00\r\n"
    b"$GPRMC,000000.00,A,4110.0,N,00840.0,W,1.0,90.0,010125,,,A*00\r\n"
    b"$GPZDA,000002.00,01,01,2025,00,00*00\r\n"
    b"$GPGGA,000400.00,4110.0,N,00840.0,W,4,12,0.8,3.0,M,50.0,M,,*00\r\n"
)


def heard(link, times_us):
    found = []
    for now_us in times_us:
        found += [(now_us, event.data.split(b",")[0]) for event in link.poll(now_us) if isinstance(event, Received)]
    return found


@pytest.mark.parametrize("speed", [1, 4])
def test_a_log_is_replayed_at_the_pace_of_its_own_stamps(tmp_path, speed):
    (tmp_path / "log.nmea").write_bytes(LOG)
    link = open_link("log", f"file:{tmp_path}/log.nmea?speed={speed}")
    times = [us // speed for us in range(0, 6_000_000, 100_000)]
    # the line before the first stamp at 0.1 s; stamps 0, 0.5 and 2.5 s after; the four-minute gap counts one second
    assert heard(link, times) == [
        (100_000 // speed, b"$GPHDT"),
        (600_000 // speed, b"$GPRMC"),
        (2_600_000 // speed, b"$GPZDA"),
        (3_600_000 // speed, b"$GPGGA"),
    ]
    assert "finished" in link.describe()


def test_a_log_without_times_comes_line_by_line_and_can_repeat(tmp_path):
    (tmp_path / "depth.nmea").write_bytes(b"$SDDPT,5.0,0.0*00\r\n" * 3)
    link = open_link("log", f"file:{tmp_path}/depth.nmea?lines_per_s=2&loop=1")
    found = heard(link, range(0, 6_000_000, 100_000))
    assert [now_us for now_us, _ in found][:6] == [500_000, 1_000_000, 1_500_000, 2_100_000, 2_600_000, 3_100_000]
    link.close()
