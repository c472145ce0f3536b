"""The rules of docs/ARCHITECTURE.md that a machine can hold."""

from __future__ import annotations

import ast
import functools
import gc
import importlib
import itertools
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from companion.core.hull import VesselConfig
from companion.settings import Settings
from mavlink_bridge.mavlink.wire.cmd import Cmd
from tools.schema_text import keys

REPO = Path(__file__).resolve().parents[2]
PACKAGES = ("companion", "mavlink_bridge", "sitl")
HEAVY = ("control", "scipy", "matplotlib", "numpy", "mavsdk")
VOCABULARY = {"crc", "language"}


def modules() -> tuple[tuple[Path, ast.Module], ...]:
    """Every module that ships."""
    return parsed(PACKAGES)


def tool_modules() -> tuple[tuple[Path, ast.Module], ...]:
    """The tools, which do not ship."""
    return parsed(("tools",))


@functools.cache
def parsed(packages: tuple[str, ...]) -> tuple[tuple[Path, ast.Module], ...]:
    """Every module of some packages, parsed once."""
    paths = [path for package in packages for path in sorted((REPO / package).rglob("*.py"))]
    gc.disable()  # a million objects, and not one to be given back
    try:
        return tuple((path.relative_to(REPO), ast.parse(path.read_text(encoding="utf-8"))) for path in paths)
    finally:
        gc.enable()


@functools.cache
def nodes(packages: tuple[str, ...] = PACKAGES) -> tuple[tuple[Path, ast.AST], ...]:
    """Every node of their modules, in the order of ``ast.walk``: a dozen rules look through them."""
    gc.disable()
    try:
        return tuple((path, node) for path, tree in parsed(packages) for node in ast.walk(tree))
    finally:
        gc.enable()


@pytest.fixture(scope="module", autouse=True)
def forgotten() -> Iterator[None]:
    """The trees are a million objects: what is kept of them is looked through at each collection of every later test."""
    yield
    parsed.cache_clear()
    nodes.cache_clear()
    imports.cache_clear()


@functools.cache
def imports() -> tuple[tuple[Path, str], ...]:
    """Every name that a module imports from elsewhere, with the module."""
    found: list[tuple[Path, str]] = []
    for path, node in nodes():
        if isinstance(node, ast.Import):
            found += [(path, name.name) for name in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found += [(path, f"{node.module}.{name.name}") for name in node.names]
    return tuple(found)


def test_only_the_gate_makes_actuator_output() -> None:
    makers = {
        str(path)
        for path, node in nodes()
        if isinstance(node, ast.Call)
        and (getattr(node.func, "id", "") == "ActuatorOutput" or getattr(node.func, "attr", "") == "ActuatorOutput")
    }
    assert makers == {"companion/core/guard/gate.py"}


def test_the_core_knows_of_the_bridge_only_the_vocabulary() -> None:
    wrong = [
        f"{path}: {name}"
        for path, name in imports()
        if path.parts[:2] == ("companion", "core")
        if name.startswith("mavlink_bridge") and name.split(".")[1] not in VOCABULARY
    ]
    assert not wrong


def test_what_ships_needs_nothing_of_the_workshop() -> None:
    """The wheel holds neither ``tools`` nor ``tests``: it would work in a checkout's folder and nowhere else."""
    wrong = [f"{path}: {name}" for path, name in imports() if name.startswith(("tools.", "tests."))]
    assert not wrong


def test_pymavlink_enters_at_one_point_and_never_as_mavutil() -> None:
    users = {str(path) for path, name in imports() if name.startswith("pymavlink")}
    assert users <= {
        "mavlink_bridge/mavlink/wire/codec.py",
        "mavlink_bridge/mavlink/wire/extensions.py",
        "mavlink_bridge/mavlink/wire/framing.py",
        "mavlink_bridge/mavlink/wire/payload.py",
    }
    assert not [path for path, name in imports() if "mavutil" in name]


def test_nobody_draws_from_the_shared_random_generator() -> None:
    drawers = [
        f"{path}:{node.lineno}"
        for path, node in nodes()
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and isinstance(node.func.value, ast.Name)
        and node.func.value.id == "random"
        and node.func.attr not in ("Random", "SystemRandom")
    ]
    assert not drawers


@pytest.mark.parametrize("entry", ["companion.app", "companion.build", "companion.commands.run", "companion.cli"])
def test_the_vessel_process_loads_nothing_heavy(entry: str) -> None:
    code = f"import sys, {entry}; print([name for name in {HEAVY!r} if name in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=REPO)
    assert found.stdout.strip() == "[]"


def test_every_module_says_what_its_room_is() -> None:
    silent = [str(path) for path, tree in modules() if not ast.get_docstring(tree) and tree.body]
    assert not silent


def test_no_module_is_longer_than_the_hard_stop() -> None:
    longest = {str(path): (REPO / path).read_text(encoding="utf-8").count("\n") for path, _ in modules()}
    assert not {path: lines for path, lines in longest.items() if lines > 400}


def test_the_core_reckons_the_same_on_every_python() -> None:
    """``sum`` of floats is compensated from Python 3.12 on, and a square by ``**`` is the C library's power on CPython only.

    With either a recording would replay bit for bit on the Python alone that made it.
    """
    of_the_core = [(path, node) for path, node in nodes() if path.parts[:2] == ("companion", "core")]
    sums = [
        f"{path}:{node.lineno}"
        for path, node in of_the_core
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "sum"
    ]
    squares = [
        f"{path}:{node.lineno}"
        for path, node in of_the_core
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow) and getattr(node.right, "value", 0) == 2
    ]
    assert not sums, "take math.fsum"
    assert not squares, "take x * x"


