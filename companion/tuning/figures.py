"""Figures of a heading loop: root locus, Bode with margins, and python-control's sisotool, as pictures."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from ..io.whole_file import filled_folder, whole_file

_PADE_ORDER: Final = 3
"""Of the delay: good to ten times the crossover, and few enough poles for a picture."""
_FAST_RADPS: Final = 8.0
"""Closed-loop poles beyond are actuators and delay: they do not show how the hull turns."""


def _nobody(done: int, total: int) -> None:
    """Nobody looks."""


def draw(
    loop: Any, folder: Path, title: str, delay_s: float = 0.0, *, told: Callable[[int, int], None] = _nobody
) -> list[Path]:
    """Write rootlocus.png, bode.png and sisotool.png of a loop with a delay in it; return their paths.

    ``told``: is given how many are done, of how many.
    """
    import control
    import matplotlib

    matplotlib.use("Agg")

    # remarks on axes that python-control sets
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    loop = delayed(loop, delay_s)
    poles = control.feedback(loop, 1).poles()
    reach = view_radps(poles)
    x, y = (-reach, 0.5 * reach), (-reach, reach)
    made: list[Path] = []
    plots: tuple[tuple[str, Callable[[], Any]], ...] = (
        ("rootlocus", lambda: _root_locus(loop, poles, x, y)),
        ("bode", lambda: control.bode_plot(loop, display_margins=True)),
        ("sisotool", lambda: control.sisotool(loop, xlim_rlocus=x, ylim_rlocus=y, rlocus_grid=False)),
    )
    with filled_folder(folder):
        for name, plot in plots:
            told(len(made), len(plots))
            made.append(_picture(folder / f"{name}.png", title, plot))
    return made


def _picture(path: Path, title: str, plot: Callable[[], Any]) -> Path:
    """Draw one and write it, whole or not at all."""
    from matplotlib import pyplot

    pyplot.figure(figsize=(9, 7))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        plot()
    pyplot.gcf().suptitle(title)
    try:
        with warnings.catch_warnings(), whole_file(path) as beside:
            warnings.simplefilter("ignore")
            pyplot.savefig(beside, dpi=100, format="png")
    finally:
        pyplot.close("all")
    return path


def delayed(loop: Any, delay_s: float) -> Any:
    """The loop with its delay as a Padé fraction: a locus needs poles."""
    import control

    return control.ss(control.tf(*control.pade(delay_s, _PADE_ORDER))) * loop if delay_s > 0.0 else loop


def view_radps(poles: Any) -> float:
    """How far a picture reaches around the closed loop's poles that show how the hull turns."""
    near = [abs(pole) for pole in poles if abs(pole) <= _FAST_RADPS]
    return 1.5 * max(near, default=_FAST_RADPS)


def _root_locus(loop: Any, poles: Any, x: tuple[float, float], y: tuple[float, float]) -> None:
    """The locus for gains from a hundredth to a hundred times; squares where the loop is as it stands."""
    import control
    import numpy
    from matplotlib import pyplot

    control.root_locus_plot(loop, gains=numpy.logspace(-2, 2, 2000), grid=False, xlim=x, ylim=y)
    axes = pyplot.gca()
    (squares,) = axes.plot(poles.real, poles.imag, "ks", fillstyle="none", label="closed loop as it stands")
    axes.set_xlim(*x)
    axes.set_ylim(*y)
    axes.grid(visible=True, alpha=0.4)
    axes.legend(handles=[squares], loc="upper right")
