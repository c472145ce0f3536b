"""Coverage-guided fuzzing with atheris: ``python -m tools.fuzz_guided`` runs every target of ``tools.fuzzing.targets`` for some seconds.

Each target runs in a process of its own, with a fixed seed. Inputs that reach something new are kept in build/fuzz, those that
break something in the corpus folder, which the test suite plays: commit them with the mend. ``--merge`` takes into the corpus
what of build/fuzz reaches more than the corpus does.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
CORPUS: Final = ROOT / "tests" / "data" / "fuzz" / "guided"
FOUND: Final = ROOT / "build" / "fuzz"
MAX_LEN: Final = 512
MEMORY_MB: Final = 700
SLOWEST_S: Final = 5


def drive(name: str, options: Sequence[str]) -> None:
    """Fuzz one target in this process; libFuzzer ends the process."""
    import atheris

    with atheris.instrument_imports(include=["companion", "mavlink_bridge"]):
        from tools.fuzzing.targets import targets

    target = next(each for each in targets() if each.name == name)
    seeds = FOUND / name / "seeds"
    seeds.mkdir(parents=True, exist_ok=True)
    for seed in target.seeds:
        (seeds / hashlib.sha256(seed).hexdigest()[:16]).write_bytes(seed)
    target.play(target.seeds[0])
    again = FOUND / name / "again"  # libFuzzer's merge starts itself anew by the first word
    again.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m tools.fuzz_guided --drive {name} "$@"\n', encoding="ascii")
    again.chmod(0o755)
    atheris.Setup([str(again), *options], target.play)
    atheris.Fuzz()


def run(name: str, seconds: int, seed: int, *, merge: bool = False) -> str:
    """Fuzz one target in a process of its own; return what broke, empty when nothing."""
    kept, found = CORPUS / name, FOUND / name / "found"
    for folder in (kept, found):
        folder.mkdir(parents=True, exist_ok=True)
    if merge:
        options = ["-set_cover_merge=1", "-use_counters=0", str(kept), str(found), str(FOUND / name / "seeds")]
    else:
        options = [f"-max_total_time={seconds}", f"-seed={seed}", f"-timeout={SLOWEST_S}", f"-rss_limit_mb={MEMORY_MB}"]
        options += [
            f"-artifact_prefix={kept}/",
            "-print_final_stats=1",
            str(found),
            str(kept),
            str(FOUND / name / "seeds"),
        ]
    words = [sys.executable, "-m", "tools.fuzz_guided", "--drive", name, f"-max_len={MAX_LEN}", *options]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, errors="replace", check=False)
    (FOUND / name / "log").write_text(done.stdout + done.stderr, encoding="utf-8")
    print(f"  {name:14} {_summary(done.stderr)}", flush=True)
    if done.returncode == 0:
        return ""
    return f"{name}: {_fault(done.stdout + done.stderr)} (whole story: {FOUND / name / 'log'})"


def _summary(text: str) -> str:
    runs = re.search(r"stat::number_of_executed_units:\s*(\d+)", text)
    covered = re.findall(r"cov: (\d+)", text)
    peak = re.search(r"stat::peak_rss_mb:\s*(\d+)", text)
    return (
        f"{runs[1] if runs else '-':>9} inputs, {covered[-1] if covered else '-':>6} edges, "
        f"{peak[1] if peak else '-':>4} MB at most"
    )


def _fault(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if re.search(r"Error|ERROR|Exception|assert", line)]
    return " / ".join(lines[:4])[:400] or "ended without a word"


def names() -> list[str]:
    from tools.fuzzing.targets import targets

    return [target.name for target in targets()]


def main(arguments: Sequence[str]) -> int:
    """Command line. Exit status 1 when a target broke, 0 too when atheris has no wheel for this machine."""
    if arguments[:1] == ["--drive"]:
        drive(arguments[1], arguments[2:])
        return 1
    parser = argparse.ArgumentParser(prog="python -m tools.fuzz_guided", description=__doc__)
    parser.add_argument("targets", nargs="*", help="which ones (default: all)")
    parser.add_argument("--seconds", type=int, default=10, help="for each target")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--merge", action="store_true", help="take what was found into the corpus instead")
    options = parser.parse_args(arguments)
    if importlib.util.find_spec("atheris") is None:
        print(
            "coverage-guided fuzzing left out: atheris is not installed (extra 'dev'; it has wheels for Linux on x86-64 only)"
        )
        return 0
    known = names()
    strange = set(options.targets) - set(known)
    if strange:
        parser.error(f"no such target: {', '.join(sorted(strange))}; there are {', '.join(known)}")
    print(f"coverage-guided, {options.seconds} s for each target, seed {options.seed}:", flush=True)
    chosen = [name for name in known if name in options.targets or not options.targets]
    broken = [what for name in chosen if (what := run(name, options.seconds, options.seed, merge=options.merge))]
    for what in broken:
        print("BROKEN:", what)
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
