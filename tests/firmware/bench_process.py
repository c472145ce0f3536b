"""The bench command as a process of its own, with a finger on the space bar."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

COMPANION = Path(sys.executable).parent / "companion"


def bench(link, *words, limit="1"):
    """The bench at full range, and a finger on the space bar."""
    process = subprocess.Popen(
        [COMPANION, "bench-actuators", "--url", f"serial:{link}", "--yes", "--limit", limit, *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    threading.Thread(target=press, args=(process,), daemon=True).start()
    return process


def press(process):
    """Repeat the key as a keyboard does."""
    with contextlib.suppress(OSError, ValueError):
        while process.poll() is None:
            process.stdin.write(" ")
            process.stdin.flush()
            time.sleep(0.03)


def heard(process, limit_s=60.0):
    """All that it printed, once it has ended."""
    process.wait(limit_s)
    return process.stdout.read()


def end(process):
    if process.poll() is None:
        process.send_signal(signal.SIGCONT)
        process.kill()
    process.wait()
