"""Addresses: every spelling that is meant, and for every mistake a text that says how to write it."""

from __future__ import annotations

import importlib
import socket
import time

import pytest

from companion.doors import served_doors
from companion.io.links.link import Link
from companion.io.links.resolve import Resolver
from companion.io.links.serial import SerialLink
from companion.io.links.table import SCHEMES, LinkConfigError, check_link, open_link
from companion.io.links.tcp import TcpClientLink


@pytest.mark.parametrize(
    ("url", "options", "meant"),
    [
        ("/dev/ttyS0", {"baud": 115200}, "/dev/ttyS0 115200 8N1"),
        ("/dev/ttyS0", {}, "/dev/ttyS0 115200 8N1"),
        ("serial:/dev/ttyUSB0?baud=9600&parity=E&stop=2", {}, "/dev/ttyUSB0 9600 8E2"),
        ("serial:///dev/serial/by-id/usb-Arduino?baud=250000", {}, "/dev/serial/by-id/usb-Arduino 250000 8N1"),
        ("serial:/dev/ttyUSB0?baud=9600", {"baud": 57600, "parity": "odd"}, "/dev/ttyUSB0 57600 8O1"),
    ],
)
def test_serial_spellings(url, options, meant):
    link = open_link("device", url, **options)
    assert isinstance(link, SerialLink)
    assert link.where == meant


def test_the_seeds_tcp_spelling():
    link = open_link("lt1000", "tcp://127.0.0.1:3000")
    assert isinstance(link, TcpClientLink)
    assert "127.0.0.1:3000" in link.describe()


@pytest.mark.parametrize(
    ("url", "mend"),
    [
        ("", "scheme:where"),
        ("ttyS0", "scheme:where"),
        ("ftp://host:21", "tcp-listen"),
        ("tcp://127.0.0.1", "like tcp://127.0.0.1:14550"),
        ("tcp://:3000", "like tcp://127.0.0.1:3000"),
        ("udp://host:seventy", "like udp://"),
        ("udp://127.0.0.1:70000", "like udp://"),
        ("tcp://192.168.1..5:3000", "1 to 63 characters"),
        ("tcp-listen://.local:3000", "1 to 63 characters"),
        ("udp://" + "a" * 64 + ".local:14550", "1 to 63 characters"),
        ("udp-listen://vessel..local:14550", "1 to 63 characters"),
        ("udp://0.0.0.0:14550", "udp-listen://0.0.0.0:14550"),
        ("udp-broadcast://vessel.local:14550", "udp-broadcast://192.168.1.255:14550"),
        ("serial:/dev/ttyS0?baud=fast", "from 50 to 4e+06"),
        ("serial:/dev/ttyS0?baud=112500", "no rate of serial ports; the nearest is 115200"),
        ("serial:/dev/ttyS0?parity=X", "one of e, even, n, none, o, odd"),
        ("serial:/dev/ttyS0?bauds=9600", "known: baud, parity, stop, silence"),
        ("serial:", "like serial:/some/path"),
        ("mem:", "like mem:radio"),
        ("file:/no/such/log.nmea", "recorded NMEA log"),
        ("file:/no/such/log.nmea?speed=0", "from 0.01 to 1000"),
        ("pty:/some/where?baud=1", "known: none"),
    ],
)
def test_a_mistake_names_its_mend(url, mend):
    for check in (check_link, lambda url: open_link("x", url)):
        with pytest.raises(LinkConfigError) as caught:
            check(url)
        assert mend in str(caught.value)


def looked_up(resolver):
    while (found := resolver.poll()) is None:
        time.sleep(0.001)
    return found


def test_a_name_that_no_look_up_takes_is_a_failed_look_up():
    with pytest.raises(OSError, match="no address for"):
        looked_up(Resolver("192.168.1..5", 3000, socket.SOCK_STREAM))


@pytest.mark.parametrize("host", ["vessel.local", "10.0.0.1", "[::1]", "[fe80::1%eth0]", "bücher.example", "host.", ""])
def test_every_name_that_a_look_up_takes_is_meant(host):
    check_link(f"tcp-listen://{host}:3000")


def test_checking_opens_nothing(tmp_path):
    check_link(f"pty:{tmp_path}/device")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("scheme", SCHEMES)
def test_every_scheme_has_its_class_with_all_that_a_link_offers(scheme):
    with pytest.raises(LinkConfigError):
        check_link(f"{scheme}:?nonsense=1")
    module, _, name = SCHEMES[scheme].made_by.partition(":")
    made = getattr(importlib.import_module(module), name)
    wanted = {name for name in vars(Link) if not name.startswith("_")} | {"check", "from_url"}
    assert wanted <= set(dir(made))


HEARD = {
    "serial:/dev/ttyUSB0": None,
    "pty:/tmp/modem": None,
    "mem:modem": None,
    "file:log.nmea": None,
    "tcp://10.0.0.7:2000": "10.0.0.7:2000 only",
    "udp://10.0.0.7:2000": "10.0.0.7:2000 only",
    "tcp-listen://0.0.0.0:2000": "EVERY MACHINE",
    "udp-listen://0.0.0.0:2000": "EVERY MACHINE",
    "udp-broadcast://10.0.0.255:2000": "everybody in the network",
}
"""Who is heard on each kind of link; None: it opens no socket."""


@pytest.mark.parametrize("url", HEARD)
def test_who_is_heard_on_a_link_is_told(url):
    reaches = [door.reach for door in served_doors([("link", url)])]
    assert [HEARD[url] in reach for reach in reaches] == ([] if HEARD[url] is None else [True])


def test_a_new_kind_of_link_says_who_is_heard():
    assert {url.partition(":")[0] for url in HEARD} == set(SCHEMES)


def test_a_port_of_our_own_that_is_taken_says_so():
    first = open_link("a", "tcp-listen://127.0.0.1:0")
    with pytest.raises(LinkConfigError, match="choose another port"):
        open_link("b", f"tcp-listen://127.0.0.1:{first.port}")
    first.close()
    first = open_link("a", "udp-listen://127.0.0.1:0")
    with pytest.raises(LinkConfigError, match="choose another port"):
        open_link("b", f"udp-listen://127.0.0.1:{first.port}")
    first.close()


def test_a_pty_does_not_overwrite_a_file(tmp_path):
    (tmp_path / "precious").write_text("data")
    with pytest.raises(LinkConfigError, match="something else is there"):
        open_link("x", f"pty:{tmp_path}/precious")
    assert (tmp_path / "precious").read_text() == "data"
