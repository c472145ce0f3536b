"""A small mutation tester: change one thing in a safety module, and some test must notice.

``python -m tools.mutation companion/core/guard/gate.py -- tests/unit/test_gate.py`` makes every mutant of the file, runs the
given tests against each in a process of its own, and lists the survivors. A mutant is one swapped comparison, operator,
boolean, constant, default, deleted ``not`` or skipped statement. The source file is never touched: the mutant replaces the
module in memory. Changes that cannot alter an output stand in ``tools/mutation_same.toml``, each with its reason, and are left out.
"""

from __future__ import annotations

import argparse
import ast
import copy
import importlib.abc
import importlib.util
import json
import os
import signal
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any

import hypothesis  # loaded once here, not once per mutant
import pydantic
import pytest

LOADED_ONCE = (hypothesis, pydantic)

SAME = Path(__file__).with_name("mutation_same.toml")
_COMPARE: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
_ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
}
_CALLS = {"min": "max", "max": "min", "any": "all", "all": "any"}


Change = tuple[str, Callable[[], None]]


@dataclass(frozen=True)
class Mutant:
    """One change of the source."""

    line: int
    what: str
    source: str


Excuses = dict[str, list[str]]
"""By a line's code: how the changes begin that are left out there."""


def excuses(file: str) -> Excuses:
    """What is excused in a file."""
    found: Excuses = {}
    for entry in tomllib.loads(SAME.read_text("utf-8"))["same"]:
        if entry["file"] == file:
            found.setdefault(entry["line"], []).append(entry["what"])
    return found


def stale() -> list[str]:
    """Excuses for lines that are not there any more."""
    entries = tomllib.loads(SAME.read_text("utf-8"))["same"]
    texts = {
        name: Path(name).read_text("utf-8") for name in {entry["file"] for entry in entries} if Path(name).is_file()
    }
    there = {name: {line.strip() for line in text.splitlines()} for name, text in texts.items()}
    return [f"{each['file']}: {each['line']}" for each in entries if each["line"] not in there.get(each["file"], ())]


def mutants(source: str, excused: Excuses) -> Iterator[Mutant]:
    """Every mutant of a module's text but those that are excused."""
    lines = source.splitlines()
    tree = ast.parse(source)
    idle = _without_effect(tree)
    for index, node in enumerate(list(ast.walk(tree))):
        if id(node) in idle:
            continue
        line = getattr(node, "lineno", 0)
        same = excused.get(lines[line - 1].strip(), ()) if line else ()
        for number, (what, _) in enumerate(_changes(node)):
            if any(what.startswith(beginning) for beginning in same):
                continue
            clone = copy.deepcopy(tree)
            target = list(ast.walk(clone))[index]
            _changes(target)[number][1]()
            yield Mutant(line, what, ast.unparse(ast.fix_missing_locations(clone)))


def _without_effect(tree: ast.AST) -> set[int]:
    """Nodes whose change cannot alter an output: annotations, dataclass options, ``strict`` of zip."""
    found: set[int] = set()
    for node in ast.walk(tree):
        parts: list[ast.AST | None] = []
        if isinstance(node, ast.ClassDef):
            parts += node.decorator_list
        elif isinstance(node, ast.FunctionDef):
            parts += [*node.decorator_list, node.returns, *(argument.annotation for argument in node.args.args)]
        elif isinstance(node, ast.AnnAssign):
            parts.append(node.annotation)
        elif isinstance(node, ast.keyword) and node.arg in ("strict", "maxlen"):
            parts.append(node.value)
        found.update(id(part) for top in parts if top is not None for part in ast.walk(top))
    return found


def _changes(node: ast.AST) -> list[Change]:
    """What can be changed about a node: (text, function that does it in place)."""
    for kind, maker in _MAKERS:
        if isinstance(node, kind):
            return maker(node)
    return []


def _set(node: ast.AST, **values: object) -> Callable[[], None]:
    def change() -> None:
        for key, value in values.items():
            setattr(node, key, value)

    return change


def _comparison(node: ast.Compare) -> list[Change]:
    found: list[Change] = []
    for i, op in enumerate(node.ops):
        for other in _COMPARE.get(type(op), ()):
            ops = [other() if j == i else old for j, old in enumerate(node.ops)]
            found.append((f"{type(op).__name__} -> {other.__name__}", _set(node, ops=ops)))
    return found


def _arithmetic(node: ast.BinOp) -> list[Change]:
    other = _ARITHMETIC.get(type(node.op))
    return [] if other is None else [(f"{type(node.op).__name__} -> {other.__name__}", _set(node, op=other()))]


def _logic(node: ast.BoolOp) -> list[Change]:
    new = ast.Or() if isinstance(node.op, ast.And) else ast.And()
    return [(f"{type(node.op).__name__} -> {type(new).__name__}", _set(node, op=new))]


def _sign(node: ast.UnaryOp) -> list[Change]:
    if isinstance(node.op, ast.Not):
        truth = ast.Call(ast.Name("bool", ast.Load()), [node.operand], [])
        return [("not removed", _set(node, op=ast.UAdd(), operand=truth))]
    return [("minus removed", _set(node, op=ast.UAdd()))] if isinstance(node.op, ast.USub) else []