PLACES_AT_MOST = 5
"""Values that a reader can tell apart by their place."""


def test_nothing_is_handed_over_by_place_beyond_five_values() -> None:
    """Two values of one type that change places are seen by no type checker.

    Packers take their fields in the wire's order.
    """
    crowded = [
        f"{path}:{node.lineno} {ast.unparse(node.func)} ({len(node.args)})"
        for path, node in (*nodes(), *nodes(("tools",)))
        if isinstance(node, ast.Call)
        and len(node.args) > PLACES_AT_MOST
        and not ast.unparse(node.func).rpartition(".")[2].startswith("pack")
    ]
    assert not crowded


def bare_constants(path: Path, tree: ast.Module) -> Iterator[str]:
    """Numbers of a module that say nothing of themselves; one text may stand for the two or three right above it."""
    silent: list[str] = []
    for node in tree.body:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            silent = silent[:-3]
            continue
        target = (
            node.target
            if isinstance(node, ast.AnnAssign)
            else node.targets[0]
            if isinstance(node, ast.Assign)
            else None
        )
        if not isinstance(target, ast.Name) or not target.id.strip("_").isupper():
            yield from silent
            silent = []
        elif is_number(node.value):
            silent.append(f"{path}:{node.lineno} {target.id}")
    yield from silent


def is_number(value: ast.expr | None) -> bool:
    if isinstance(value, ast.BinOp):
        return is_number(value.left) or is_number(value.right)
    value = value.operand if isinstance(value, ast.UnaryOp) else value
    return isinstance(value, ast.Constant) and type(value.value) in (int, float)


def test_every_number_of_the_core_says_why_it_has_its_value() -> None:
    bare = [
        text
        for path, tree in modules()
        if path.parts[:2] == ("companion", "core")
        for text in bare_constants(path, tree)
    ]
    assert not bare


def test_no_room_holds_more_than_twenty_modules() -> None:
    rooms = Counter(path.parent for path, _ in (*modules(), *tool_modules()) if path.name != "__init__.py")
    assert not {str(room): count for room, count in rooms.items() if count > 20}


