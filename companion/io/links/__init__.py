"""Every way in which bytes enter and leave: serial, TCP, UDP, pseudo-terminals, files, memory. One contract, one file a kind."""

from __future__ import annotations

from .link import Closed, Link, LinkEvent, Opened, Received
from .table import LinkKind, Reach, check_link, kind_of, open_link
from .url import LinkConfigError, parse_link_url

__all__ = [
    "Closed",
    "Link",
    "LinkConfigError",
    "LinkEvent",
    "LinkKind",
    "Opened",
    "Reach",
    "Received",
    "check_link",
    "kind_of",
    "open_link",
    "parse_link_url",
]
