"""The mutation tester's own book: what it leaves out is there, and nothing else is left out."""

from __future__ import annotations

from tools.mutation import excuses, mutants, stale


def test_every_excuse_is_for_a_line_that_is_there():
    assert stale() == []


def test_an_excused_change_is_left_out_and_no_other():
    source = "def f(a, b):\n    return a > b\n"
    assert [each.what for each in mutants(source, {})] == ["Gt -> GtE", "Gt -> Lt"]
    assert [each.what for each in mutants(source, {"return a > b": ["Gt -> GtE"]})] == ["Gt -> Lt"]
    assert not list(mutants(source, {"return a > b": [""]}))


def test_the_gate_has_its_excuses():
    assert excuses("companion/core/guard/gate.py")