def hands_over_texts(method: ast.FunctionDef) -> bool:
    """Whether this asks for nothing and gives texts for the operator: pairs of how grave and what."""
    given = method.args
    is_asked = [each.arg for each in given.args] == ["self"] and not given.kwonlyargs and given.vararg is None
    gives = ast.unparse(method.returns) if method.returns is not None else ""
    return is_asked and any(pair in gives for pair in ("tuple[Severity, str]", "tuple[int, str]", "[Text"))


def test_texts_climb_by_one_name() -> None:
    """With a step's result, or asked for by ``drain_texts``: a third way would be forgotten by whoever gathers them."""
    others = {
        f"{path}:{node.lineno} {node.name}"
        for path, node in nodes()
        if isinstance(node, ast.FunctionDef)
        and not node.name.startswith("_")
        and not node.decorator_list
        and hands_over_texts(node)
        and node.name != "drain_texts"
    }
    assert not others


WIRE_NAMES = ("mavlink_bridge", "imc", "messages")
"""IMC's own names, as its definition spells them; the vessel's language keeps them for what means the same."""


def test_two_things_have_two_names() -> None:
    """Public classes; a module's own, which begin with an underscore, are nobody else's."""
    places: dict[str, list[str]] = {}
    for path, tree in modules():
        if path.parts[:3] != WIRE_NAMES:
            for node in tree.body:
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    places.setdefault(node.name, []).append(str(path))
    assert not {name: found for name, found in places.items() if len(found) > 1}


HOMES = {
    "6378137": "mavlink_bridge/language/geodesy.py",
    "6371000": "mavlink_bridge/language/geodesy.py",
    "1852": "mavlink_bridge/language/units.py",
}
"""Numbers of the world that have one home each: WGS-84's axis, the earth's mean radius, the nautical mile."""


@pytest.mark.parametrize(("number", "home"), HOMES.items())
def test_a_fact_of_the_world_has_one_home(number: str, home: str) -> None:
    users = {
        str(path)
        for path, node in nodes()
        if isinstance(node, ast.Constant) and type(node.value) in (int, float) and node.value == float(number)
    }
    assert users == {home}


def test_degrees_times_ten_million_has_one_home() -> None:
    """As a float: whole numbers of that size are times in microseconds."""
    users = {
        str(path)
        for path, node in nodes()
        if isinstance(node, ast.Constant) and type(node.value) is float and node.value in (1e7, 1e-7)
    }
    assert users == {"mavlink_bridge/language/units.py"}


COMMAND_NUMBERS = "mavlink_bridge/mavlink/wire/cmd.py"
FROZEN_WITH_THE_RADIO = "mavlink_bridge/radio/codec/wire.py"
ALSO_SOMETHING_ELSE = frozenset((224, 252, 262, 300, 400, 410, 510, 511, 512, 519, 520, 5000))
"""Command numbers that are common as sizes, ids and dates too; by name they are looked at all the same."""


def test_the_numbers_of_commands_have_one_home() -> None:
    telling = {int(cmd) for cmd in Cmd if cmd > 112} - ALSO_SOMETHING_ELSE
    wrong = [
        f"{path}:{node.lineno} {ast.unparse(node)[:60]}"
        for path, node in nodes()
        if path.parts[0] in ("mavlink_bridge", "companion") and "ais" not in path.parts and "imc" not in path.parts
        if str(path) not in (COMMAND_NUMBERS, FROZEN_WITH_THE_RADIO)
        if _is_a_command(node, telling)
    ]
    assert not wrong, "take it from Cmd"


def _is_a_command(node: ast.AST, telling: set[int]) -> bool:
    """A number that is a command's, or a constant that has a command's name and a number."""
    if isinstance(node, ast.Constant):
        return type(node.value) is int and node.value in telling
    if not isinstance(node, ast.AnnAssign) or not isinstance(node.value, ast.Constant):
        return False
    name = ast.unparse(node.target).strip("_").rpartition(".")[2]
    return name in Cmd.__members__ and type(node.value.value) is int


