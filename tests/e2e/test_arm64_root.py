"""Another processor: the wheel and its locked packages in an arm64 Debian root, run by qemu. Slow: an instruction costs a dozen."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.e2e.clean_root import REPO, CleanRoot, wheel

pytestmark = [pytest.mark.e2e, pytest.mark.soak]
BINFMT = Path("/proc/sys/fs/binfmt_misc")
COMPANION = "/opt/usv-companion/bin/companion"


@pytest.fixture(scope="module")
def pi(tmp_path_factory):
    if not (BINFMT / "qemu-aarch64").exists():
        pytest.skip("programs of arm64 do not run here: apt-get install qemu-user-static, and binfmt_misc mounted")
    folder = tmp_path_factory.mktemp("arm64")
    root = CleanRoot(folder / "root", ("ca-certificates", "python3-venv", "udev"), "arm64")
    made = wheel(folder)
    root.put(made, f"/root/{made.name}")
    root.run(
        "cd /root && python3 -m zipfile -e usv_companion-*.whl usv && sh usv/config/system/install.sh usv_companion-*.whl"
    )
    return root


def test_it_installs_sails_replays_and_reports(pi):
    assert pi.run("uname -m").strip() == "aarch64"
    pi.run(f"{COMPANION} plan make /root/my.plan 41.1854,-8.7060 --radius 20 --duration 300 --speed 1.5")
    sail = f"{COMPANION} sim --plan /root/my.plan --start --speed max --duration 60 --run-dir /root/run --json"
    sailed = json.loads(pi.run(sail).splitlines()[-1])
    assert sailed["distance_m"] > 50.0
    assert "identical" in pi.run(f"{COMPANION} replay /root/run")
    pi.run(f"{COMPANION} report /root/run")
    assert pi.path("/root/run/report.html").stat().st_size > 50_000


def test_its_recording_replays_here_as_the_page_says(pi, tmp_path):
    pi.run(f"{COMPANION} sim --speed max --duration 20 --run-dir /root/short")
    shutil.copytree(pi.path("/root/short"), tmp_path / "short")
    words = [REPO / ".venv/bin/companion", "replay", tmp_path / "short", "--tolerant"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
