"""The watcher's end of the status socket: reaches a running vessel, reads what it tells, and finds where it serves."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from ..io.local_socket import connect
from ..settings import ConfigError, Settings, load

SOCKET_NAME: Final = "status.sock"
SERVICE_HOME: Final = Path("/var/lib/usv-companion")
"""Where the shipped unit runs."""
_MESSAGE_MAX: Final = 1 << 20
_READ_BYTES: Final = 65_536


class LostError(OSError):
    """The vessel's process has ended the connection."""


class Client:
    """One connection. ``poll`` gives messages; ``ask`` sends one."""

    def __init__(self, path: Path, *, wait_s: float = 0.25) -> None:
        """Raises OSError when nobody serves there. ``wait_s``: how long ``poll`` waits for more."""
        self._stream: socket.socket = connect(path, 2.0)
        self._stream.settimeout(wait_s)
        self._heard = b""

    def poll(self) -> Iterator[dict[str, Any]]:
        """Messages that have come, oldest first. Raises LostError."""
        try:
            data = self._stream.recv(_READ_BYTES)
        except (TimeoutError, BlockingIOError):
            return
        except OSError as error:
            raise LostError(str(error)) from error
        if not data or len(self._heard) > _MESSAGE_MAX:
            raise LostError("the vessel's process has let go")
        *lines, self._heard = (self._heard + data).split(b"\n")
        for line in lines:
            message = json.loads(line)
            if isinstance(message, dict):
                yield message

    def ask(self, **message: Any) -> None:
        """Send one message. Raises LostError."""
        try:
            self._stream.sendall(json.dumps(message).encode() + b"\n")
        except OSError as error:
            raise LostError(str(error)) from error

    def close(self) -> None:
        self._stream.close()


def socket_of(store: str, run_dir: Path | None) -> Path | None:
    """Where a vessel serves: beside its store; without one beside its run. None: it keeps neither."""
    if store:
        return Path(store).parent / SOCKET_NAME
    return None if run_dir is None else run_dir / SOCKET_NAME


def places(where: Path | None) -> list[Path]:
    """Where a vessel may be served, the likeliest first. Raises ConfigError for a configuration that is none."""
    if where is None:
        here = [Path("state") / SOCKET_NAME, SERVICE_HOME / "state" / SOCKET_NAME]
        return [*here, *_newest_runs(Path())]
    if where.is_dir():
        return [where / SOCKET_NAME, *_newest_runs(where)]
    if where.suffix != ".toml":
        return [where]
    settings = load(where, [], Settings)
    beside = socket_of(settings.store, None)
    found = [] if beside is None else [beside, SERVICE_HOME / beside]
    return [*found, *sorted(Path(settings.record.directory).glob(f"*/{SOCKET_NAME}"), reverse=True)]


def reach(found: list[Path]) -> tuple[Client, Path]:
    """Connect to the first that answers. Raises ConfigError that names each with its reason."""
    reasons = []
    for path in found:
        try:
            return Client(path), path
        except OSError as error:
            reasons.append(f"{path}: {error.strerror or error}")
    reasons = reasons or ["there is no status socket below this folder"]
    raise ConfigError("no running vessel found", [*reasons, "name the boat's TOML file, its run folder or its socket"])


def _newest_runs(base: Path) -> list[Path]:
    """Sockets of runs below a folder, the newest run first."""
    return sorted([*base.glob(f"runs*/*/{SOCKET_NAME}"), *base.glob(f"*/{SOCKET_NAME}")], reverse=True)[:8]
