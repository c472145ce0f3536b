"""The report as one HTML file that needs nothing else: style, data and the script that draws them are inside."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from mavlink_bridge.language.units import e7_to_deg

from . import encounters
from .charts import charts
from .embed import embedded
from .flight import Event, Flight
from .map_data import map_data
from .story import tell, weightiest
from .verdicts import WORDS, RunLimits, SummaryLine, clock, judge, moment

MAX_EVENTS: Final = 1500
MAX_ORDERS: Final = 500
_HERE: Final = Path(__file__).resolve().parent
_POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"
"""For the browser: nothing from anywhere, whatever stands in a run's texts."""
_TIME_BAR: Final = (
    "<div id=time hidden><div><output></output>"
    '<input type=range min=0 max=1 step=0.1 value=0 aria-label="time in the run">'
    '<button type=button data-do=out aria-label="show more time">−</button>'
    '<button type=button data-do=in aria-label="show less time">+</button>'
    '<button type=button data-do=whole aria-label="show the whole run">all</button></div></div>'
)


def make_page(flight: Flight, limits: RunLimits | None = None) -> str:
    """The whole report."""
    verdicts = judge(flight, limits or RunLimits())
    drawn, track = charts(flight), map_data(flight)
    sections = [_summary(flight, verdicts), _story(flight.events)]
    if track is not None:
        sections.append(_section("Track", "Where it went, over plan, fence and chart.", "data-map"))
    sections += [_section(item.title, item.caption, f"data-chart={number}") for number, item in enumerate(drawn)]
    met = encounters.sections(flight.vessels)
    sections += [met, _orders(flight.events), _events(flight.events)]
    if flight.plan:
        sections.append(_plan(flight))
    if flight.settings:
        shown = html.escape(json.dumps(flight.settings, indent=1, default=str))
        sections.append(
            f"<section id=settings><details><summary>Settings in force</summary><pre>{shown}</pre></details></section>"
        )
    titles = [*(["Track"] if track is not None else []), *(item.title for item in drawn)]
    links = "".join(f'<a href="#{_anchor(title)}">{html.escape(title)}</a>' for title in titles)
    links += "<a href='#meetings'>Meetings</a>" if met else ""
    nav = (
        f"<nav><a href='#story'>What happened</a>{links}<a href='#orders'>Orders</a><a href='#events'>Events</a></nav>"
    )
    script = (
        "<noscript><p>The charts and the map are drawn by the page itself, and need scripts.</p></noscript>"
        f'{_TIME_BAR}<script type="application/json" id=data>{embedded(flight, drawn, track)}</script>'
        f"<script id=drawing>{(_HERE / 'report.js').read_text(encoding='utf-8')}</script>"
    )
    return document(flight.title, f"{_head(flight, verdicts)}{nav}{''.join(sections)}", script)


def document(title: str, body: str, after: str = "") -> str:
    """A whole page in the reports' style around ``body`` (HTML); ``after``: what stands behind the main part."""
    style = (_HERE / "report.css").read_text(encoding="utf-8")
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title><style>{style}</style></head><body><main>{body}</main>{after}</body></html>\n"
    )


def chips(held: int, failed: int) -> str:
    """How much holds and how much does not, in colour."""
    bad = f'<span class="chip fail">{failed} failed</span>' if failed else ""
    good = f'<span class="chip pass">{held} within limits</span>' if held else ""
    return bad + good


def _head(flight: Flight, verdicts: Sequence[SummaryLine]) -> str:
    failed = sum(verdict.ok is False for verdict in verdicts)
    held = sum(verdict.ok is True for verdict in verdicts)
    facts = " · ".join(
        html.escape(text)
        for text in (
            f"scenario {flight.about['scenario']}" if "scenario" in flight.about else "",
            f"seed {flight.about['seed']}" if "seed" in flight.about else "",
            flight.about.get("vehicle", ""),
            _start(flight),
            clock(flight.duration_s),
            flight.source,
            f"version {flight.about['version']}" if "version" in flight.about else "",
        )
        if text
    )
    return f"<h1>Report of {html.escape(flight.title)}</h1><p class=soft>{facts}</p><p>{chips(held, failed)}</p>"


def _start(flight: Flight) -> str:
    """When it began; a simulation has a calendar of its own."""
    start = flight.about.get("start", "")
    return f"simulated time {start}" if start and flight.about.get("world_kind") == "simulated" else start


def _summary(flight: Flight, verdicts: Sequence[SummaryLine]) -> str:
    rows = "".join(
        f"<tr><td>{html.escape(item.name)}<td class=n>{html.escape(item.value)}<td class=n>{html.escape(item.limit)}"
        f"<td class={'pass' if item.ok else 'fail'}>{WORDS[item.ok]}"
        for item in verdicts
    )
    notes = "".join(f"<p class=soft>Note: {html.escape(note)}.</p>" for note in flight.notes)
    return f"<section id=summary><h2>Summary</h2><table><tr><th>What<th>Found<th>Limit<th></tr>{rows}</table>{notes}</section>"


def _story(events: Sequence[Event]) -> str:
    moments = tell(events)
    shown = weightiest(moments)
    rows = "".join(
        f"<tr class={html.escape(item.severity)}><td class=n>{moment(item.t_s)}<td>{html.escape(item.text)}"
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
        f"<tr><td class=n>{moment(event.t_s, tenths=True)}<td>{html.escape(event.text)}"
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


def _section(title: str, caption: str, drawn_by: str) -> str:
    head = f"<h2>{html.escape(title)}</h2><p class=soft>{html.escape(caption)}</p>"
    return f'<section id="{_anchor(title)}">{head}<div {drawn_by}></div></section>'


def _events(events: Sequence[Event]) -> str:
    ordered = sorted(events, key=lambda event: event.t_s)
    left_out = ""
    if len(ordered) > MAX_EVENTS:
        worst = [event for event in ordered if event.severity not in ("INFO", "DEBUG")][:MAX_EVENTS]
        others = [event for event in ordered if event.severity in ("INFO", "DEBUG")][: MAX_EVENTS - len(worst)]
        left_out = f"<p class=soft>{len(ordered) - len(worst) - len(others)} events of no weight are left out.</p>"
        ordered = sorted([*worst, *others], key=lambda event: event.t_s)
    rows = "".join(
        f"<tr class={html.escape(event.severity)}><td class=n>{moment(event.t_s, tenths=True)}"
        f"<td>{html.escape(event.kind)}<td>{html.escape(event.text)}"
        for event in ordered
    )
    return (
        f"<section id=events><h2>Events</h2>{left_out}<div class=events><table><tr><th>Time<th>What<th></tr>{rows}"
        "</table></div></section>"
    )


def _plan(flight: Flight) -> str:
    rows = "".join(
        f"<tr><td class=n>{number}<td class=n>{item.command}<td class=n>{e7_to_deg(item.x):.7f}<td class=n>{e7_to_deg(item.y):.7f}"
        f"<td class=n>{item.param1:g}<td class=n>{item.param2:g}<td class=n>{item.param3:g}<td class=n>{item.param4:g}"
        for number, item in enumerate(flight.plan)
    )
    return (
        "<section id=plan><details><summary>Plan</summary><div class=wide-table><table><tr><th>Item<th>Command<th>Latitude<th>Longitude"
        f"<th>p1<th>p2<th>p3<th>p4</tr>{rows}</table></div></details></section>"
    )


def _anchor(title: str) -> str:
    return title.lower().replace(" ", "-")
