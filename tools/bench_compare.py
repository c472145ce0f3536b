"""Compares two benchmark files: what got better, what worse, what is new, what is gone.

``make bench-compare OLD=a.json NEW=b.json``. Exit status 1 when a figure that held its bar does so no longer.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

NOISE = 0.05
"""A relative change below this is called equal."""


def compare(old: Sequence[dict[str, Any]], new: Sequence[dict[str, Any]]) -> tuple[str, bool]:
    """Return a Markdown table and whether a bar was lost."""
    before = {row["name"]: row for row in old}
    after = {row["name"]: row for row in new}
    lines = ["| benchmark | old | new | change | |", "| --- | ---: | ---: | ---: | --- |"]
    lost = False
    for name in [*before, *(name for name in after if name not in before)]:
        was, now = before.get(name), after.get(name)
        remark = _remark(was, now)
        lost = lost or remark == "**bar lost**"
        lines.append(f"| {name} | {_value(was)} | {_value(now)} | {_change(was, now)} | {remark} |")
    return "\n".join(lines) + "\n", lost


def _value(row: dict[str, Any] | None) -> str:
    return "" if row is None or row["value"] is None else f"{row['value']:g} {row['unit']}".strip()


def _change(was: dict[str, Any] | None, now: dict[str, Any] | None) -> str:
    if was is None or now is None or not was["value"] or now["value"] is None:
        return ""
    share = now["value"] / was["value"] - 1.0
    return "=" if abs(share) < NOISE else f"{100 * share:+.0f} %"


def _remark(was: dict[str, Any] | None, now: dict[str, Any] | None) -> str:
    if was is None or now is None:
        return "new" if was is None else "gone"
    if was["holds"] and now["holds"] is False:
        return "**bar lost**"
    return "bar reached" if was["holds"] is False and now["holds"] else ""


def main(argv: Sequence[str] | None = None) -> int:
    """Print the comparison."""
    parser = argparse.ArgumentParser(description="compare two benchmark files")
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    arguments = parser.parse_args(argv)
    try:
        old, new = (json.loads(path.read_text()) for path in (arguments.old, arguments.new))
    except (OSError, ValueError) as error:
        print(f"cannot read a benchmark file: {error}", file=sys.stderr)
        return 2
    text, lost = compare(old, new)
    print(text)
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
