"""README and the pages in a plain shell of a clean Debian root: every line as printed works, or says here why it is not tried."""

from __future__ import annotations

import json
import subprocess

import pytest

from tests.e2e.clean_root import REPO, CleanRoot
from tests.e2e.page_driver import blocks, is_typed

pytestmark = [pytest.mark.e2e, pytest.mark.soak]
PAGES = sorted(
    str(path.relative_to(REPO))
    for path in (REPO / "README.md", REPO / "CONTRIBUTING.md", *(REPO / "docs").glob("*.md"))
    if any(kind == "" and any(map(is_typed, body)) for kind, body in blocks(path.read_text(encoding="utf-8")))
)
"""README first: it sets up what the others use."""
CODE = "/root/usv"


@pytest.fixture(scope="module")
def computer(tmp_path_factory):
    """A computer as README wants it, with a fresh clone."""
    folder = tmp_path_factory.mktemp("computer")
    root = CleanRoot(folder / "root", ("ca-certificates", "git", "make", "python3-venv", "sudo", "udev"))
    subprocess.run(["git", "clone", "-q", f"file://{REPO}", str(folder / "clone")], check=True)
    root.put(folder / "clone", CODE)
    return root


def test_lean_set_up_and_first_report(computer):
    """The figures of the README: printed, not judged, as they are of this computer and its network."""
    said = computer.run(
        f"cd {CODE}; SECONDS=0; make lean >/dev/null; echo $SECONDS s; du -sm .venv; . .venv/bin/activate; "
        "companion plan make my.plan 41.1854,-8.7060 --radius 20 --duration 300 --speed 1.5 >/dev/null; "
        "companion sim --plan my.plan --start --speed max --duration 600 --run-dir first --json >/dev/null; "
        "companion report first >/dev/null; echo first report after $SECONDS s; du -sm .venv"
    )
    print(said)
    sizes_mb = [int(line.split()[0]) for line in said.splitlines() if line.endswith(".venv")]
    assert max(sizes_mb) <= 300


@pytest.mark.parametrize("page", ["README.md", *(page for page in PAGES if page != "README.md")])
def test_every_line_works_as_printed(computer, page):
    computer.run(f"cd {CODE}; git clean -fdq -e .venv; make setup > /dev/null" if page != "README.md" else "true")
    rows = [
        json.loads(row)
        for row in computer.run(f"cd {CODE}; python3 tests/e2e/page_driver.py {page}", timeout_s=7200.0).splitlines()
    ]
    for row in rows:
        print(f"{row['took_s']:7.1f} s  {row['line']}" + (f"   NOT TRIED: {row['skip']}" if row["skip"] else ""))
    wrong = [f"{row['line']}\n{row['said']}" for row in rows if not row["works"]]
    assert not wrong, "\n\n".join(wrong)
