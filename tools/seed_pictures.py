"""Draws the seed's scenarios for docs/SEED.md: what was wanted, what was sailed and what stood at the pins, from the recorded runs."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from companion.report import plots
from companion.report.shapes import PALETTE
from sitl.scenario.run import run_scenario

Column = list[float]
_GUARD: Final = {"CORRECTION": "#fff3c4", "LOCKED": "#ffd6d1"}
_LIMITS: Final = ((4.1, "good again"), (4.0, "least altitude"), (3.9, "locked"))
"""The original's three heights, m."""


def draw_all(folder: Path, work: Path) -> None:
    """Sail and draw; ``work`` takes the run folders."""
    sailed = {name: _sailed(name, work) for name in ("seed-waypoints", "seed-altitude-correct", "seed-altitude-stop")}
    (folder / "seed-waypoints.png").write_bytes(_waypoints(sailed["seed-waypoints"]))
    altitudes = [(title, sailed[f"seed-altitude-{kind}"]) for kind, title in _ALTITUDES]
    (folder / "seed-altitude.png").write_bytes(_altitude(altitudes))


_ALTITUDES: Final = (("correct", "turns back"), ("stop", "presses on"))


def _sailed(name: str, work: Path) -> list[dict[str, str]]:
    run_dir = work / name
    run_dir.mkdir()
    outcome = run_scenario(name, run_dir=run_dir)
    if not outcome.passed:
        raise SystemExit(f"{name} does not hold: no picture of it")
    with (run_dir / "control.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _column(rows: Sequence[dict[str, str]], name: str) -> Column:
    return [float(row[name]) if row[name] else float("nan") for row in rows]


def _waypoints(rows: Sequence[dict[str, str]]) -> bytes:
    made, axes = plots.figure(7.0, 3, sharex=True)
    t = _column(rows, "t_s")
    pairs = (("heading_deg", "heading_ref_deg", "heading, °"), ("speed_mps", "speed_ref_mps", "speed, m/s"))
    for ax, (is_, wanted, label) in zip(axes, pairs, strict=False):
        values = (
            [(value + 180.0) % 360.0 - 180.0 for value in _column(rows, is_)] if "deg" in is_ else _column(rows, is_)
        )
        ax.plot(t, _column(rows, wanted), color=PALETTE[1], linewidth=2.5, label="wanted")
        ax.plot(t, values, color=PALETTE[0], label="told to the law")
        _label(ax, label)
    names = (
        ("us_thruster_port", "m, thruster port"),
        ("us_thruster_starboard", "M, starboard"),
        ("us_rudder_port", "l, L, rudders"),
    )
    for (name, label), colour in zip(names, PALETTE[2:], strict=False):
        axes[2].plot(t, _column(rows, name), color=colour, label=label)
    _label(axes[2], "pulse, µs")
    axes[2].set_xlabel("s")
    axes[0].set_xlim(5.0, t[-1])
    return plots.as_png(made, 64)


def _altitude(sailed: Sequence[tuple[str, list[dict[str, str]]]]) -> bytes:
    made, axes = plots.figure(6.0, len(sailed), sharex=True)
    for ax, (title, rows) in zip(axes, sailed, strict=True):
        t = _column(rows, "t_s")
        _shade(ax, t, [row["guard"] for row in rows])
        ax.plot(t, _column(rows, "altitude_raw_m"), color="#c3ccd5", linewidth=0.6, label="sounded")
        ax.plot(t, _column(rows, "altitude_m"), color=PALETTE[0], label="held to be true")
        for height_m, name in _LIMITS:
            ax.axhline(height_m, color="#cf222e", linewidth=0.8, linestyle="--")
            ax.text(t[0], height_m, f" {name} {height_m:.1f}", fontsize=7, va="bottom", color="#cf222e")
        ax.set_ylim(3.6, 4.8)
        _label(ax, f"{title}: m under the keel")
    axes[-1].set_xlabel("s")
    return plots.as_png(made, 64)


def _shade(ax: Any, t: Column, states: Sequence[str]) -> None:
    start = 0
    for at in range(1, len(states) + 1):
        if at == len(states) or states[at] != states[start]:
            if states[start] in _GUARD:
                ax.axvspan(t[start], t[at - 1], color=_GUARD[states[start]], linewidth=0)
            start = at


def _label(ax: Any, text: str) -> None:
    ax.set_ylabel(text)
    ax.legend(loc="upper right", fontsize=8)
