"""How a ground station gets onto an endpoint, in words for people."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from ..settings.schema import EndpointSettings


def places(endpoints: Iterable[EndpointSettings]) -> Iterator[str]:
    """One line for each endpoint: name, address, persona, and what to type at the station."""
    for endpoint in endpoints:
        yield f"{endpoint.name:8} {endpoint.url}  ({endpoint.persona})  {hint(endpoint.url)}".rstrip()


def program(name: str) -> str:
    """How a program of this environment is called from here: by its path where the shell would not find it."""
    own = Path(sys.executable).parent / name
    if shutil.which(name) is not None or not own.is_file():
        return name
    here = Path.cwd()
    return str(own.relative_to(here)) if own.is_relative_to(here) else str(own)


def hint(url: str) -> str:
    """What a ground station on this computer does to get onto an endpoint."""
    scheme, _, rest = url.partition("://")
    port = rest.rpartition(":")[2].partition("?")[0]
    if scheme == "tcp-listen":
        return f"MAVProxy: {program('mavproxy.py')} --master tcp:127.0.0.1:{port}"
    if scheme == "udp" and port == "14550":
        return "QGroundControl connects by itself"
    return f"MAVSDK: udpin://0.0.0.0:{port}" if scheme == "udp" else ""