@pytest.mark.parametrize("fact", ["keel", "period"])
def test_a_fact_of_the_boat_has_one_key(fact: str) -> None:
    """The keel is the hull file's, the tick's period ``system.tick_hz``'s; every part gets what follows from them."""
    paths = [key.path for model in (Settings, VesselConfig) for key in keys(model)]
    named = {"keel": "keel_depth_m", "period": "system.tick_hz"}
    other = [
        path for path in paths if (fact in path or (fact == "period" and "tick_hz" in path)) and path != named[fact]
    ]
    assert named[fact] in paths
    assert not other


def test_nothing_is_encoded_by_the_order_of_an_enum() -> None:
    """A number on the wire or on disk is written down beside its meaning, so that a line moved in a class changes nothing.

    Forbidden: a table made from an enum's members in their order, and a member's place among them.
    """
    enums = {
        node.name
        for _, node in nodes()
        if isinstance(node, ast.ClassDef) and any(ast.unparse(base).rpartition(".")[2] in ENUMS for base in node.bases)
    }
    wrong = [
        f"{path}:{node.lineno} {ast.unparse(node)}"
        for path, node in nodes()
        if isinstance(node, ast.Call) and node.args and _is_ordered_table(node, enums)
    ]
    assert not wrong


ENUMS = frozenset(("Enum", "IntEnum", "IntFlag", "StrEnum", "Flag"))


def _is_ordered_table(call: ast.Call, enums: set[str]) -> bool:
    """``tuple(E)``, ``list(E)``, ``enumerate(E)``, ``zip(…, E)`` or ``something(E).index(…)`` of an enum ``E``."""
    name = ast.unparse(call.func)
    if name in ("tuple", "list", "enumerate", "zip"):
        return any(ast.unparse(argument).rpartition(".")[2] in enums for argument in call.args)
    return name.endswith(").index") and name.partition("(")[0] in ("tuple", "list")


@pytest.mark.parametrize("package", ["companion", "sitl"])
def test_every_name_of_a_public_face_is_there_and_told(package: str) -> None:
    face = importlib.import_module(package)
    assert len(face.__all__) <= 10
    assert all(getattr(face, name).__doc__ for name in face.__all__)


def test_the_shipped_packages_need_none_of_the_tools() -> None:
    assert not [f"{path}: {name}" for path, name in imports() if name.startswith(("tools", "tests"))]


@pytest.mark.parametrize("room", ["companion/core/guard", "companion/core/vehicle"])
def test_a_number_says_why_it_is_so(room: str) -> None:
    """A constant with a number has its reason or its source beside it: a sentence below it, or a comment. Neutral needs none."""
    silent = [
        f"{path}:{node.lineno} {ast.unparse(node)[:60]}"
        for path, tree in modules()
        if str(path.parent) == room
        for node, after in itertools.pairwise([*tree.body, ast.Pass()])
        if _is_a_number(node) and not _is_told(path, node, after)
    ]
    assert not silent


def _is_a_number(node: ast.stmt) -> bool:
    if (
        not isinstance(node, ast.Assign | ast.AnnAssign)
        or node.value is None
        or isinstance(node.value, ast.Call | ast.Dict)
    ):
        return False
    numbers = [each.value for each in ast.walk(node.value) if isinstance(each, ast.Constant)]
    return any(type(number) in (int, float) and number for number in numbers)


def _is_told(path: Path, node: ast.stmt, after: ast.stmt) -> bool:
    """A string below it, or a comment on its line or the one above."""
    lines = (REPO / path).read_text(encoding="utf-8").splitlines()
    below = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant) and isinstance(after.value.value, str)
    return below or "#" in lines[(node.end_lineno or node.lineno) - 1] or lines[node.lineno - 2].strip().startswith("#")
