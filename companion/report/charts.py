"""The curves of a report as data, chart by chart: what a browser draws and lets somebody zoom into. No drawing here."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from .flight import Flight, Series, Span
from .shapes import PALETTE, PASTEL, STATE_COLOURS
from .verdicts import split_cross_track

_LIMIT: Final = "#cf222e"
_TRUTH: Final = "#8c959f"


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve. ``style``: line, wide (drawn under the others), dash, or step (a value holds until the next)."""

    label: str
    series: Series
    colour: str
    style: str = "line"
    wraps: bool = False
    """A heading: shown in 0...360, with a break where it would cross the picture."""


@dataclass(frozen=True, slots=True)
class Panel:
    """Curves over one vertical axis, with states shaded behind. ``low``, ``high``: ends of the axis that are given."""

    label: str
    curves: tuple[Curve, ...]
    bands: tuple[tuple[Span, str], ...] = ()
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, slots=True)
class StateRow:
    """States that held one after another, each with its colour."""

    label: str
    spans: tuple[tuple[Span, str], ...]


@dataclass(frozen=True, slots=True)
class Chart:
    """A titled picture over time: panels with curves, or rows of states."""

    title: str
    caption: str
    panels: tuple[Panel, ...] = ()
    rows: tuple[StateRow, ...] = ()


def charts(flight: Flight) -> list[Chart]:
    """Every chart that has something to show, in the order of the report."""
    made = (draw(flight) for draw in _DRAWN)
    return [chart for chart in made if chart.rows or any(panel.curves for panel in chart.panels)]


def _curves(*wanted: tuple[str, Series | None, str, str]) -> tuple[Curve, ...]:
    return tuple(Curve(label, series, colour, style) for label, series, colour, style in wanted if series)


def _states(flight: Flight) -> Chart:
    kinds = [kind for kind in ("mode", "armed", "plan_state", "guard", "action") if flight.spans.get(kind)]
    rows = tuple(StateRow(kind.replace("_", " "), _coloured(flight.spans[kind])) for kind in kinds)
    return Chart("States", "What was in force when.", rows=rows)


def _coloured(spans: Sequence[Span]) -> tuple[tuple[Span, str], ...]:
    names = sorted({span.value for span in spans})
    return tuple(
        (span, STATE_COLOURS.get(span.value) or PASTEL[names.index(span.value) % len(PASTEL)]) for span in spans[:2000]
    )


def _path(flight: Flight) -> Chart:
    lines, circles = split_cross_track(flight)
    known = sorted(abs(value) for value in (*lines.known(), *circles.known()))
    span = max(1.0, min(known[int(0.98 * (len(known) - 1))] * 1.5, 50.0)) if known else 1.0
    curves = _curves(
        ("cross-track error on lines", lines, PALETTE[0], "line"),
        ("radius error on circles", circles, PALETTE[1], "line"),
    )
    return Chart("Path", "Distance from the planned path.", (Panel("m, starboard +", curves, low=-span, high=span),))


def _control(flight: Flight) -> Chart:
    of = flight.series.get
    heading = _curves(
        ("reference", of("heading_ref_deg"), PALETTE[1], "wide"), ("heading", of("heading_deg"), PALETTE[0], "line")
    )
    heading = tuple(dataclasses.replace(curve, wraps=True) for curve in heading)
    speed = _curves(
        ("reference", of("speed_ref_mps"), PALETTE[1], "wide"),
        ("speed", of("speed_mps") or of("sog_mps"), PALETTE[0], "line"),
    )
    panels = (Panel("heading, °", heading, low=0.0, high=360.0), Panel("speed, m/s", speed))
    return Chart("Heading and speed", "What was asked, and what came of it.", _filled(panels))


