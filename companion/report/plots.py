"""The pictures of a report, drawn by matplotlib as SVG text. Loaded only when a report is made."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Sequence
from typing import Any, Final

from .chart import PALETTE, PASTEL, STATE_COLOURS, figure
from .flight import Flight, Series, Span, thin
from .map_plot import draw_map
from .verdicts import split_cross_track


def as_svg(made: Any) -> str:
    """The figure as an SVG element to put into a page."""
    import matplotlib

    with matplotlib.rc_context({"svg.fonttype": "none", "font.family": "sans-serif", "path.simplify_threshold": 0.3}):
        out = io.StringIO()
        made.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    text = text[text.index("<svg") :]
    # Paths need no more than a hundredth of a point; it halves the file.
    return re.sub(r' d="[^"]*"', lambda path: re.sub(r"(\.\d\d)\d+", r"\1", path[0]), text)


def as_png(made: Any, dpi: int = 110) -> bytes:
    """The figure as a PNG file (the README's picture)."""
    out = io.BytesIO()
    made.savefig(out, format="png", dpi=dpi)
    return out.getvalue()


def _line(ax: Any, series: Series | None, label: str, colour: str, **options: Any) -> bool:
    if not series:
        return False
    t, v = thin(series.t, series.v)
    if options.pop("wraps", False):
        t, v = broken(t, v)
    ax.plot(
        [value / 60.0 for value in t], v, label=label, color=colour, linewidth=options.pop("linewidth", 1.1), **options
    )
    return True


def _finish(ax: Any, ylabel: str, legend: bool = True) -> None:
    ax.set_ylabel(ylabel)
    if legend and ax.get_legend_handles_labels()[0]:
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), fontsize=8, frameon=False, ncols=4)


def _time_axis(axes: Sequence[Any], flight: Flight) -> None:
    axes[-1].set_xlabel("time, minutes")
    for ax in axes:
        ax.set_xlim(0, max(flight.duration_s, 1.0) / 60.0)


def draw_path(flight: Flight) -> Any | None:
    """Cross-track error on lines and radius error on circles."""
    lines, circles = split_cross_track(flight)
    if not lines and not circles:
        return None
    made, (ax,) = figure(2.4)
    _line(ax, lines, "cross-track error on lines", PALETTE[0])
    _line(ax, circles, "radius error on circles", PALETTE[1])
    known = [abs(value) for value in (*lines.known(), *circles.known())]
    span = max(1.0, min(sorted(known)[int(0.98 * (len(known) - 1))] * 1.5, 50.0))
    ax.set_ylim(-span, span)
    _finish(ax, "error, m (starboard +)")
    _time_axis([ax], flight)
    return made


def draw_control(flight: Flight) -> Any | None:
    """Heading and speed against their references."""
    heading, speed = flight.series.get("heading_deg"), flight.series.get("speed_mps") or flight.series.get("sog_mps")
    if not heading and not speed:
        return None
    made, (top, bottom) = figure(4.4, 2, sharex=True)
    _line(top, flight.series.get("heading_ref_deg"), "reference", PALETTE[1], linewidth=1.6, wraps=True)
    _line(top, heading, "heading", PALETTE[0], wraps=True)
    _finish(top, "heading, °")
    _line(bottom, flight.series.get("speed_ref_mps"), "reference", PALETTE[1], linewidth=1.6)
    _line(bottom, speed, "speed", PALETTE[0])
    _finish(bottom, "speed, m/s")
    _time_axis([top, bottom], flight)
    return made


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


def draw_actuators(flight: Flight) -> Any | None:
    """What the actuators were told."""
    names = [name for name in ("thruster_port", "thruster_starboard") if flight.series.get(name)]
    if not names:
        servos = [name for name in (f"servo{number}_us" for number in range(1, 5)) if flight.series.get(name)]
        if not servos:
            return None
        made, (ax,) = figure(2.6)
        for name, colour in zip(servos, PALETTE, strict=False):
            _line(ax, flight.series[name], name.replace("_us", ""), colour)
        _finish(ax, "pulse, µs")
        _time_axis([ax], flight)
        return made
    made, (top, bottom) = figure(4.2, 2, sharex=True)
    for side, colour in (("port", PALETTE[3]), ("starboard", PALETTE[2])):
        _line(top, flight.series.get(f"thruster_{side}"), side, colour)
        _line(bottom, flight.series.get(f"rudder_{side}_deg"), side, colour)
    _finish(top, "thrust, −1…1")
    _finish(bottom, "rudder, °")
    _time_axis([top, bottom], flight)
    return made


def draw_depth(flight: Flight) -> Any | None:
    """Water under the keel against the guard's limit, with the guard's states behind."""
    altitude = flight.series.get("altitude_m")
    if not altitude and not flight.series.get("depth_m"):
        return None
    made, (ax,) = figure(2.6)
    for span in flight.spans.get("guard", []):
        colour = STATE_COLOURS.get(span.value)
        if colour and span.value not in ("OK",):
            ax.axvspan(span.start / 60.0, max(span.end, span.start + 1.0) / 60.0, color=colour, alpha=0.25, linewidth=0)
    _line(ax, flight.series.get("true_altitude_m"), "truth", "#57606a", linewidth=2.0, alpha=0.5)
    _line(ax, altitude or flight.series.get("depth_m"), "under the keel" if altitude else "depth", PALETTE[0])
    _line(ax, flight.series.get("altitude_limit_m"), "limit", "#cf222e", linestyle="--")
    ax.set_ylim(bottom=0)
    _finish(ax, "water, m")
    _time_axis([ax], flight)
    return made


