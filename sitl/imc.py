"""``companion sim --imc``: the bridge to IMC consoles beside the simulator, as a process of its own like everywhere."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from companion.settings import ConfigError, Settings

_ID = 0x2877
_PORT = 6002
_LISTENS = "tcp-listen://"


def words(settings: Settings, instance: int, run_dir: Path) -> list[str]:
    """The bridge's command line: it goes to the vessel's TCP endpoint. Raises ConfigError when there is none."""
    served = [item.url.removeprefix(_LISTENS) for item in settings.endpoints if item.url.startswith(_LISTENS)]
    if not served:
        raise ConfigError("--imc", [f'--imc: needs an endpoint with url = "{_LISTENS}127.0.0.1:5760" to speak to'])
    port = served[0].rpartition(":")[2].partition("?")[0]
    keys = {
        "vehicle": f"tcp://127.0.0.1:{port}",
        "vehicle_id": settings.system.system_id,
        "vessel": settings.vessel,
        "name": f"usv-{instance + 1}",
        "imc_id": _ID + instance,
        "udp_port": _PORT + 10 * instance,
        "tcp_port": _PORT + 10 * instance,
        "store": run_dir / "imc.db",
    }
    changes = (f"--set={key}={value}" for key, value in keys.items())
    return [sys.executable, "-m", "companion.cli", "imc", f"--beside={os.getpid()}", *changes]


@contextlib.contextmanager
def beside(command: list[str]) -> Iterator[None]:
    """Run the bridge as long as the simulator runs."""
    bridge = subprocess.Popen(command)
    try:
        yield
    finally:
        bridge.terminate()
        try:
            bridge.wait(5.0)
        except subprocess.TimeoutExpired:
            bridge.kill()
