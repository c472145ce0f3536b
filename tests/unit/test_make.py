"""``make test``: both halves run, whatever the first did, and a failure of either is one of the whole."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("first", "second", "ends"), [(0, 0, 0), (1, 0, 2), (0, 1, 2), (2, 3, 2), (5, 0, 0), (0, 5, 0), (-2, 0, 2)]
)
def test_a_failed_first_half_hides_nothing_of_the_second(tmp_path, first, second, ends):
    fake = tmp_path / "pytest"
    ways = f'case "$*" in *"not e2e"*) echo first; exit {first % 256};; *) echo second; exit {second % 256};; esac'
    fake.write_text(f"#!/bin/bash\n{ways}\n")
    fake.chmod(0o755)
    words = ["make", "-s", "-C", str(REPO), "-o", "compiled", "test", f"PYTEST={fake}"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert [line for line in done.stdout.splitlines() if line in ("first", "second")] == ["first", "second"]
    assert done.returncode == ends


def pins(name: str) -> dict[str, str]:
    """Each pinned package with its version, its marker and its hashes."""
    text = (REPO / name).read_text(encoding="utf-8")
    blocks = re.split(r"^(?=[a-z0-9])", text, flags=re.M)
    return {block.split(" ")[0]: re.sub(r"\n +#.*", "", block).strip() for block in blocks if "==" in block}


def test_the_lean_set_is_a_part_of_the_whole_one():
    """So that 'make sim' and 'make test' follow each other in one environment without changing a version."""
    lean, whole = pins("config/system/requirements.lock"), pins("requirements.lock")
    assert set(lean) <= set(whole)
    hashes = re.compile(r"sha256:\w+")
    assert all(set(hashes.findall(text)) == set(hashes.findall(whole[name])) for name, text in lean.items())


def test_the_lean_set_holds_what_sailing_needs_and_no_more():
    names = {name.partition("==")[0] for name in pins("config/system/requirements.lock")}
    assert {"pymavlink", "pydantic", "pyserial", "fastcrc", "rich", "mavsdk", "setuptools"} <= names
    assert not names & {"scipy", "control", "rasterio", "mavproxy", "atheris", "mypy", "pytest", "distributed"}


def test_every_test_on_the_real_clock_is_chosen_by_the_second_half():
    """It is given its folders, so that it need not collect all the others in each of its workers."""
    (places,) = re.findall(r"^REAL_CLOCK := (.*)$", (REPO / "Makefile").read_text(encoding="utf-8"), re.M)
    marked = [
        str(path.relative_to(REPO))
        for path in (REPO / "tests").rglob("test_*.py")
        if "pytest.mark." + "e2e" in path.read_text(encoding="utf-8") or path.parent.name == "e2e"
    ]
    assert len(marked) > 10
    assert not [name for name in marked if not name.startswith(tuple(places.split()))]