def draw_states(flight: Flight) -> Any | None:
    """Which states held when."""
    kinds = [kind for kind in ("mode", "armed", "plan_state", "guard", "action") if flight.spans.get(kind)]
    if not kinds:
        return None
    made, (ax,) = figure(0.6 + 0.42 * len(kinds))
    for row, kind in enumerate(reversed(kinds)):
        _bars(ax, row, flight.spans[kind], flight.duration_s)
    _name_colours(ax, flight, kinds)
    ax.set_yticks(range(len(kinds)), [kind.replace("_", " ") for kind in reversed(kinds)])
    ax.grid(visible=False, axis="y")
    _time_axis([ax], flight)
    return made


def _name_colours(ax: Any, flight: Flight, kinds: list[str]) -> None:
    """A legend for the rows whose bars are too short to carry their names."""
    from matplotlib.patches import Patch

    shown: dict[str, str] = {}
    for kind in kinds:
        spans = flight.spans[kind]
        names = sorted({span.value for span in spans})
        if len(spans) > 8:
            shown.update({name: _state_colour(name, names) for name in names})
    if shown:
        handles = [Patch(color=colour, label=name.lower()) for name, colour in shown.items()]
        ax.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 0.98), fontsize=7.5, frameon=False, ncols=10)


def _state_colour(name: str, names: list[str]) -> str:
    return STATE_COLOURS.get(name) or PASTEL[names.index(name) % len(PASTEL)]


def _bars(ax: Any, row: int, spans: list[Span], duration_s: float) -> None:
    names = sorted({span.value for span in spans})
    for span in spans[:2000]:
        colour = _state_colour(span.value, names)
        width = max(span.end - span.start, duration_s / 600.0) / 60.0
        ax.broken_barh([(span.start / 60.0, width)], (row - 0.36, 0.72), facecolors=colour, linewidth=0)
        if span.end - span.start > 0.045 * max(duration_s, 1.0):
            ax.text(
                (span.start + span.end) / 120.0, row, span.value, ha="center", va="center", fontsize=7.5, clip_on=True
            )


def draw_links(flight: Flight) -> Any | None:
    """Bytes in each second, both directions."""
    links = [link for link in flight.links if link.per_second]
    if not links:
        return None
    made, axes = figure(0.5 + 1.35 * len(links), len(links), sharex=True)
    for ax, link in zip(axes, links, strict=True):
        seconds = list(range(max(link.per_second) + 1))
        for side, label, colour in ((0, "from the vehicle", PALETTE[0]), (1, "to the vehicle", PALETTE[1])):
            rates = Series([float(s) for s in seconds], [float(link.per_second.get(s, [0, 0])[side]) for s in seconds])
            _line(ax, rates, label, colour)
        _finish(ax, f"{link.name}, B/s", legend=ax is axes[0])
        ax.set_ylim(bottom=0)
    _time_axis(axes, flight)
    return made


def draw_airtime(flight: Flight) -> Any | None:
    """Airtime of the last hour at each transmission, against the band's limit."""
    spent = flight.series.get("airtime_hour_s")
    if not spent:
        return None
    made, (ax,) = figure(2.2)
    _line(ax, spent, "vessel's transmissions in the last hour", PALETTE[0], drawstyle="steps-post")
    if flight.airtime_limit_s is not None:
        ax.axhline(flight.airtime_limit_s, color="#cf222e", linestyle="--", linewidth=1.2, label="limit of the band")
    ax.set_ylim(bottom=0)
    _finish(ax, "airtime, s")
    _time_axis([ax], flight)
    return made


def draw_power(flight: Flight) -> Any | None:
    """Battery and processor load."""
    names = [
        (name, label)
        for name, label in (("voltage_v", "battery, V"), ("load", "load, share"))
        if any(flight.of(name).known())
    ]
    if not names:
        return None
    made, axes = figure(0.6 + 1.3 * len(names), len(names), sharex=True)
    for ax, (name, label) in zip(axes, names, strict=True):
        _line(ax, flight.series[name], label, PALETTE[0])
        _finish(ax, label, legend=False)
    _time_axis(axes, flight)
    return made


PLOTS: Final[tuple[tuple[str, str, Callable[[Flight], Any | None]], ...]] = (
    ("Track", "Where it went, over plan and fence; dots show the depth found on the way.", draw_map),
    ("States", "What was in force when.", draw_states),
    ("Path", "Distance from the planned path.", draw_path),
    ("Heading and speed", "What was asked, and what came of it.", draw_control),
    ("Actuators", "What went out to thrusters and rudders.", draw_actuators),
    ("Depth", "Water under the keel, the guard's limit, and the guard's states (shaded).", draw_depth),
    ("Links", "Traffic on each telemetry link.", draw_links),
    ("Airtime", "What the radio was given to send, by the module's modulation, in a sliding hour.", draw_airtime),
    ("Power and load", "Battery voltage and the share of the tick that was used.", draw_power),
)
"""Title, caption, drawing; one that has nothing to show returns None."""
