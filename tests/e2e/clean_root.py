"""A clean Debian root to try what the pages tell: made by debootstrap once, under each test as a layer that it cannot change.

Mounts live in a namespace of each command and end with it. Needs root, debootstrap, and for another architecture qemu-user-static.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parents[2]
CACHE = REPO / "build" / "clean-roots"
SUITE = "bookworm"
_PASSED = ("PIP_CERT", "PIP_DEFAULT_TIMEOUT", "http_proxy", "https_proxy", "no_proxy")


class CleanRoot:
    """One root for one test; what its commands change stays until the test's folder goes."""

    def __init__(self, folder: Path, packages: tuple[str, ...], architecture: str = "amd64") -> None:
        self._base = _base(packages, architecture)
        self._upper, self._work, self.root = folder / "upper", folder / "work", folder / "root"
        for path in (self._upper, self._work, self.root):
            path.mkdir(parents=True)
        self.variables = {"HOME": "/root", "PATH": "/usr/sbin:/usr/bin:/sbin:/bin"}
        self.variables |= {name: os.environ[name] for name in _PASSED if name in os.environ}
        for name in ("/etc/resolv.conf", "/etc/pip.conf", os.environ.get("PIP_CERT", "")):
            if name and Path(name).is_file():
                self.put(Path(name), name)

    def put(self, source: Path, name: str) -> None:
        """Copy a file or a folder into the root; between commands only."""
        there = self._upper / name.lstrip("/")
        there.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, there, symlinks=True)
        else:
            shutil.copy(source, there)

    def path(self, name: str) -> Path:
        """A file that a command has written or changed."""
        return self._upper / name.lstrip("/")

    def run(self, script: str, *, ends: int = 0, timeout_s: float = 1800.0) -> str:
        """Run a shell script in the root; what it said. Fails when it ends otherwise than with ``ends``."""
        inside = ["chroot", str(self.root), "/usr/bin/env", "-i"]
        inside += [f"{name}={value}" for name, value in self.variables.items()]
        return self._run([*inside, "bash", "-c", script], ends, timeout_s)

    def beside(self, words: list[str]) -> str:
        """Run a program of this computer while the root is mounted; what it said."""
        return self._run(words, 0, 600.0)

    def _run(self, words: list[str], ends: int, timeout_s: float) -> str:
        layers = f"lowerdir={self._base},upperdir={self._upper},workdir={self._work}"
        mounts = (
            f"mount -t overlay overlay -o {layers} {self.root}",
            f"mount -t proc proc {self.root}/proc",
            f"mount --rbind /dev {self.root}/dev",
        )
        done = subprocess.run(
            ["unshare", "--mount", "sh", "-ec", f'{"; ".join(mounts)}; exec "$@"', "sh", *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=timeout_s,
            check=False,
        )
        assert done.returncode == ends, f"{words[-1]}\nended with {done.returncode}\n{done.stdout[-6000:]}"
        return done.stdout


def _base(packages: tuple[str, ...], architecture: str) -> Path:
    """The root below: made once for these packages, complete or not there."""
    if os.geteuid() != 0 or shutil.which("debootstrap") is None:
        pytest.skip("a clean root needs root and debootstrap")
    base = CACHE / "-".join([SUITE, architecture, *packages])
    if not base.is_dir():
        making = base.with_name(f"{base.name}.making")
        shutil.rmtree(making, ignore_errors=True)
        making.parent.mkdir(parents=True, exist_ok=True)
        words = ["debootstrap", "--variant=minbase", f"--arch={architecture}", f"--include={','.join(packages)}"]
        subprocess.run([*words, SUITE, str(making)], check=True, stdout=subprocess.DEVNULL)
        making.rename(base)
    return base


def wheel(folder: Path) -> Path:
    """The wheel as 'make wheel' builds it, of the committed files, so that the checkout stays clean."""
    source = folder / "source"
    subprocess.run(["git", "clone", "-q", "--depth=1", f"file://{REPO}", str(source)], check=True)
    words = [".venv/bin/python", "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", str(folder)]
    subprocess.run([str(REPO / words[0]), *words[1:], "."], cwd=source, check=True)
    (made,) = folder.glob("*.whl")
    return made
