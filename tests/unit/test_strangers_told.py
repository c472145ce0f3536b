"""Speech from an address that is not configured is told, at most once a minute, with the line that would let it command."""

from __future__ import annotations

import re
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from companion.gateway import Gateway, GatewaySettings
from companion.io.links import Link, Received, open_link
from companion.io.links.mem import MemLink
from companion.settings.schema import EndpointSettings
from companion.strangers import Lookout
from mavlink_bridge.language.messages import Severity
from sitl.gateway import simulation_key
from tests.patience import PATIENCE_S

SECOND_US = 1_000_000


def eventually(holds: Callable[[], object]) -> bool:
    """Whether it holds once the kernel has carried a datagram to the other socket."""
    until_s = time.monotonic() + PATIENCE_S
    while not holds():
        if time.monotonic() > until_s:
            return False
    return True


@pytest.fixture
def sockets() -> Iterator[tuple[socket.socket, socket.socket]]:
    """The peer that the configuration names, and somebody else on the same computer."""
    peer, other = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
    for each in (peer, other):
        each.bind(("127.0.0.1", 0))
    yield peer, other
    peer.close()
    other.close()


def url_of(peer: socket.socket) -> str:
    return f"udp://127.0.0.1:{peer.getsockname()[1]}"


def port_of(link: Link) -> int:
    found = re.search(r"from port (\d+)", link.describe())
    assert found is not None
    return int(found[1])


def seen_at(t_us: int) -> Any:
    """All that the lookout reads of a picture."""
    return SimpleNamespace(t_us=t_us)


def test_a_stranger_is_told_once_a_minute_with_the_line_that_lets_him_in(
    sockets: tuple[socket.socket, socket.socket],
) -> None:
    peer, other = sockets
    link: Any = open_link("gcs", url_of(peer))
    link.poll(0)
    said: list[tuple[Severity, str]] = []
    lookout = Lookout([link], lambda severity, text: said.append((severity, text)))
    for second in range(125):
        before = link.strangers
        other.sendto(b"hello", ("127.0.0.1", port_of(link)))
        assert eventually(lambda before=before, at=second: not link.poll(at) and link.strangers > before)
        lookout.update(seen_at(second * SECOND_US))
    assert len(said) == 3
    line = re.search(r'url = "(.*)"', said[0][1])
    assert said[0][0] is Severity.WARNING
    assert line is not None
    assert line[1] == url_of(other)
    link.close()

    link = open_link("gcs", line[1])
    link.poll(0)
    other.sendto(b"hello", ("127.0.0.1", port_of(link)))
    heard: list[object] = []
    assert eventually(lambda: heard.extend(e for e in link.poll(0) if isinstance(e, Received)) or heard)
    link.close()


def test_the_peer_is_nobody_to_tell_of(sockets: tuple[socket.socket, socket.socket]) -> None:
    peer, _ = sockets
    link: Any = open_link("gcs", url_of(peer))
    link.poll(0)
    said: list[str] = []
    lookout = Lookout([link, MemLink("radio")], lambda severity, text: said.append(text))
    peer.sendto(b"hello", ("127.0.0.1", port_of(link)))
    assert eventually(lambda: link.poll(0))
    lookout.update(seen_at(0))
    assert said == []
    link.close()


def test_the_gateway_tells_it_too(sockets: tuple[socket.socket, socket.socket], tmp_path: Path) -> None:
    peer, other = sockets
    settings = GatewaySettings(
        key_file=str(simulation_key(tmp_path)), endpoints=(EndpointSettings(name="gcs", url=url_of(peer)),)
    )
    gateway = Gateway(settings, modem=MemLink("modem"))
    said: list[str] = []
    gateway._say = lambda severity, text: said.append(text)
    link = gateway.grounds[0].link
    gateway.tick(SECOND_US)
    other.sendto(b"hello", ("127.0.0.1", port_of(link)))
    times = iter(range(2, 200))
    assert eventually(lambda: gateway.tick(next(times) * SECOND_US) and any(url_of(other) in text for text in said))
