"""The wheel works without the checkout: its data files are inside, its commands run."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parents[2]
SHIPPED = ("companion", "mavlink_bridge", "sitl", "config", "pyproject.toml", "README.md", "LICENSE")


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    """The built wheel, unpacked; built from a copy, so that the checkout stays clean."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    source.mkdir()
    tracked = subprocess.run(["git", "ls-files"], cwd=REPO, capture_output=True, text=True, check=True).stdout.split(
        "\n"
    )
    for name in tracked:
        path = REPO / name
        if path.is_file() and name.split("/")[0] in SHIPPED:
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes(path.read_bytes())
    words = [
        "-m",
        "pip",
        "wheel",
        "--no-deps",
        "--no-build-isolation",
        "--disable-pip-version-check",
        "-q",
        "-w",
        str(folder),
        ".",
    ]
    subprocess.run([sys.executable, *words], cwd=source, check=True)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def companion(site: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run the command from the wheel's files only."""
    code = f"import sys; sys.path.insert(0, {str(site)!r}); from companion.cli import main; sys.exit(main())"
    return subprocess.run(
        [sys.executable, "-P", "-c", code, *words],
        capture_output=True,
        text=True,
        cwd=site.parent,
        check=False,
        timeout=120,
    )


def test_data_files_are_inside(unpacked):
    for name in (
        "config/boat.toml",
        "config/sim.toml",
        "config/vessels/otter.toml",
        "config/radio/o-10.toml",
        "config/system/usv-companion.service",
        "config/system/usv-companion-web.service",
        "companion/web/page/page.html",
        "companion/web/page/sha256.js",
        "config/system/60-usv-companion.rules",
        "companion/py.typed",
        "mavlink_bridge/py.typed",
    ):
        assert (unpacked / name).is_file(), name
    tracked = {path.relative_to(REPO) for path in (REPO / "config").rglob("*.toml")}
    assert {path.relative_to(unpacked) for path in (unpacked / "config").rglob("*.toml")} >= tracked


def test_its_commands_run(unpacked, tmp_path):
    checked = companion(unpacked, "check", str(unpacked / "config" / "boat.toml"))
    assert checked.returncode == 0, checked.stderr
    assert "otter" in checked.stdout
    run_dir = tmp_path / "run"
    code = (
        f"import sys; sys.path.insert(0, {str(unpacked)!r}); from pathlib import Path; import config, companion, sitl\n"
        f"assert companion.__file__.startswith({str(unpacked)!r})\n"
        "from companion.settings.schema import load; from sitl.world.settings import SimSettings; from sitl.world.world import World\n"
        f"World(load(config.path('sim.toml'), (), SimSettings), 1, run_dir=Path({str(run_dir)!r})).run(5.0)\n"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", code], capture_output=True, text=True, cwd=tmp_path, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert (run_dir / "control.csv").is_file()
