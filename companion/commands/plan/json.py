"""Sends the seed's JSON plan through a radio modem's serial port and shows what comes back."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

from ...io.links import Link, Opened, Received, open_link

RESEND_S = 8.0
"""Pause before an unanswered plan is sent again; longer than a plan, an answer and a state take on the slowest air."""
QUIET_S = 4.0
"""Silence after which the air counts as free."""
GAP_S = 0.3
SETTLE_S = 1.5
"""The port is given so long to open before its state is told."""


def send_json(data: bytes, port: str, wait_s: float) -> int:
    """Write the plan until an answer comes, and print the lines from the port. Exit status 0 when it was accepted, else 1.

    On a half-duplex air a plan that meets a state is lost: it is sent right after a line has ended, or into silence,
    and again when nobody answers. The vessel takes a repeated plan once.
    """
    link = open_link("radio", port if ":" in port else f"serial:{Path(port)}?baud=9600")
    try:
        return _converse(link, data.strip() + b"\n", wait_s)
    finally:
        link.close()


def _converse(link: Link, plan: bytes, wait_s: float) -> int:
    is_open, told = False, False
    began_s = heard_s = time.monotonic()
    sent_s: float | None = None
    rest, heard = b"", b""
    while (now_s := time.monotonic()) < began_s + wait_s:
        for event in link.poll(round(now_s * 1e6)):
            if isinstance(event, Received):
                heard, heard_s = heard + event.data, now_s
            else:
                is_open = isinstance(event, Opened)
        if not is_open and not told and now_s - began_s >= SETTLE_S:
            told = True
            print(f"{link.describe()}; tried again for {wait_s:g} s", file=sys.stderr, flush=True)
        *lines, heard = heard.split(b"\n")
        for line in lines:
            print(line.decode(errors="replace"))
            result = _result(line)
            if result is not None:
                return 0 if result == "accepted" else 1
        silent_s = now_s - heard_s
        free = silent_s >= QUIET_S or (not heard and heard_s > began_s and silent_s >= GAP_S)
        if not rest and free and (sent_s is None or now_s - sent_s >= RESEND_S):
            rest, sent_s = plan, now_s
        if rest:
            rest = rest[link.write(0, rest) :]
        time.sleep(0.02)
    taken = is_open and not rest
    print(f"no answer in {wait_s:g} s" if taken else "the port never took the plan", file=sys.stderr)
    return 1


def _result(line: bytes) -> str | None:
    """The result in an answer; None for any other line."""
    try:
        found = json.loads(line)
    except ValueError:
        return None
    return str(found["result"]) if isinstance(found, dict) and "ack" in found and "result" in found else None
