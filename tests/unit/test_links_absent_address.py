"""An endpoint at an address that comes later, a VPN's or a Wi-Fi's: waited for, told, and everything else runs meanwhile."""

from __future__ import annotations

import logging
import socket
from types import SimpleNamespace

import pytest

from companion.commands.status.journal import LinkNotes
from companion.io.links import open_link
from companion.ports import PlotterPort

ABSENT = "192.0.2.1"
"""Of the documentation's network: no computer has it."""


@pytest.fixture
def vpn(monkeypatch):
    """Where the boat's name inside the VPN leads to."""
    there = [ABSENT]
    look_up = socket.getaddrinfo
    monkeypatch.setattr(socket, "getaddrinfo", lambda host, *more, **keys: look_up(there[-1], *more, **keys))
    return there


@pytest.mark.parametrize("scheme", ["udp-listen", "tcp-listen"])
def test_an_endpoint_whose_address_is_absent_is_told_as_missing_and_opens_when_it_comes(scheme, vpn, caplog):
    """The program had ended with status 2, and with it every other link."""
    caplog.set_level(logging.INFO)
    port, notes = PlotterPort(open_link("vpn", f"{scheme}://boat.vpn:0")), LinkNotes()
    opened_s = []
    for tick in range(200):
        now_us = tick * 100_000
        if now_us == 10_000_000:
            vpn.append("127.0.0.1")
        port.read(now_us)
        opened_s += [now_us / 1e6] if port.link.filenos() else []
        notes.update(SimpleNamespace(t_us=now_us, links=(port.health(now_us),)))
    assert 10.0 <= opened_s[0] <= 12.0
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]
    assert f"vpn is missing, tried again for ever: {scheme}://boat.vpn:0 (waiting: Cannot assign" in caplog.messages[0]
    port.link.close()
