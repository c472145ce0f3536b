"""The foreign hull comes from somewhere else: without it the bench says what is missing."""

import sys

import pytest

from tools import foreign_plant


def test_a_folder_that_is_no_checkout_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["foreign_plant", str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        foreign_plant.main()
    assert ended.value.code == 2
    assert "not a checkout of PythonVehicleSimulator" in capsys.readouterr().err


def test_a_trial_is_refused_where_the_foreign_model_is_not_valid(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["foreign_plant", str(tmp_path), "--boat", "tanker", "--trial"])
    with pytest.raises(SystemExit) as ended:
        foreign_plant.main()
    assert ended.value.code == 2
    assert "not valid at rest and astern" in capsys.readouterr().err
