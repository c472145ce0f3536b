"""Figures by matplotlib: the map as a picture file, and a campaign's dots. Loaded only when one of them is made."""

from __future__ import annotations

import io
import re
from typing import Any, Final

WIDTH_IN: Final = 9.6


def figure(height_in: float, rows: int = 1, **options: Any) -> tuple[Any, list[Any]]:
    """A figure without any window system behind it, and its axes."""
    from matplotlib.figure import Figure

    made = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    axes = made.subplots(rows, 1, squeeze=False, **options)
    found = [row[0] for row in axes]
    for ax in found:
        ax.grid(True, color="#d8dee4", linewidth=0.6)
        ax.spines[["top", "right"]].set_visible(False)
    return made, found


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
