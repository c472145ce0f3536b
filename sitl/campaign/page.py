"""A campaign's summary as one HTML file that needs nothing else: what held, how close to its limits, and how to see what did not."""

from __future__ import annotations

import html
import importlib.util
import json
import shlex
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from companion.report.page import chips, document

from .campaign import groups

MAX_FAILURES: Final = 200
"""More failed runs than these are counted, not listed."""


@dataclass(slots=True)
class Quantity:
    """One expectation over all runs of a group."""

    name: str
    limit: Any
    seeds: list[str] = field(default_factory=list)
    found: list[Any] = field(default_factory=list)
    holds: list[bool] = field(default_factory=list)

    @property
    def numbers(self) -> list[float]:
        """What was found, as far as it is a number."""
        return [float(item) for item in self.found if isinstance(item, int | float)]

    @property
    def used(self) -> list[float]:
        """For each number the share of the limit that it takes (1: at the limit); empty where that means nothing."""
        if not isinstance(self.limit, int | float) or self.limit <= 0:
            return []
        if self.at_least:
            return [self.limit / number if number > 0 else float("inf") for number in self.numbers]
        return [number / self.limit for number in self.numbers]

    @property
    def at_least(self) -> bool:
        """The limit is a lowest one."""
        return self.name.partition(",")[0].endswith("_min")


def make_page(title: str, rows: Sequence[dict[str, str]], total: int) -> str:
    """The whole page; ``total`` runs were wanted, ``rows`` are those that are done."""
    held = sum(row["passed"] == "1" for row in rows)
    wall_s = sum(float(row["wall_s"]) for row in rows)
    facts = f"{len(rows)} of {total} runs done, {wall_s:.0f} s of computing"
    drawn = importlib.util.find_spec("matplotlib") is not None
    found = groups(rows)
    body = [
        f"<h1>Campaign {html.escape(title)}</h1><p class=soft>{facts}</p><p>{chips(held, len(rows) - held)}</p>",
        _overview(found),
        _failures(rows),
        *(_group(number, *names, group, drawn) for number, (names, group) in enumerate(found.items())),
    ]
    if not drawn:
        body.append('<p class=soft>No pictures: they need matplotlib (the extra "report").</p>')
    return document(f"Campaign {title}", "".join(body))


def _overview(found: dict[tuple[str, str], list[dict[str, str]]]) -> str:
    rows = []
    for number, ((scenario, vessel), group) in enumerate(found.items()):
        held = sum(row["passed"] == "1" for row in group)
        mark = "pass" if held == len(group) else "fail"
        tightest = max(((max(item.used), item.name) for item in quantities(group) if item.used), default=(None, ""))
        near = "" if tightest[0] is None else f"{html.escape(tightest[1])}: {100 * tightest[0]:.0f} % of its limit"
        rows.append(
            f"<tr><td><a href='#g{number}'>{html.escape(scenario)}</a><td>{html.escape(vessel)}"
            f"<td class='n {mark}'>{held} of {len(group)}<td>{near}"
        )
    head = "<tr><th>Scenario<th>Vessel<th>Runs that hold<th>Closest to a limit, worst run</tr>"
    return f"<section><h2>Overview</h2><table>{head}{''.join(rows)}</table></section>"


def _failures(rows: Sequence[dict[str, str]]) -> str:
    failed = [row for row in rows if row["passed"] != "1"]
    if not failed:
        return ""
    lines = "".join(
        f"<tr><td>{html.escape(row['scenario'])}<td>{html.escape(row['vessel'] or 'own')}<td class=n>{html.escape(row['seed'])}"
        f"<td>{html.escape(row['failed'])}<br><code>{html.escape(command(row))}</code>"
        for row in failed[:MAX_FAILURES]
    )
    more = (
        f"<p class=soft>{len(failed) - MAX_FAILURES} more are in the table.</p>" if len(failed) > MAX_FAILURES else ""
    )
    head = "<tr><th>Scenario<th>Vessel<th>Seed<th>What did not hold, and how to see it</tr>"
    return f"<section id=failures><h2>Runs that failed</h2><table>{head}{lines}</table>{more}</section>"


def command(row: dict[str, str]) -> str:
    """The command that does one run again and records it."""
    words = ["companion", "sim", "--scenario", row["scenario"], "--seed", row["seed"], "--run-dir", "again"]
    if row["vessel"]:
        words += ["--set", f'vessel="{row["vessel"]}"']
    return shlex.join(words)


def quantities(group: Sequence[dict[str, str]]) -> list[Quantity]:
    """The group's expectations, each with what the runs found."""
    found: dict[tuple[int, str], Quantity] = {}
    for row in group:
        for place, (name, value, limit, holds) in enumerate(json.loads(row["findings"])):
            item = found.setdefault((place, name), Quantity(name, limit))
            item.seeds.append(row["seed"])
            item.found.append(value)
            item.holds.append(holds)
    return list(found.values())


def _group(number: int, scenario: str, vessel: str, group: Sequence[dict[str, str]], drawn: bool) -> str:
    items = quantities(group)
    rows = "".join(
        f"<tr><td>{html.escape(item.name)}<td class=n>{_shown(item.limit)}{_spread(item)}"
        f"<td class='n {'pass' if all(item.holds) else 'fail'}'>{sum(item.holds)} of {len(item.holds)}"
        for item in items
    )
    head = "<tr><th>Expectation<th>Limit<th>Lowest<th>Median<th>Highest<th>Holds</tr>"
    picture = _picture(items) if drawn else ""
    hull = "the scenario's own vessel" if vessel == "own" else f"vessel {html.escape(vessel)}"
    title = f"{html.escape(scenario)}, {hull}"
    return f"<section id=g{number}><h2>{title}</h2><table>{head}{rows}</table>{picture}</section>"


def _spread(item: Quantity) -> str:
    if item.numbers:
        cells = (min(item.numbers), statistics.median(item.numbers), max(item.numbers))
        return "".join(f"<td class=n>{_shown(cell)}" for cell in cells)
    values = sorted({_shown(value) for value in item.found})
    told = ", ".join(values[:3]) + (f" and {len(values) - 3} more" if len(values) > 3 else "")
    return f"<td colspan=3>{told}"


def _shown(value: Any) -> str:
    return html.escape("nothing" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value))


def _picture(items: Sequence[Quantity]) -> str:
    """How much of each limit every run used: a row of dots for each expectation with a number."""
    from companion.report import plots
    from companion.report.plots import figure
    from companion.report.shapes import PALETTE

    shown = [item for item in items if item.used]
    if not shown or len(shown[0].used) < 2:
        return ""
    made, (ax,) = figure(0.7 + 0.3 * len(shown))
    most = 1.2
    for row, item in enumerate(reversed(shown)):
        shares = [min(share, 2.0) for share in item.used]
        most = max(most, *shares)
        colours = [PALETTE[0] if share <= 1.0 else PALETTE[3] for share in shares]
        ax.scatter(shares, [row] * len(shares), c=colours, s=18, alpha=0.5, linewidths=0)
    ax.axvline(1.0, color=PALETTE[3], linestyle="--", linewidth=1.2)
    ax.set_xlim(0, most * 1.03)
    ax.set_ylim(-0.6, len(shown) - 0.4)
    ax.set_yticks(range(len(shown)), [item.name for item in reversed(shown)], fontsize=8)
    ax.set_xlabel("share of the limit that a run used (1 = at the limit), a dot for each run", fontsize=8)
    return plots.as_svg(made)
