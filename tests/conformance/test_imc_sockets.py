"""The sockets of an IMC system, on this computer's loopback: discovery, datagrams, connections, and who is not heard."""

from __future__ import annotations

import select
import socket

import pytest

from companion.io.imc_sockets import GROUP, PORTS, ImcSockets
from companion.io.interfaces import interfaces
from companion.io.links import LinkConfigError
from mavlink_bridge.imc import Discovery, Tcp, Udp


@pytest.fixture
def sockets():
    found = ImcSockets("127.0.0.1", 17602, 17602)
    found.look()
    yield found
    found.close()


def heard(sockets, wanted=1):
    """What comes, waiting for the kernel to hand it across."""
    found = []
    for _ in range(20):
        found += sockets.poll(0)
        if len(found) >= wanted:
            return found
        select.select(sockets.filenos(), [], [], 0.5)
    return found


def test_a_datagram_comes_with_its_senders_address_and_is_answered_there(sockets):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as console:
        console.bind(("127.0.0.1", 0))
        console.settimeout(5.0)
        console.sendto(b"hello", ("127.0.0.1", sockets.udp_port))
        ((place, data),) = heard(sockets)
        assert (place, data) == (Udp("127.0.0.1", console.getsockname()[1]), b"hello")
        sockets.send([(place, b"answer")])
        assert console.recvfrom(100) == (b"answer", ("127.0.0.1", sockets.udp_port))


def test_an_announcement_reaches_every_announcing_port_of_this_computer(sockets):
    free = next(port for port in reversed(PORTS) if port != sockets.finder_port)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as console:
        try:
            console.bind(("127.0.0.1", free))
        except OSError:
            pytest.skip("another program has the announcing ports")
        console.settimeout(5.0)
        sockets.send([(Discovery(), b"here")])
        assert console.recvfrom(100)[0] == b"here"


def test_a_consoles_multicast_on_this_computer_is_heard(sockets):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as console:
        console.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        console.sendto(b"announce", (GROUP, sockets.finder_port))
        assert b"announce" in [data for _, data in heard(sockets)]


def test_a_connection_is_a_place_of_its_own_until_it_is_closed(sockets):
    with socket.create_connection(("127.0.0.1", sockets.tcp_port), 5.0) as console:
        console.sendall(b"request")
        ((place, data),) = heard(sockets)
        assert (place, data) == (Tcp("127.0.0.1", console.getsockname()[1]), b"request")
        sockets.send([(place, b"reply")])
        assert console.recv(100) == b"reply"
    assert heard(sockets) == [(place, None)]
    sockets.send([(place, b"too late")])


def test_a_taken_port_gives_the_next_one_and_taken_ports_a_message(sockets):
    second = ImcSockets("127.0.0.1", 17602, 17602)
    assert (second.udp_port, second.tcp_port) == (17603, 17603)
    more = [ImcSockets("127.0.0.1", 17602, 0) for _ in range(3)]
    with pytest.raises(LinkConfigError, match="17602"):
        ImcSockets("127.0.0.1", 17602, 0)
    for each in (second, *more):
        each.close()


def test_only_own_addresses_are_told(sockets):
    assert sockets.addresses() == ["127.0.0.1"]
    assert "127.0.0.1" in [each.address for each in interfaces()]
