"""``companion status``: what a running vessel does, live on the terminal. It only looks: closing or killing it changes nothing."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
import time
from pathlib import Path
from typing import Any, Final, TextIO

from ..settings import ConfigError
from ..status.client import Client, LostError, places, reach
from ..status.picture import NoPictureError, Picture, from_fields
from .status.panel import PanelLine, line
from .status.view import Screen

OLD_S: Final = 3.0
"""A picture older than this is said to be old."""
_AGAIN_S: Final = 1.0
_LINE_S: Final = 5.0


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("status", help="watch a running vessel, live", description=__doc__)
    parser.add_argument(
        "where",
        type=Path,
        nargs="?",
        metavar="F.toml|RUN_DIR|SOCKET",
        help="the vessel's configuration, a run's folder or the socket itself (default: the one that is found)",
    )
    parser.add_argument("--once", action="store_true", help="show the state once and end")
    parser.add_argument("--json", action="store_true", help="print pictures as JSON, one a line")
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Watch until Ctrl-C; exit status 0, 2 when no vessel is found."""
    with contextlib.suppress(OSError):
        os.nice(5)  # whoever looks comes after who sails
    found = places(arguments.where)
    client, path = reach(found)
    shown = _Shown(sys.stdout, as_json=arguments.json, once=arguments.once)
    while True:
        try:
            for message in client.poll():
                shown.take(message)
            if shown.is_done:
                return 0
            shown.refresh()
        except LostError:
            client.close()
            if arguments.once:
                raise
            client = _again(path, shown)


def _again(path: Path, shown: _Shown) -> Client:
    """Wait until the vessel's process is back, and say so meanwhile."""
    while True:
        try:
            return reach([path])[0]
        except ConfigError:
            shown.refresh()
            time.sleep(_AGAIN_S)


class _Shown:
    """What the terminal or the pipe has been shown."""

    def __init__(self, out: TextIO, *, as_json: bool, once: bool) -> None:
        self._out = out
        self._as_json, self._once = as_json, once
        self._screen = Screen(out) if out.isatty() and not as_json else None
        self._name = ""
        self._picture: Picture | None = None
        self._heard_s = time.monotonic()
        self._line_s = float("-inf")
        self._number = 0
        self._drawn_s = float("-inf")
        self.is_done = False

    def take(self, message: dict[str, Any]) -> None:
        """Take one message of the vessel."""
        if "hello" in message:
            self._name = str(message["hello"].get("name", ""))
        if "picture" not in message or self.is_done:
            return
        try:
            picture = from_fields(message["picture"])
        except NoPictureError as error:
            raise ConfigError("companion status", [f"{error}: use the vessel's own program"]) from None
        if picture.t_s < (self._picture.t_s if self._picture else 0.0):
            self._number = 0  # the vessel's process is a new one
        self._picture, self._heard_s, self.is_done = picture, time.monotonic(), self._once
        if self._as_json:
            self._print(json.dumps(message["picture"], ensure_ascii=False))
        elif self._screen is None:
            self._lines(picture)
        elif self._once:
            self._screen.draw(picture)

    def refresh(self) -> None:
        """Draw the newest again, with its age when it is old."""
        if self._screen is None or self._picture is None:
            return
        now_s = time.monotonic()
        old_s = now_s - self._heard_s
        if self._drawn_s >= self._heard_s and now_s - self._drawn_s < _AGAIN_S:
            return
        self._drawn_s = now_s
        note = PanelLine("NO WORD", f"of {self._name} for {old_s:.0f} s: what follows is old", "red")
        self._screen.draw(self._picture, [note] if old_s > OLD_S else [])

    def _lines(self, picture: Picture) -> None:
        for each in picture.texts:
            if each.number > self._number:
                self._number = each.number
                self._print(f"{each.t_s:9.2f}  {each.severity.lower():9} {each.text}")
        if self._heard_s - self._line_s >= _LINE_S:
            self._line_s = self._heard_s
            self._print(line(picture))

    def _print(self, text: str) -> None:
        self._out.write(text + "\n")
        self._out.flush()
