"""What the first announcement needs, and nothing more: the process says that it is there before the rest of it is built.

Who is heard meanwhile is greeted between two pieces of the start; what they ask is answered once all of it stands.
"""

from __future__ import annotations

from mavlink_bridge.imc import Node, NodeConfig, Udp

from ..io.imc_sockets import ImcSockets
from .settings import TYPES, ImcSettings


def make_node(settings: ImcSettings, *, uid: int, opening: bool = False) -> Node:
    """The system as it announces itself, without its parts. With ``opening`` it keeps questions until it is opened."""
    config = NodeConfig(imc_id=settings.imc_id, name=settings.name, system_type=TYPES[settings.type], uid=uid)
    return Node(config, opening=opening)


def hear(node: Node, sockets: ImcSockets, now_us: int) -> None:
    """What came on the sockets goes to the node."""
    for place, data in sockets.poll(now_us):
        if data is not None:
            node.receive(data, place, now_us)
        elif not isinstance(place, Udp):
            node.closed(place)


def refresh(node: Node, sockets: ImcSockets, now_us: int, utc_us: int | None) -> None:
    """Tell the node the time and where it can be reached."""
    node.utc_ahead_us = None if utc_us is None else utc_us - now_us
    hosts = sockets.addresses()
    node.udp = tuple(Udp(host, sockets.udp_port) for host in hosts)
    node.tcp = tuple(Udp(host, sockets.tcp_port) for host in hosts) if sockets.tcp_port else ()
