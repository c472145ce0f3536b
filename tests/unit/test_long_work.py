"""Every command that may take long: on a terminal it says how far it is, in a pipe nothing, and Ctrl-C leaves no half file.

Each is begun in earnest with little to do, on a clock of its own that makes a second of each look at it.
"""

from __future__ import annotations

import itertools
import sys
import warnings
from io import StringIO

import pytest

from companion.cli import main
from companion.commands import progress
from companion.commands.progress import ProgressLine

SCENARIO = '[scenario]\ntitle = "At rest"\nduration_s = 3\n[[expect]]\nstays_neutral = true\n'
SOUNDINGS = "".join(f"{-8.7 + k * 1e-4:.4f} 41.18 6.5\n" for k in range(40))

COMMANDS = {
    # by its name: the words ("DIR" is where the test writes), and the files that it makes
    "simulation": ("sim --speed max --duration 4 --run-dir DIR/new", ()),
    "scenario": ("sim --scenario DIR/short.toml", ()),
    "encounters": ("sim --encounters imazu --count 2 --page DIR/page.html", ("page.html",)),
    "replay": ("replay RUN", ()),
    "report": ("report RUN -o DIR/report.html", ("report.html",)),
    "import of soundings": ("depth import DIR/new.db DIR/soundings.xyz", ("new.db",)),
    "export of soundings": ("depth export DIR/full.db DIR/out.xyz", ("out.xyz",)),
    "chart": ("depth convert DIR/chart.tif DIR/chart.xyz", ("chart.xyz",)),
    "gains": ("tune gains -o DIR/gains.toml", ("gains.toml",)),
    "figures": ("tune figures -o DIR/pictures", ("pictures/rootlocus.png", "pictures/sisotool.png")),
}


class Terminal(StringIO):
    def isatty(self):
        return True


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("long") / "run"
    assert main(["sim", "--speed", "max", "--duration", "6", "--json", "--run-dir", str(path)]) == 0
    return path


@pytest.fixture
def words(tmp_path, run, request, capsys):
    (tmp_path / "short.toml").write_text(SCENARIO)
    (tmp_path / "soundings.xyz").write_text(SOUNDINGS)
    line, files = COMMANDS[request.param]
    if request.param == "chart":
        chart(tmp_path / "chart.tif")
    if "full.db" in line:
        assert main(["depth", "import", str(tmp_path / "full.db"), str(tmp_path / "soundings.xyz")]) == 0
    capsys.readouterr()
    said = [word.replace("DIR", str(tmp_path)).replace("RUN", str(run)) for word in line.split()]
    return said, [tmp_path / name for name in files]


def chart(path):
    numpy = pytest.importorskip("numpy")
    rasterio = pytest.importorskip("rasterio")
    with warnings.catch_warnings():  # the library's own, of another library
        warnings.simplefilter("ignore")
        place = rasterio.transform.from_origin(-8.8, 41.3, 0.003, 0.003)
    options = {"driver": "GTiff", "height": 60, "width": 60, "count": 1, "dtype": "float32", "crs": "EPSG:4326"}
    with rasterio.open(path, "w", transform=place, **options) as made:
        made.write(numpy.full((60, 60), -9.0, "float32"), 1)
        made.update_tags(1, long_name="elevation")


def terminal(monkeypatch):
    """Standard error is a terminal, and a second goes by at each look at the clock."""
    seconds = itertools.count()
    monkeypatch.setitem(ProgressLine.__init__.__kwdefaults__, "clock_s", lambda: float(next(seconds)))
    monkeypatch.setattr(sys, "stderr", Terminal())
    return sys.stderr


SLOW = ("gains", "figures")
"""Seconds of one core from beginning to end; that they say how far they are is seen below, where they are broken off."""


@pytest.mark.parametrize(
    "words", [pytest.param(name, marks=[pytest.mark.soak] * (name in SLOW)) for name in COMMANDS], indirect=True
)
def test_on_a_terminal_it_says_how_far_and_takes_the_line_away(words, monkeypatch):
    said, files = words
    screen = terminal(monkeypatch)
    assert main(said) == 0
    shown = screen.getvalue()
    assert "\r" in shown
    assert "left" in shown or "times real time" in shown or "drawing" in shown
    assert not shown.rpartition("\r")[2].strip(), "taken away"
    assert all(file.stat().st_size for file in files)


@pytest.mark.parametrize("words", COMMANDS, indirect=True)
def test_in_a_pipe_it_is_quiet_and_control_c_gives_one_line_and_no_half_file(words, monkeypatch, capsys):
    said, files = words
    looks = itertools.count()

    def pressed(*_):
        if next(looks) == 2:
            raise KeyboardInterrupt

    for name in ("at", "count", "say", "update"):
        monkeypatch.setattr(progress.ProgressLine, name, pressed)
    found = main(said)
    told = capsys.readouterr().err
    assert not [part for file in files for part in file.parent.glob(".*.part")]
    if next(looks) <= 2:
        assert (found, told) == (0, ""), "it is not looked at in a pipe"
        return
    assert found == 130
    assert len(told.strip().splitlines()) == 1
    assert "interrupted" in told
    assert not any(file.exists() for file in files[-1:])
