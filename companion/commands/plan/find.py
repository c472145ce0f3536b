"""Where ``companion plan`` looks for the vessel: at the endpoints that a configuration describes, or at those of the shipped ones."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, Final

from ...io.links import LinkConfigError, parse_link_url
from ...settings import ConfigError
from ...settings.device import no_device
from ...settings.schema import unreadable

USUAL: Final = ("udpin://0.0.0.0:14540", "tcpout://127.0.0.1:5760", "udpin://0.0.0.0:14550")
"""The simulator's for programs, then what the simulator, boat.toml and gateway.toml have for stations on the same computer."""
PROBE_S: Final = 3.0
"""How long one place is listened at before the next: three heartbeats."""
_EVERY: Final = ("", "0.0.0.0", "::")


def places(config: Path | None, host: str) -> list[str]:
    """MAVSDK's connections to try, in order. ``host``: the vessel's computer. Raises ConfigError when there is none to try."""
    if config is None:
        return list(USUAL) if host == "127.0.0.1" else [f"tcpout://{host}:5760", f"udpout://{host}:14550"]
    found, reasons = [], []
    for item in _endpoints(config):
        name, url = item.get("name", "?"), str(item.get("url", ""))
        if item.get("link_class") == "signed":
            reasons.append(f"endpoint {name} asks for signatures, which MAVSDK does not make")
        elif item.get("link_class") == "telemetry":
            reasons.append(f"endpoint {name} listens to nobody")
        elif place := _place(url, host):
            found.append(place)
        else:
            reasons.append(f"endpoint {name} at {url} is none that MAVSDK reaches")
    if not found:
        raise ConfigError(str(config), [*reasons, "no endpoint to reach the vessel by; give one with --url"])
    return found


def _endpoints(config: Path) -> list[dict[str, Any]]:
    """The endpoints of a vessel's or a gateway's file. Raises ConfigError."""
    try:
        data = tomllib.loads(no_device(config).read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise ConfigError(str(config), ["no such file"]) from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(config), [f"not valid TOML: {error}"]) from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(str(config), [unreadable(error)]) from None
    found = data.get("endpoints", [])
    return [item for item in found if isinstance(item, dict)] if isinstance(found, list) else []


def _place(url: str, host: str) -> str:
    """What a station does to get onto an endpoint; empty when MAVSDK cannot."""
    try:
        link = parse_link_url(url)
        where, port = link.host_port()
    except LinkConfigError:
        return ""
    at = host if where in _EVERY or host != "127.0.0.1" else where
    return {
        "udp": f"udpin://0.0.0.0:{port}",
        "udp-broadcast": f"udpin://0.0.0.0:{port}",
        "udp-listen": f"udpout://{at}:{port}",
        "tcp-listen": f"tcpout://{at}:{port}",
    }.get(link.scheme, "")
