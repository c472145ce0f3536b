"""Figures of a heading loop: root locus, Bode with margins, and python-control's sisotool, as pictures."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any


def draw(loop: Any, folder: Path, title: str) -> list[Path]:
    """Write rootlocus.png, bode.png and sisotool.png of a loop transfer function; return their paths."""
    import control
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    folder.mkdir(parents=True, exist_ok=True)
    made = []
    plots: tuple[tuple[str, Callable[[], Any]], ...] = (
        ("rootlocus", lambda: control.root_locus_plot(loop, grid=True)),
        ("bode", lambda: control.bode_plot(loop, display_margins=True)),
        ("sisotool", lambda: control.sisotool(loop)),
    )
    for name, plot in plots:
        pyplot.figure(figsize=(9, 7))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # matplotlib's remarks on axes that python-control sets
            plot()
        pyplot.gcf().suptitle(title)
        made.append(folder / f"{name}.png")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            pyplot.savefig(made[-1], dpi=100)
        pyplot.close("all")
    return made
