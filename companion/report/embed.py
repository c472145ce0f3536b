"""What the page's script draws, as JSON: curves in whole steps and as differences, so that a long run stays a small file."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any, Final

from .charts import Chart, Curve, Panel, StateRow, broken
from .flight import Flight, Span, thin

POINTS: Final = 4000
"""Of a curve; thinned, each bucket keeps its extremes. Two hours are then a point per 3.6 s."""
_STEPS: Final = 5000
"""A curve's range in whole steps: ten times as fine as a screen's pixels."""
_LEAST_SPREAD: Final = 1.0
"""A curve that hardly moves needs no finer steps than one that moves by this."""


def embedded(flight: Flight, charts: Sequence[Chart], chart_map: dict[str, Any] | None) -> str:
    """The whole as text that may stand inside a script element."""
    content = {
        "duration_s": round(max(flight.duration_s, 1.0), 2),
        "charts": [_chart(chart) for chart in charts],
        "map": chart_map,
        "modes": [[round(span.start, 2), span.value] for span in flight.spans.get("mode", [])[:2000]],
    }
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text.replace("<", "\\u003c")


def _chart(chart: Chart) -> dict[str, Any]:
    return {
        "title": chart.title,
        "panels": [_panel(panel) for panel in chart.panels if panel.curves],
        "rows": [_row(row) for row in chart.rows],
    }


def _panel(panel: Panel) -> dict[str, Any]:
    bands = [_span(span, colour) for span, colour in panel.bands]
    curves = [_curve(curve) for curve in panel.curves]
    return {"label": panel.label, "curves": curves, "bands": bands, "low": panel.low, "high": panel.high}


def _row(row: StateRow) -> dict[str, Any]:
    return {"label": row.label, "spans": [_span(span, colour) for span, colour in row.spans]}


def _span(span: Span, colour: str) -> list[Any]:
    return [round(span.start, 2), round(span.end, 2), span.value, colour]


def _curve(curve: Curve) -> dict[str, Any]:
    t, v = thin(curve.series.t, curve.series.v, POINTS)
    if curve.wraps:
        t, v = broken(t, v)
    step = _step(v)
    values = [None if math.isnan(value) else round(value / step) for value in v]
    told = {"label": curve.label, "colour": curve.colour, "style": curve.style, "step": step}
    return {**told, "t": differences([round(at * 100.0) for at in t]), "v": differences(values)}


def _step(values: Sequence[float]) -> float:
    known = [value for value in values if not math.isnan(value)]
    spread = max(known) - min(known)
    return float(f"1e{math.floor(math.log10(max(spread, _LEAST_SPREAD) / _STEPS))}")


def differences(values: Sequence[int | None]) -> list[int | None]:
    """Each known value less the known one before it; None stays."""
    out: list[int | None] = []
    last = 0
    for value in values:
        out.append(None if value is None else value - last)
        last = last if value is None else value
    return out
