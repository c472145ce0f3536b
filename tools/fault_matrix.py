"""docs/FAULTS.md: every row of the fault matrix with its deadline, what was measured, and the tests that hold it.

A row belongs to the tests whose names hold ``row_NN``; this tool finds them by reading the test files. What was measured is
written by those tests into build/faults when MEASURE_FAULTS is set:

    MEASURE_FAULTS=1 pytest tests/scenario/test_fault_rows.py tests/scenario/test_fence_voyages.py
    python -m tools.fault_matrix
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path
from typing import Final

REPO: Final = Path(__file__).resolve().parents[1]
PAGE: Final = REPO / "docs" / "FAULTS.md"
MEASURED: Final = REPO / "build" / "faults"

ROWS: Final[dict[int, tuple[str, str]]] = {
    1: ("companion process killed", "pins neutral 550 ms"),
    2: ("companion stopped or deadlocked", "pins neutral 550 ms; watchdog not fed"),
    3: ("control loop slow", "health flag, then stop; the board's silence failsafe is the guardian"),
    4: ("exception in a part that control can do without", "control unaffected; again after 1 s; 5 in 60 s: disarm"),
    5: ("exception in the control tick", "neutral in the same tick"),
    6: ("memory leak", "warn, controlled restart"),
    7: ("file descriptors exhausted", "existing links go on, accepting pauses 1 s"),
    8: ("actuator port vanishes", "told in 100 ms, disarmed, reopened, neutral first"),
    9: ("port comes back under another name", "reconnected 2 s"),
    10: ("actuator port blocks", "told in 300 ms, nothing queued"),
    11: ("board resets under way", "200 ms: thrust 0, interlock, told"),
    12: ("board hangs", "told in 350 ms; chip watchdog 260 ms"),
    13: ("board applies something else", "disarmed in 400 ms"),
    14: ("bit errors on the actuator line", "no wrong pulse; warn above 5 %, neutral above 50 %"),
    15: ("bytes lost or merged", "no wrong pulse"),
    16: ("wrong baud rate", "refuses to arm, told in 3 s"),
    17: ("firmware without failsafe", "arms only with consent"),
    18: ("two programs open the port", "start-up error naming the holder"),
    19: ("range request outside", "clamped at three places"),
    20: ("full ahead to full astern", "no faster than configured"),
    21: ("GNSS silent", "neutral 200 ms after 1.0 s (1 Hz receiver: 3 s)"),
    22: ("GNSS fix lost", "neutral at once"),
    23: ("position jump", "never steered on; invalid after 2 s"),
    24: ("GNSS frozen", "warned 5 s, invalid 10 s"),
    25: ("NMEA corrupt", "dropped, no effect"),
    26: ("NMEA flood", "no effect"),
    27: ("NMEA without line ends", "bounded"),
    28: ("NMEA server restarts", "reconnected 2 s"),
    29: ("NMEA server silent", "reconnected after 5 s"),
    30: ("heading lost", "course above 1 m/s, else neutral"),
    31: (
        "heading jump or flip",
        "held 1 s, then invalid; one that was taken for right at rest: stopped by the first thrust",
    ),
    32: ("two position sources disagree", "told after 5 s, no arming"),
    33: ("GNSS date off by 1024 weeks", "time ignored, position used"),
    34: ("wall clock jumps", "no timer reacts"),
    35: ("machine suspended 10 s", "neutral and disarmed at the first tick"),
    36: ("last ground station lost", "hold in 5.2 s"),
    37: ("manual control stops", "neutral 0.6 s at the pin"),
    38: ("guided set-points stop", "hold 1.1 s"),
    39: ("one of three stations leaves", "nothing"),
    40: ("owner of the sticks leaves, observer stays", "as row 36: hold or neutral in 5.2 s; observer may take over"),
    41: ("two stations command by hand", "only the owner is obeyed"),
    42: ("half-dead ground station", "row 37 protects"),
    43: ("30 % loss, 2 s latency, duplicates", "transfers complete, nothing executed twice"),
    44: ("UDP flood", "source muted, others served"),
    45: ("TCP client does not read", "closed, others unaffected"),
    46: ("200 TCP connects", "refused above 16, no leak"),
    47: ("forged signed frame, future time", "genuine station unaffected"),
    48: ("replayed signed frames, also after restart", "none accepted"),
    49: ("unsigned command on a signed link", "dropped, counted"),
    50: ("key file missing or wrong", "non-loopback links refused"),
    51: ("LoRa module silent", "as row 36 in the radio's own time"),
    52: ("LoRa garbage", "dropped"),
    53: ("LoRa overload", "refused; stop goes first"),
    54: ("plan by LoRa twice or half", "executed once; half never starts"),
    55: ("power cut during a save", "old or new, never mixed"),
    56: ("disk full", "control unaffected, told, tried again"),
    57: ("disk read-only or slow", "run from memory, told"),
    58: ("corrupt configuration, mission, parameters", "previous generation, told"),
    59: ("parameters that make control unstable", "thrust cut to 30 % within 3 s"),
    60: ("fence reached", "stops inside"),
    61: ("depth below the minimum", "neutral 200 ms after the second sample"),
    62: ("battery low, critical, lost", "warn, return, neutral"),
    63: ("stuck, or adrift in neutral", "warned 10 s; stuck: neutral 20 s"),
    64: ("emergency stop, terminate", "pins neutral 100 ms and one frame; latched"),
    65: (
        "compass repeats one heading",
        "told and not used once the vessel has turned by 25 to 30 degrees; then as row 30",
    ),
    66: ("sounder says its range when it hears no bottom", "never deep water: as a sounder that falls silent"),
    67: (
        "sounder hears the second echo",
        "doubted where the bottom was closing, as a sounder that falls silent; a true edge believed after 10 to 25 m",
    ),
    68: (
        "sounder repeats one depth",
        "told; where its noise is gone over a closing bottom, or chart or memory know less: as one that falls silent",
    ),
}

ABSENT: Final = {
    6: "left to systemd: MemoryMax ends the process, which is row 1; all buffers are bounded and tested one by one",
}


def named_tests(root: Path = REPO / "tests") -> dict[int, list[str]]:
    """Names of the tests that hold each row's number."""
    found: dict[int, list[str]] = {row: [] for row in ROWS}
    for file in sorted(root.rglob("test_*.py")):
        for name in re.findall(r"^def (test_\w*row_\d\w*)", file.read_text("utf-8"), re.MULTILINE):
            for number in _numbers(name):
                if number == 58 and "store" not in file.name:
                    continue  # in the sensors' tests 58 counts their own table of bad inputs
                found[number].append(f"{file.relative_to(root).as_posix()}::{name}")
    return found


