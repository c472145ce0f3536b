"""The benchmark tools: every module is found, a failing one shows, and two files are compared by name."""

from __future__ import annotations

import json
import sys
import types

import pytest

from tools import bench, bench_compare


def row(name, value, bar=None, holds=None, unit="s"):
    return {"name": name, "value": value, "unit": unit, "bar": bar, "holds": holds}


def test_modules_are_found_by_name():
    assert "vessel" in bench.modules()
    assert "cells" not in bench.modules()
    assert bench.modules(["vessel"]) == ["vessel"]


def test_a_failing_benchmark_is_a_row_that_does_not_hold(monkeypatch, tmp_path, capsys):
    good = types.ModuleType("tools.benches.good")
    good.run = lambda: [row("speed", 600.0, 500.0, True, "x"), row("size", 34, "<= 35", True, "bytes")]
    bad = types.ModuleType("tools.benches.bad")
    bad.run = lambda: [{"name": "half a row"}]
    monkeypatch.setitem(sys.modules, "tools.benches.good", good)
    monkeypatch.setitem(sys.modules, "tools.benches.bad", bad)
    monkeypatch.setattr(bench, "modules", lambda words=(): ["good", "bad"])
    assert bench.main(["-o", str(tmp_path)]) == 1
    found = json.loads((tmp_path / "bench.json").read_text())
    holds = [(item["name"], item["holds"]) for item in found]
    assert holds == [("speed", True), ("size", True), ("bad failed", False)]
    assert "| speed | 600 | x | 500 | yes |" in (tmp_path / "bench.md").read_text()
    assert "| size | 34 | bytes | <= 35 | yes |" in (tmp_path / "bench.md").read_text()
    assert "half a row" not in capsys.readouterr().out


def test_a_comparison_tells_better_worse_new_and_gone(tmp_path, capsys):
    old = [row("a", 1.0, 2.0, True), row("b", 10.0), row("c", 3.0)]
    new = [row("a", 2.5, 2.0, False), row("b", 10.1), row("d", 1.0)]
    text, lost = bench_compare.compare(old, new)
    assert lost
    assert "| a | 1 s | 2.5 s | +150 % | **bar lost** |" in text
    assert "| b | 10 s | 10.1 s | = |  |" in text
    assert "| c | 3 s |  |  | gone |" in text
    assert "| d |  | 1 s |  | new |" in text
    for name, rows in (("old", old), ("new", new)):
        (tmp_path / name).write_text(json.dumps(rows))
    assert bench_compare.main([str(tmp_path / "old"), str(tmp_path / "new")]) == 1
    assert bench_compare.main([str(tmp_path / "old"), str(tmp_path / "old")]) == 0
    assert bench_compare.main([str(tmp_path / "old"), str(tmp_path / "none")]) == 2
    capsys.readouterr()


@pytest.mark.parametrize("value", [{"name": "x"}, {**row("x", 1.0), "more": 1}])
def test_a_row_has_exactly_its_keys(value):
    with pytest.raises(ValueError, match="a benchmark row has"):
        bench.checked(value)
