"""Sends the seed's JSON plan through a radio modem's serial port and shows what comes back."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

from companion.io.link import Received
from companion.io.links import open_link


def send_json(data: bytes, port: str, wait_s: float) -> int:
    """Write the plan, then print lines from the port until an answer comes. Exit status 0 when it was accepted, else 1."""
    url = port if ":" in port else f"serial:{Path(port)}?baud=9600"
    link = open_link("radio", url)
    try:
        end_s = time.monotonic() + wait_s
        rest = data.strip() + b"\n"
        heard = b""
        while time.monotonic() < end_s:
            now_us = round(time.monotonic() * 1e6)
            for event in link.poll(now_us):
                if isinstance(event, Received):
                    heard += event.data
            if rest:
                rest = rest[link.write(0, rest) :]
            *lines, heard = heard.split(b"\n")
            for line in lines:
                print(line.decode(errors="replace"))
                result = _result(line)
                if result is not None:
                    return 0 if result == "accepted" else 1
            time.sleep(0.02)
    finally:
        link.close()
    print("the port never took the plan" if rest else f"no answer in {wait_s:g} s", file=sys.stderr)
    return 1


def _result(line: bytes) -> str | None:
    """The result in an answer; None for any other line."""
    try:
        found = json.loads(line)
    except ValueError:
        return None
    return str(found["result"]) if isinstance(found, dict) and "ack" in found and "result" in found else None
