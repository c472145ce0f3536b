"""A baseline for rebuilding: what every shipped scenario writes, as digests, before and after a step that must change nothing.

``python -m tools.baseline record`` sails the shipped scenarios and keeps the SHA-256 of each run's truth, control, telemetry and
events in ``build/baseline.json``; ``check`` sails them again and names what differs. Record at the last commit before the step.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Final

from sitl.scenario import run_scenario

KEPT: Final = Path("build/baseline.json")
WRITTEN: Final = ("truth.csv", "control.csv", "mavlink.tlog", "events.jsonl")
SCENARIOS: Final = Path("sitl/scenarios")

Digests = dict[str, dict[str, str]]


def sail(name: str) -> dict[str, str]:
    """Sail a shipped scenario at full speed; return the digest of each file that it wrote."""
    with tempfile.TemporaryDirectory() as folder:
        outcome = run_scenario(name, run_dir=Path(folder))
        digests = {
            file: hashlib.sha256((Path(folder) / file).read_bytes()).hexdigest()
            for file in WRITTEN
            if (Path(folder) / file).is_file()
        }
    return digests | {"passed": str(outcome.passed)}


def sail_all(jobs: int) -> Digests:
    """Sail every shipped scenario, ``jobs`` at a time, and print each as it ends."""
    names = sorted(path.stem for path in SCENARIOS.glob("*.toml"))
    found: Digests = {}
    with ProcessPoolExecutor(jobs) as pool:
        for number, (name, digests) in enumerate(zip(names, pool.map(sail, names), strict=True), start=1):
            found[name] = digests
            print(f"{number}/{len(names)} {name}", flush=True)
    return found


def differences(old: Digests, new: Digests) -> list[str]:
    """Name every file of every scenario whose digest is not what it was."""
    return [
        f"{name}: {file}"
        for name in sorted(old.keys() | new.keys())
        for file in sorted(old.get(name, {}).keys() | new.get(name, {}).keys())
        if old.get(name, {}).get(file) != new.get(name, {}).get(file)
    ]


def main() -> int:
    """Run the command; return 1 where something differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("record", "check"))
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    found = sail_all(args.jobs)
    if args.what == "record":
        KEPT.parent.mkdir(exist_ok=True)
        KEPT.write_text(json.dumps(found, indent=1), encoding="utf-8")
        print(f"{len(found)} scenarios kept in {KEPT}")
        return 0
    wrong = differences(json.loads(KEPT.read_text(encoding="utf-8")), found)
    print("\n".join(wrong) if wrong else f"{len(found)} scenarios: identical")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