def _call(node: ast.Call) -> list[Change]:
    if not isinstance(node.func, ast.Name) or node.func.id not in _CALLS:
        return []
    other = _CALLS[node.func.id]
    return [(f"{node.func.id} -> {other}", _set(node, func=ast.Name(other, ast.Load())))]


def _choice(node: ast.IfExp) -> list[Change]:
    return [("arms of the condition swapped", _set(node, body=node.orelse, orelse=node.body))]


def _constants(node: ast.Constant) -> list[Change]:
    value = node.value
    if isinstance(value, bool):
        return [(f"{value} -> {not value}", _set(node, value=not value))]
    if not isinstance(value, int | float):
        return []
    if value == 0:
        new = [value + 1]
    elif value >= 100:
        new = [2 * value]
    else:
        new = [value + 1, -value]
    return [(f"{value} -> {other}", _set(node, value=other)) for other in new]


def _statements(node: ast.FunctionDef | ast.If | ast.For | ast.While | ast.Try) -> list[Change]:
    """Skip one statement of a body (not docstrings, not definitions, not a function's last return)."""
    found: list[Change] = []
    for name in ("body", "orelse"):
        body = getattr(node, name, [])
        for i, statement in enumerate(body):
            if not isinstance(statement, ast.Assign | ast.AugAssign | ast.Expr | ast.Return | ast.Raise | ast.Continue):
                continue
            documentation = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
            last_return = isinstance(statement, ast.Return) and i == len(body) - 1 and isinstance(node, ast.FunctionDef)
            if not documentation and not last_return:
                found.append((f"skipped: {ast.unparse(statement)[:60]}", _skip(body, i)))
    return found


def _skip(body: list[ast.stmt], index: int) -> Callable[[], None]:
    def change() -> None:
        body[index] = ast.Pass()

    return change


_MAKERS: tuple[tuple[type[ast.AST] | tuple[type[ast.AST], ...], Callable[[Any], list[Change]]], ...] = (
    (ast.Compare, _comparison),
    (ast.BinOp, _arithmetic),
    (ast.BoolOp, _logic),
    (ast.UnaryOp, _sign),
    (ast.Constant, _constants),
    (ast.Call, _call),
    (ast.IfExp, _choice),
    ((ast.FunctionDef, ast.If, ast.For, ast.While, ast.Try), _statements),
)


class _Finder(importlib.abc.MetaPathFinder):
    """Serves one module from the mutant's file."""

    def __init__(self, module: str, file: Path) -> None:
        self._module, self._file = module, file

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        return importlib.util.spec_from_file_location(fullname, self._file) if fullname == self._module else None


def _child(module: str, file: Path, tests: list[str]) -> int:
    """In a process of its own: put the mutant in place and run the tests, silently."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    sys.dont_write_bytecode = True
    sys.meta_path.insert(0, _Finder(module, file))
    return int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", "--assert=plain", *tests]))


def run_one(module: str, text: str, tests: list[str], work: Path, number: int, timeout_s: float) -> bool:
    """Run the tests against a mutant; return True when they noticed."""
    file = work / f"mutant_{number}.py"
    file.write_text(text, "utf-8")
    pid = os.fork()
    if pid == 0:
        code = 3
        try:
            code = _child(module, file, tests)
        finally:
            os._exit(code)
    until = time.monotonic() + timeout_s
    try:
        while time.monotonic() < until:
            done, status = os.waitpid(pid, os.WNOHANG)
            if done:
                return status != 0
            time.sleep(0.01)
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
        return True
    finally:
        file.unlink()


def main(arguments: list[str] | None = None) -> int:
    """Mutate one file; print and store the survivors; exit 1 when there are any."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path)
    parser.add_argument("tests", nargs="+")
    parser.add_argument("--out", type=Path, default=Path("build/mutation"))
    parser.add_argument("--lines", default="", help="only lines A-B")
    options = parser.parse_args(arguments)
    module = ".".join(options.file.with_suffix("").parts)
    if not options.file.is_file():
        parser.error(f"{options.file}: no such file; run from the top of the repository")
    options.out.mkdir(parents=True, exist_ok=True)
    source = options.file.read_text("utf-8")
    began = time.monotonic()
    if run_one(module, source, options.tests, options.out, number=0, timeout_s=600.0):
        print("the tests fail without any mutation")
        return 2
    limit_s = 5.0 * (time.monotonic() - began) + 10.0
    todo = list(mutants(source, excuses(options.file.as_posix())))
    if options.lines:
        first, last = (int(part) for part in options.lines.split("-"))
        todo = [mutant for mutant in todo if first <= mutant.line <= last]
    alive = [
        mutant
        for number, mutant in enumerate(todo, 1)
        if not run_one(module, mutant.source, options.tests, options.out, number=number, timeout_s=limit_s)
    ]
    for mutant in alive:
        print(f"{options.file}:{mutant.line}: {mutant.what}: {source.splitlines()[mutant.line - 1].strip()}")
    score = {"file": str(options.file), "mutants": len(todo), "killed": len(todo) - len(alive), "survived": len(alive)}
    (options.out / f"{module}.json").write_text(json.dumps(score), "utf-8")
    print(json.dumps(score))
    return 1 if alive else 0


if __name__ == "__main__":
    sys.exit(main())