def _numbers(name: str) -> set[int]:
    """Row numbers in a test's name: row_21, row_01_02, row_26_and_27."""
    numbers: set[int] = set()
    for match in re.finditer(r"row_(\d{1,2}(?:_(?:and_)?\d{1,2}(?=_|$))*)", name):
        numbers |= {int(part) for part in re.findall(r"\d{1,2}", match[1])}
    return {number for number in numbers if number in ROWS}


def page(*, fresh: bool = False) -> str:
    """The page's text, with the figures that it has; ``fresh``: with those measured last."""
    tests, measured = named_tests(), _measured(fresh=fresh)
    held = [row for row in ROWS if tests[row] and row not in ABSENT]
    lines = [
        "# Fault matrix",
        "",
        f"{len(ROWS)} faults, what the vessel must do about each, and what was measured (virtual time unless the test is end to end).",
        f"{len(held)} are held by tests; the others say why not. *Asserted* means that the tests fail beyond the deadline.",
        "Written by `make docs`; with new figures by `python -m tools.fault_matrix`.",
        "",
        "| # | fault | reaction and deadline | measured | tests |",
        "| --- | --- | --- | --- | --- |",
    ]
    for row, (fault, deadline) in ROWS.items():
        names = [name.partition("::")[2].removeprefix("test_") for name in tests[row]]
        shown = "<br>".join(f"`{name}`" for name in names[:3]) + (
            f"<br>and {len(names) - 3} more" if len(names) > 3 else ""
        )
        result = ABSENT.get(row) or measured.get(row) or ("asserted" if names else "")
        lines.append(f"| {row} | {fault} | {deadline} | {result} | {shown if row not in ABSENT else ''} |")
    return "\n".join(lines) + "\n"


def _measured(*, fresh: bool) -> dict[int, str]:
    """What the page says already, and over it what was measured since."""
    kept: dict[int, str] = {}
    if PAGE.is_file():
        for line in PAGE.read_text("utf-8").splitlines():
            cells = [cell.strip() for cell in line.split("|")]
            if len(cells) == 7 and cells[1].isdigit() and cells[4] not in ("", "asserted"):
                kept[int(cells[1])] = cells[4]
    for file in MEASURED.glob("*.json") if fresh else ():
        found = json.loads(file.read_text("utf-8"))
        kept[int(found["row"])] = found["measured"]
    return {row: text for row, text in kept.items() if row not in ABSENT}


def main(arguments: list[str] | None = None) -> int:
    """Write the page; with ``--check`` fail when it is out of date or a row has neither test nor reason."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args(arguments)
    text, tests = page(fresh=not options.check), named_tests()
    bare = [row for row in ROWS if not tests[row] and row not in ABSENT]
    if bare:
        print(f"rows without a test or a reason: {bare}")
        return 1
    if options.check:
        current = PAGE.is_file() and PAGE.read_text("utf-8") == text
        if not current:
            print("docs/FAULTS.md is out of date: python -m tools.fault_matrix")
        return 0 if current else 1
    PAGE.write_text(text, "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
