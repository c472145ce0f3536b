"""The report as one HTML file that needs nothing else: no network, no scripts."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from typing import Final

from . import plots
from .flight import Event, Flight
from .story import tell, weightiest
from .verdicts import Limits, Verdict, clock, judge

MAX_EVENTS: Final = 1500
MAX_ORDERS: Final = 500
_STYLE: Final = """
:root{--ink:#1f2328;--soft:#57606a;--line:#d0d7de;--page:#f6f8fa;--card:#fff;--good:#1a7f37;--bad:#cf222e}
*{box-sizing:border-box}body{margin:0;font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--page)}
main{max-width:1040px;margin:0 auto;padding:24px 16px}h1{font-size:26px;margin:0 0 4px}h2{font-size:18px;margin:0 0 4px}
p.soft,.soft{color:var(--soft);margin:0}section{background:var(--card);border:1px solid var(--line);border-radius:8px;
padding:16px 20px;margin:16px 0}svg{width:100%;height:auto;display:block}table{border-collapse:collapse;width:100%}
td,th{padding:4px 10px 4px 0;text-align:left;border-bottom:1px solid #eaeef2;vertical-align:top}
th{color:var(--soft);font-weight:600}td.n{font-variant-numeric:tabular-nums;white-space:nowrap}
.pass{color:var(--good);font-weight:600}.fail{color:var(--bad);font-weight:600}
.chip{display:inline-block;padding:3px 12px;border-radius:20px;color:#fff;font-weight:600;margin-right:8px}
.chip.pass{background:var(--good);color:#fff}.chip.fail{background:var(--bad);color:#fff}
.events{max-height:440px;overflow:auto}.ERROR,.CRITICAL,.ALERT,.EMERGENCY{color:var(--bad);font-weight:600}
.WARNING{color:#9a6700;font-weight:600}nav a{margin-right:14px;color:#0969da;text-decoration:none}
#story td:first-child,#events td:first-child{width:1%}
pre{overflow:auto;max-height:420px;font-size:12px}@media print{.events{max-height:none}section{break-inside:avoid}}
"""


def make_page(flight: Flight, limits: Limits | None = None) -> str:
    """The whole report."""
    verdicts = judge(flight, limits or Limits())
    drawn = [(title, caption, made) for title, caption, draw in plots.PLOTS if (made := draw(flight)) is not None]
    sections = [_summary(flight, verdicts), _story(flight.events)]
    sections += [_section(title, caption, plots.as_svg(made)) for title, caption, made in drawn]
    sections += [_orders(flight.events), _events(flight.events)]
    if flight.plan:
        sections.append(_plan(flight))
    if flight.settings:
        shown = html.escape(json.dumps(flight.settings, indent=1, default=str))
        sections.append(
            f"<section id=settings><details><summary>Settings in force</summary><pre>{shown}</pre></details></section>"
        )
    links = "".join(f'<a href="#{_anchor(title)}">{html.escape(title)}</a>' for title, _, _ in drawn)
    nav = (
        f"<nav><a href='#story'>What happened</a>{links}<a href='#orders'>Orders</a><a href='#events'>Events</a></nav>"
    )
    return document(flight.title, f"{_head(flight, verdicts)}{nav}{''.join(sections)}")


def document(title: str, body: str) -> str:
    """A whole page in the reports' style around ``body`` (HTML)."""
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title><style>{_STYLE}</style></head><body><main>{body}</main></body></html>\n"
    )


def chips(held: int, failed: int) -> str:
    """How much holds and how much does not, in colour."""
    bad = f'<span class="chip fail">{failed} failed</span>' if failed else ""
    good = f'<span class="chip pass">{held} within limits</span>' if held else ""
    return bad + good


def _head(flight: Flight, verdicts: Sequence[Verdict]) -> str:
    failed = sum(verdict.ok is False for verdict in verdicts)
    held = sum(verdict.ok is True for verdict in verdicts)
    facts = " · ".join(
        html.escape(text)
        for text in (
            f"scenario {flight.about['scenario']}" if "scenario" in flight.about else "",
            f"seed {flight.about['seed']}" if "seed" in flight.about else "",
            flight.about.get("vehicle", ""),
            flight.about.get("start", ""),
            clock(flight.duration_s),
            flight.source,
            f"version {flight.about['version']}" if "version" in flight.about else "",
        )
        if text
    )
    return f"<h1>{html.escape(flight.title)}</h1><p class=soft>{facts}</p><p>{chips(held, failed)}</p>"


def _summary(flight: Flight, verdicts: Sequence[Verdict]) -> str:
    rows = "".join(
        f"<tr><td>{html.escape(item.name)}<td class=n>{html.escape(item.value)}<td class=n>{html.escape(item.limit)}"
        f"<td class={'pass' if item.ok else 'fail'}>{ {True: 'holds', False: 'fails', None: ''}[item.ok] }"
        for item in verdicts
    )
    notes = "".join(f"<p class=soft>Note: {html.escape(note)}.</p>" for note in flight.notes)
    return f"<section id=summary><h2>Summary</h2><table><tr><th>What<th>Found<th>Limit<th></tr>{rows}</table>{notes}</section>"


def _story(events: Sequence[Event]) -> str:
    moments = tell(events)
    shown = weightiest(moments)
    rows = "".join(
        f"<tr class={html.escape(item.severity)}><td class=n>{clock(item.t_s)}<td>{html.escape(item.text)}"
        for item in shown
    )
    more = f", and {len(moments) - len(shown)} of less weight" if len(moments) > len(shown) else ""
    caption = f"The turning points{more}; everything is under Events."
    return (
        f"<section id=story><h2>What happened</h2><p class=soft>{caption}</p>"
        f"<table><tr><th>Time<th></tr>{rows}</table></section>"
    )


def _orders(events: Sequence[Event]) -> str:
    """Who ordered what. A system number is a claim; in brackets stands what proved it."""
    orders = [event for event in events if event.kind == "order"]
    rows = "".join(
        f"<tr><td class=n>{clock(event.t_s)}.{int(event.t_s * 10) % 10}<td>{html.escape(event.text)}"
        for event in orders[-MAX_ORDERS:]
    )
    more = f", the last {MAX_ORDERS} of {len(orders)}" if len(orders) > MAX_ORDERS else ""
    caption = (
        f"Every order that reached the vessel{more}: who gave it, over which link, what proved it, what came of it."
    )
    return (
        f"<section id=orders><h2>Orders</h2><p class=soft>{caption if orders else 'No order was recorded.'}</p>"
        f"<div class=events><table><tr><th>Time<th></tr>{rows}</table></div></section>"
    )


def _section(title: str, caption: str, svg: str) -> str:
    return f'<section id="{_anchor(title)}"><h2>{html.escape(title)}</h2><p class=soft>{html.escape(caption)}</p>{svg}</section>'


def _events(events: Sequence[Event]) -> str:
    ordered = sorted(events, key=lambda event: event.t_s)
    left_out = ""
    if len(ordered) > MAX_EVENTS:
        worst = [event for event in ordered if event.severity not in ("INFO", "DEBUG")][:MAX_EVENTS]
        others = [event for event in ordered if event.severity in ("INFO", "DEBUG")][: MAX_EVENTS - len(worst)]
        left_out = f"<p class=soft>{len(ordered) - len(worst) - len(others)} events of no weight are left out.</p>"
        ordered = sorted([*worst, *others], key=lambda event: event.t_s)
    rows = "".join(
        f"<tr class={html.escape(event.severity)}><td class=n>{clock(event.t_s)}.{int(event.t_s * 10) % 10}"
        f"<td>{html.escape(event.kind)}<td>{html.escape(event.text)}"
        for event in ordered
    )
    return (
        f"<section id=events><h2>Events</h2>{left_out}<div class=events><table><tr><th>Time<th>What<th></tr>{rows}"
        "</table></div></section>"
    )


def _plan(flight: Flight) -> str:
    rows = "".join(
        f"<tr><td class=n>{number}<td class=n>{item.command}<td class=n>{item.x * 1e-7:.7f}<td class=n>{item.y * 1e-7:.7f}"
        f"<td class=n>{item.param1:g}<td class=n>{item.param2:g}<td class=n>{item.param3:g}<td class=n>{item.param4:g}"
        for number, item in enumerate(flight.plan)
    )
    return (
        "<section id=plan><details><summary>Plan</summary><table><tr><th>Item<th>Command<th>Latitude<th>Longitude"
        f"<th>p1<th>p2<th>p3<th>p4</tr>{rows}</table></details></section>"
    )


def _anchor(title: str) -> str:
    return title.lower().replace(" ", "-")
