"""What an operator presses and then sees, step by step, as the tables of docs/GROUND-STATIONS.md have it.

Tests that work a whole day with a stand-in write it down on their way and compare it with the page. ``TRANSCRIPTS=write`` in the
environment writes the page instead, after a change of what is shown has been looked at.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Final

from tests.qgc_client import QgcClient

PAGE: Final = Path(__file__).parents[1] / "docs" / "GROUND-STATIONS.md"
_VERSION: Final = re.compile(r"\d+\.\d+\.\d+\S*(?=:|$)")
_KINDS: Final = {**dict.fromkeys(range(4), "error"), 4: "warning", 5: "warning"}
"""Of a text's severity: QGroundControl shows NOTICE as a warning, and what is less as plain text."""


class Transcript:
    """One table: ``seen`` adds a row with what is new on the screen."""

    def __init__(self, client: QgcClient) -> None:
        self._client = client
        self._texts = self._boxes = 0
        self.rows: list[str] = []

    def seen(self, pressed: str) -> None:
        """Note what has come since the last row."""
        report, client = self._client.report, self._client
        boxes = [f'**box "{text}"**' for text in report.popups[self._boxes :]]
        texts = [_words(severity, text) for _, severity, text in report.texts[self._texts :]]
        self._boxes, self._texts = len(report.popups), len(report.texts)
        mode = f"*{client.mode_shown}*, {'armed' if client.armed else 'disarmed'}"
        self.rows.append(f"| {pressed} | {'<br>'.join([mode, *boxes, *texts])} |")

    def holds(self, title: str) -> None:
        """Compare with the table of that name. Raises AssertionError."""
        page = PAGE.read_text("utf-8")
        head, tail = f"<!-- transcript {title} -->\n", "<!-- end -->\n"
        assert head in page, f"no transcript of {title}"
        before, rest = page.split(head, 1)
        told, after = rest.split(tail, 1)
        table = "\n".join(["| pressed | then on the screen |", "| --- | --- |", *self.rows]) + "\n"
        if os.environ.get("TRANSCRIPTS") == "write":
            PAGE.write_text(before + head + table + tail + after, "utf-8")
        else:
            assert told == table, f"{PAGE.name}, {title}: what is shown has changed; TRANSCRIPTS=write takes it over"


def _words(severity: int, text: str) -> str:
    kind = _KINDS.get(severity)
    plain = _VERSION.sub("…", text).replace("|", "\\|")
    return f'{kind} "{plain}"' if kind else f'"{plain}"'
