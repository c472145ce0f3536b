"""Writes the generated pages of docs/: configuration, parameters, failsafe table, IMC table, the way from DUNE.

A page that is written by hand and has a generated part keeps everything outside the two marker lines. ``--check`` writes
nothing and fails when a page is out of date (the test suite does that).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from companion.core.guard.failsafe import failsafe_table_markdown
from companion.core.hull import VesselConfig
from companion.core.vehicle.insist import table_markdown
from companion.gateway import GatewaySettings
from companion.imc.settings import ImcSettings
from companion.settings import Settings, params
from mavlink_bridge.language.imc_table import imc_table_markdown
from mavlink_bridge.mavlink.telemetry.ages import ages_markdown
from sitl.world.settings import WorldConfig
from tools import api_page, boat_scenarios, fault_matrix, from_dune
from tools.schema_text import Key, keys

REPO = Path(__file__).resolve().parents[1]
BEGIN = "<!-- generated: begin (make docs) -->"
ABOUT = {
    "sensors": "A list: one `[[sensors]]` for each link.",
    "endpoints": "A list: one `[[endpoints]]` for each link.",
    "failsafe.conditions.NAME": "One table for each condition that is changed; their names: `companion explain failsafe`.",
    "mounts.NAME": "One table for each sensor link that does not sit where the hull's common keys say.",
    "world.bottom.mounds": "A list: one `[[world.bottom.mounds]]` for each mound.",
}
"""What a reader must know of a table before its keys."""
END = "<!-- generated: end -->"


def configuration() -> str:
    """docs/CONFIGURATION.md: every key of the TOML file."""
    parts = [
        "# Configuration",
        "",
        "One TOML file, read once at start; `--set key=value` changes single keys. Nothing is merged from hidden places and no",
        "environment variable is read. `companion check FILE` says what a file means and lists every mistake at once, each with its",
        "key and the mend. `config/boat.toml` and `config/sim.toml` are commented examples; what they leave out has the default below.",
        "",
        "Paths are relative to where the program is started (with the service: `/var/lib/usv-companion`). In any text `CONFIG_DIR` stands"
        " for\nthe folder of this file, and in the address of a link `RUN_DIR` for the directory in which the run is recorded.",
        "",
        "A key with a *parameter* is also a MAVLink parameter of that name; what a ground station stores there stands before the file.",
        "",
    ]
    parts += _tables(keys(Settings), "At the top")
    parts += [
        "",
        "# The simulator's world",
        "",
        "What `companion sim` reads besides, from the same file (`config/sim.toml`): the water, the bottom, what the sensors get wrong.",
        "A real vessel's file has none of it.",
    ]
    parts += _tables(keys(WorldConfig, "world."), "")
    parts += [
        "",
        "# The gateway's file",
        "",
        "`companion gateway` reads a file of its own (`config/gateway.toml`). Its `[[endpoints]]` and `[security]` have the keys above.",
    ]
    own = (key for key in keys(GatewaySettings) if not key.path.startswith(("endpoints.", "security.")))
    parts += _tables(own, "At the top of a gateway's file")
    parts += [
        "",
        "# The file of the bridge to IMC consoles",
        "",
        "`companion imc` reads a file of its own (`config/imc.toml`); [NEPTUS.md](NEPTUS.md) tells what it is for.",
    ]
    parts += _tables(keys(ImcSettings), "At the top of the bridge's file")
    parts += [
        "",
        "# The hull file",
        "",
        "What `vessel` names: a file of `config/vessels`, or your own ([VESSEL.md](VESSEL.md) says how to come by the figures). It is",
        "the only home of the boat's geometry and dynamics.",
    ]
    parts += _tables(keys(VesselConfig), "At the top of a hull file")
    return "\n".join(parts) + "\n"


def _tables(found: Iterable[Key], top: str) -> Iterator[str]:
    """A section for each table of a file; ``top`` heads the keys that stand in none."""
    tables: dict[str, list[Key]] = {}
    for key in found:
        tables.setdefault(key.path.rpartition(".")[0], []).append(key)
    for table, rows in sorted(tables.items(), key=lambda item: bool(item[0])):
        yield from ("", f"## {f'[{table}]' if table else top}", "")
        if table in ABOUT:
            yield from (ABOUT[table], "")
        yield from ("| key | kind | default | range | meaning | parameter |", "| --- | --- | --- | --- | --- | --- |")
        yield from map(_key_row, rows)


def _key_row(key: Key) -> str:
    limits = f"{key.limits} {key.unit}".strip()
    text = key.text.replace("|", "\\|")
    parameter = f"`{key.parameter}`" if key.parameter else ""
    return f"| `{key.path.rpartition('.')[2]}` | {key.kind} | {key.default} | {limits} | {text} | {parameter} |"


def parameters() -> str:
    """docs/PARAMETERS.md: every MAVLink parameter."""
    parts = [
        "# Parameters",
        "",
        "All are REAL32 on the wire. A value outside its range is refused with the reason, and the answer holds the value in force.",
        "*live* means that it takes effect at the next tick; the others at the next start. A few further parameters exist only because",
        "ground stations ask for them; they are marked read-only there.",
        "",
        "| parameter | default | range | unit | live | meaning | TOML key |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for entry in sorted(params.entries(Settings), key=lambda found: found.param.name):
        default = "" if entry.default is None else f"{entry.default:g}"
        low = "" if entry.minimum is None else f"{entry.minimum:g}"
        high = "" if entry.maximum is None else f"{entry.maximum:g}"
        parts.append(
            f"| `{entry.param.name}` | {default} | {low}…{high} | {entry.param.unit} | {'yes' if entry.param.live else 'no'} "
            f"| {entry.text.rstrip('.')} | `{entry.key}` |"
        )
    return "\n".join(parts) + "\n"


def imc() -> str:
    """docs/IMC.md."""
    head = (
        "# IMC and MAVLink\n\nHow the messages of the original installation travel here. Inside the program they keep their IMC names\n"
        "(`mavlink_bridge/language/messages.py`, SI units and radians); `mavlink_bridge/mavlink/wire/mapping.py`\n"
        "scales their fields to MAVLink's. The wire protocol itself, for consoles of LSTS, is another matter: [NEPTUS.md](NEPTUS.md).\n\n"
    )
    return head + imc_table_markdown()


def dune() -> str:
    """docs/FROM-DUNE.md."""
    return from_dune.page({entry.key: entry.param.name for entry in params.entries(Settings)})


def refusals() -> str:
    """docs/REFUSALS.md: every refusal, and by what one insists."""
    parts = [
        "# Refusals",
        "",
        "What the vessel says no to, and how a person insists. **A check stops a departure, never a way back**: a voyage begins with",
        "arming and ends when an operator disarms within 50 m of where it began, or half an hour after he disarmed elsewhere or",
        "with the position lost. A failsafe's disarm, a board or a computer that starts again do not end it (a disarm within 50 m of",
        "its beginning does, half an hour later): arming needs only what the gate needs. Hold and Disarm are never refused to",
        "anybody whom the link admits. What can be insisted on can be over every link, the radio too.",
        "",
        "**Home is where the voyage began.** While it lasts arming again does not move it, and farther than 50 m from it says so: `home",
        "stays 133 m away, at 41.18502 -8.70621; Set Home moves it` (the station's *Set Home*, DO_SET_HOME, puts it where the boat is or",
        "anywhere else). The first arming after a voyage makes home of the place where the boat is then: after a landing, half an hour",
        "after a disarm elsewhere, and farther than 5 km from that disarm (another water, by car) before the half hour too: that is",
        "a departure again. A computer that starts again farther than 5 km both from home and from where the boat was last seen ends the",
        "voyage, too: `the voyage before was left 30 km away: it is over, and home is here`. One that starts again in that half",
        "hour reckons it by the receiver's clock, without one from its start; of a voyage that is over by then, a home that was set",
        "goes too.",
        "",
        table_markdown(),
    ]
    return "\n".join(parts)


PAGES: dict[str, Callable[[], str]] = {
    "API.md": api_page.page,
    "CONFIGURATION.md": configuration,
    "PARAMETERS.md": parameters,
    "IMC.md": imc,
    "FROM-DUNE.md": dune,
    "BOAT-SCENARIOS.md": boat_scenarios.page,
    "FAULTS.md": fault_matrix.page,
    "REFUSALS.md": refusals,
}
"""Pages that are generated as a whole."""
PARTS: dict[str, Callable[[], str]] = {"SAFETY.md": failsafe_table_markdown, "TELEMETRY.md": ages_markdown}
"""Pages with one generated part between the markers."""


def wanted(folder: Path) -> dict[Path, str]:
    """What every page should hold."""
    pages = {folder / name: make() for name, make in PAGES.items()}
    for name, make in PARTS.items():
        path = folder / name
        text = path.read_text(encoding="utf-8")
        before, _, rest = text.partition(BEGIN)
        _, _, after = rest.partition(END)
        pages[path] = f"{before}{BEGIN}\n{make().strip()}\n{END}{after}"
    return pages


def main(argv: Sequence[str] | None = None) -> int:
    """Write or check."""
    parser = argparse.ArgumentParser(description="write the generated pages of docs/")
    parser.add_argument("--check", action="store_true", help="write nothing; exit status 1 when a page is out of date")
    arguments = parser.parse_args(argv)
    stale = []
    for path, text in wanted(REPO / "docs").items():
        if path.is_file() and path.read_text(encoding="utf-8") == text:
            continue
        stale.append(path.name)
        if not arguments.check:
            path.write_text(text, encoding="utf-8")
    print(f"{'out of date' if arguments.check else 'written'}: {', '.join(stale) or 'none'}")
    return 1 if arguments.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
