"""The installer's moment of change: whatever comes between, the boat has a program and its service runs.

The whole script runs, in a folder instead of the computer; what it asks the computer for is played.
"""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest

SYSTEM = Path(__file__).resolve().parents[2] / "config" / "system"
PLACES = {"settings": "etc", "state": "var", "link": "opt/usv-companion", "units": "units", "rules": "rules"}
MAKES_A_PROGRAM = """[ "$1" != -m ] || {
mkdir -p "$3/bin"
for name in pip companion python; do printf '#!/bin/sh\\n' > "$3/bin/$name"; chmod +x "$3/bin/$name"; done
}"""
PLAYED = {
    "id": "echo 0",
    "getent": "exit 0",
    "usermod": "",
    "udevadm": "",
    "install": 'for last in "$@"; do :; done; [ "$1" != -d ] || mkdir -p "$last"',
    "python3": MAKES_A_PROGRAM,
}
SERVICE = """case $1 in
is-active) [ -e running ] && echo active ;;
stop) rm -f running ;;
start) [ -x opt/usv-companion/bin/companion ] && touch running ;;
esac"""
FULL = 'echo "no space left on device" >&2; exit 1'


class Computer:
    """A folder with a program in force, as a link or as the first release's folder, and its service running."""

    def __init__(self, root: Path, form: str) -> None:
        self.root = root
        self.link = root / "opt" / "usv-companion"
        for folder in ("etc", "var/state", "bin"):
            (root / folder).mkdir(parents=True)
        for file in ("running", "etc/boat.toml", "var/state/companion.db", "usv_companion-9.9-py3-none-any.whl"):
            (root / file).touch()
        before = self.link if form == "folder" else self.link.with_name("usv-companion-9.8")
        self.tool("../" + str((before / "bin" / "companion").relative_to(root)), "echo before")
        if form == "link":
            self.link.symlink_to(before)
        for name, does in PLAYED.items():
            self.tool(name, does)
        self.tool("systemctl", f"cd {root}\n{SERVICE}")

    def tool(self, name: str, does: str) -> None:
        path = self.root / "bin" / name
        path.resolve().parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!/bin/sh\n{does}\n")
        path.chmod(0o755)

    def install(self, *options: str) -> subprocess.CompletedProcess[str]:
        text = (SYSTEM / "install.sh").read_text(encoding="utf-8")
        for name, place in PLACES.items():
            text, changed = re.subn(rf"^{name}=/.*$", f"{name}={self.root / place}", text, flags=re.M)
            assert changed == 1
        for called, does in (("systemd() { ", "true"), ("as_user() { ", '"$@"')):
            text, changed = re.subn(rf"^{re.escape(called)}.*$", f"{called}{does}; }}", text, flags=re.M)
            assert changed == 1
        (self.root / "install.sh").write_text(text)
        command = ["sh", "install.sh", "usv_companion-9.9-py3-none-any.whl", *options]
        path = f"{self.root / 'bin'}:{os.environ['PATH']}"
        return subprocess.run(
            command, cwd=self.root, env={"PATH": path}, capture_output=True, text=True, check=False, timeout=60
        )

    @property
    def in_force(self) -> str:
        """Which program the service would start; "" for none."""
        program = self.link / "bin" / "companion"
        if not program.is_file():
            return ""
        return "before" if "before" in program.read_text() else "new"

    @property
    def runs(self) -> bool:
        return (self.root / "running").exists()

    @property
    def programs(self) -> int:
        """How many programs lie there, in force or not."""
        return len({path.resolve() for path in (self.root / "opt").iterdir()})


@pytest.fixture(params=["link", "folder"])
def computer(request: pytest.FixtureRequest, tmp_path: Path) -> Computer:
    return Computer(tmp_path, request.param)


def assert_sound(computer: Computer, done: subprocess.CompletedProcess[str]) -> None:
    """What is said is so, and the boat can sail."""
    assert computer.runs, done.stderr
    said = done.stdout + done.stderr
    assert computer.in_force == ("new" if done.returncode == 0 or "is in force" in said else "before"), said
    if computer.in_force == "before":
        assert computer.programs == 1, "what is half made goes"


def test_an_upgrade_puts_the_new_program_in_force_and_keeps_the_one_before(computer: Computer) -> None:
    done = computer.install("--stop")
    assert done.returncode == 0, done.stderr
    assert_sound(computer, done)
    assert computer.programs == 2
    assert not list((computer.root / "opt").glob("*.new"))


def test_a_boat_that_sets_sail_while_the_packages_come_is_not_stopped(computer: Computer) -> None:
    """Without --stop the service was looked at minutes before it was stopped."""
    (computer.root / "running").unlink()
    computer.tool("python3", f'{MAKES_A_PROGRAM}\n[ "$1" != -m ] || touch {computer.root}/running')
    computer.tool("systemctl", f'cd {computer.root}\n[ "$1" != stop ] || touch was_stopped\n{SERVICE}')
    done = computer.install()
    assert done.returncode == 1
    assert "--stop" in done.stderr
    assert_sound(computer, done)
    assert not (computer.root / "was_stopped").exists()


@pytest.mark.parametrize(
    ("tool", "signal"),
    [(tool, "TERM") for tool in ("ln", "mv", "cp", "systemctl", "install")] + [("ln", "INT"), ("mv", "HUP")],
)
@pytest.mark.parametrize("early", [True, False])
def test_a_signal_at_any_step_leaves_a_program_and_a_running_service(
    computer: Computer, tool: str, signal: str, early: bool
) -> None:
    """A shell sees the signal when the command has ended: the link was there, and what it pointed at was removed."""
    work = {"systemctl": f"cd {computer.root}\n{SERVICE}", "install": PLAYED["install"]}
    steps = [f"kill -{signal} $PPID", work.get(tool, f'/bin/{tool} "$@"')]
    computer.tool(tool, "\n".join(steps if early else reversed(steps)))
    assert_sound(computer, computer.install("--stop"))


@pytest.mark.parametrize("tool", ["ln", "mv", "cp"])
@pytest.mark.parametrize("nth", [1, 2, 3])
def test_a_full_disk_at_any_step_leaves_a_program_and_a_running_service(
    computer: Computer, tool: str, nth: int
) -> None:
    count = computer.root / "count"
    computer.tool(tool, f'echo >> {count}\n[ "$(wc -l < {count})" -ne {nth} ] || {{ {FULL}; }}\n/bin/{tool} "$@"')
    assert_sound(computer, computer.install("--stop"))


@pytest.mark.parametrize("tool", ["ln", "mv", "cp"])
def test_a_tool_that_fails_after_its_work_costs_no_program(computer: Computer, tool: str) -> None:
    """What the link points at is never removed."""
    computer.tool(tool, f'/bin/{tool} "$@"\n{FULL}')
    assert_sound(computer, computer.install("--stop"))


def test_a_folder_of_an_earlier_change_is_not_filled(tmp_path: Path) -> None:
    computer = Computer(tmp_path, "folder")
    kept = computer.link.with_name("usv-companion-before")
    kept.mkdir()
    (kept / "mine").touch()
    assert_sound(computer, computer.install("--stop"))
    assert [path.name for path in kept.iterdir()] == ["mine"]
    assert computer.link.with_name("usv-companion-before.2").is_dir()