def broken(t: Sequence[float], v: Sequence[float]) -> tuple[list[float], list[float]]:
    """Headings wrapped to 0...360, with a break where the curve would cross the whole picture."""
    out_t: list[float] = []
    out_v: list[float] = []
    last = math.nan
    for at, value in zip(t, v, strict=True):
        wrapped = value % 360.0
        if abs(wrapped - last) > 180.0:
            out_t.append(at)
            out_v.append(math.nan)
        out_t.append(at)
        out_v.append(wrapped)
        last = wrapped
    return out_t, out_v


def _actuators(flight: Flight) -> Chart:
    of, caption = flight.series.get, "What went out to thrusters and rudders."
    # The port side lies wide under the other, so that both are seen where they are equal.
    sides = (("port", "wide", PALETTE[3]), ("starboard", "line", PALETTE[2]))
    thrust = _curves(*((side, of(f"thruster_{side}"), colour, style) for side, style, colour in sides))
    rudder = _curves(*((side, of(f"rudder_{side}_deg"), colour, style) for side, style, colour in sides))
    if thrust or rudder:
        return Chart("Actuators", caption, _filled((Panel("thrust, −1…1", thrust), Panel("rudder, °", rudder))))
    names = [f"servo{number}_us" for number in range(1, 5)]
    servos = _curves(*((name[:6], of(name), colour, "line") for name, colour in zip(names, PALETTE, strict=False)))
    return Chart("Actuators", caption, (Panel("pulse, µs", servos),))


def _depth(flight: Flight) -> Chart:
    of = flight.series.get
    altitude = of("altitude_m")
    guard = [span for span in flight.spans.get("guard", []) if span.value != "OK" and span.value in STATE_COLOURS]
    curves = _curves(
        ("truth", of("true_altitude_m"), _TRUTH, "wide"),
        ("under the keel" if altitude else "depth", altitude or of("depth_m"), PALETTE[0], "line"),
        ("limit", of("altitude_limit_m"), _LIMIT, "dash"),
    )
    bands = tuple((span, STATE_COLOURS[span.value]) for span in guard[:2000])
    caption = "Water under the keel, the guard's limit, and the guard's states (shaded)."
    return Chart("Depth", caption, (Panel("water, m", curves, bands, low=0.0),))


def _links(flight: Flight) -> Chart:
    panels = []
    for link in flight.links:
        if link.per_second:
            seconds = [float(second) for second in range(max(link.per_second) + 1)]
            rates = [
                Series(seconds, [float(link.per_second.get(int(second), [0, 0])[side]) for second in seconds])
                for side in (0, 1)
            ]
            curves = _curves(
                ("from the vehicle", rates[0], PALETTE[0], "line"), ("to the vehicle", rates[1], PALETTE[1], "line")
            )
            panels.append(Panel(f"{link.name}, B/s", curves, low=0.0))
    return Chart("Links", "Traffic on each telemetry link.", tuple(panels))


def _airtime(flight: Flight) -> Chart:
    spent, limit_s = flight.series.get("airtime_hour_s"), flight.airtime_limit_s
    curves = _curves(("transmissions in the last hour", spent, PALETTE[0], "step"))
    if curves and limit_s is not None:
        curves += (Curve("limit of the band", Series([0.0, flight.duration_s], [limit_s, limit_s]), _LIMIT, "dash"),)
    caption = "What the radio was given to send, by the module's modulation, in a sliding hour."
    return Chart("Airtime", caption, (Panel("airtime, s", curves, low=0.0),))


def _power(flight: Flight) -> Chart:
    names = (("voltage_v", "battery, V"), ("load", "load, share"))
    found = [Panel(label, _curves((label, flight.series.get(name), PALETTE[0], "line"))) for name, label in names]
    return Chart("Power and load", "Battery voltage and the share of the tick that was used.", _filled(found))


def _filled(panels: Sequence[Panel]) -> tuple[Panel, ...]:
    return tuple(panel for panel in panels if panel.curves)


_DRAWN: Final[tuple[Callable[[Flight], Chart], ...]] = (
    _states,
    _path,
    _control,
    _actuators,
    _depth,
    _links,
    _airtime,
    _power,
)
