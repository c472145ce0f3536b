"""Configuration: every mistake at once, nothing silent. Parameters: declared once, refused with a reason."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import config
from companion.settings import params
from companion.settings.schema import ConfigError, Settings, load, load_vessel

GAINS = {"seed": {"heading_gains": {"kp": 1.0}, "speed_gains": {"kp": 1.0}}}
ALL = Settings.model_validate({"steering": GAINS})
TABLE = {entry.param.name: entry for entry in params.entries(Settings)}


def mistakes(tmp_path: Path, text: str, *overrides: str) -> list[str]:
    path = tmp_path / "a.toml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load(path, overrides, Settings)
    return list(caught.value.mistakes)


@pytest.mark.parametrize("name", ["boat.toml", "replay-nmea.toml"])
def test_shipped_examples_load(name: str) -> None:
    assert load(config.path(name), model=Settings).system.system_id == 1


@pytest.mark.parametrize("name", [path.stem for path in sorted(config.path("vessels").glob("*.toml"))])
def test_shipped_vessels_load(name: str) -> None:
    assert load_vessel(name).hull.mass_kg > 0


def test_all_mistakes_come_at_once_with_key_value_and_mend(tmp_path: Path) -> None:
    found = mistakes(
        tmp_path,
        'vesel = "x"\n[system]\nsystem_id = 0\nname = 3\n[mission]\ncruise_speed_mps = -1.0\n',
        "depth.min_altitude_m=5000",
        "nonsense",
    )
    text = "\n".join(found)
    for part in (
        "vesel: no such key",
        "system.system_id = 0",
        "cruise_speed_mps = -1.0",
        "min_altitude_m = 5000",
        "--set",
    ):
        assert part in text
    assert len(found) == 6


@pytest.mark.parametrize("text", ["x = [", "\x00", ""])
def test_what_is_no_toml_or_no_file_is_said(tmp_path: Path, text: str) -> None:
    if text:
        assert mistakes(tmp_path, text)
    else:
        with pytest.raises(ConfigError, match="no such file"):
            load(tmp_path / "none.toml", model=Settings)


def test_an_unknown_vessel_names_the_shipped_ones() -> None:
    with pytest.raises(ConfigError, match="otter"):
        load_vessel("submarine")


def test_overrides_reach_tables_in_lists() -> None:
    settings = load(config.path("boat.toml"), ['sensors.0.url="tcp://10.0.0.1:99"', "system.tick_hz=25"], Settings)
    assert (settings.sensors[0].url, settings.system.tick_hz) == ("tcp://10.0.0.1:99", 25)


@pytest.mark.parametrize(
    "key", ["sensors.9.url", "sensors.first.url", "sensors.-1.url", "sensors.0.url.host", "system.name.x"]
)
def test_an_override_without_a_place_is_a_mistake_of_its_own(tmp_path: Path, key: str) -> None:
    found = mistakes(
        tmp_path, '[system]\nname = "a"\n[[sensors]]\nurl = "tcp://127.0.0.1:1"\n', f"{key}=1", "system.tick_hz=5"
    )
    assert len(found) == 2
    assert found[0].startswith(f"--set {key}=1: ")


def test_parameter_names_are_unique_and_fit_the_wire() -> None:
    names = [entry.param.name for entry in params.entries(Settings)]
    assert len(set(names)) == len(names)
    assert len(names) >= 60
    assert all(len(name) <= 16 and name == name.upper() for name in names)


def test_every_parameter_says_what_it_is() -> None:
    silent = [
        name for name, entry in TABLE.items() if not entry.text or (entry.kind is not bool and entry.minimum is None)
    ]
    assert not silent


@pytest.mark.parametrize("name", sorted(TABLE))
def test_each_parameter_takes_its_range_and_nothing_beyond(name: str) -> None:
    entry, before = TABLE[name], ALL
    taken = [limit for limit in (entry.minimum, entry.maximum) if limit is not None and accepts(entry, limit)]
    assert taken, "neither end of its range is possible beside the other settings' defaults"
    for wrong in (math.nan, math.inf, -math.inf, (entry.maximum or 1e30) * 2 + 1e6, (entry.minimum or 0.0) - 1e6):
        with pytest.raises(ValueError, match=name):
            params.write(before, entry, wrong)
    assert before == Settings.model_validate({"steering": GAINS})


def accepts(entry: params.ParamEntry, value: float) -> bool:
    """Whether a value is taken and read back; a pair of settings that contradict each other may refuse it."""
    try:
        after = params.write(ALL, entry, value)
    except ValueError:
        return False
    return params.read(after, entry) == params.float32(value)


def test_float32_ends_of_a_range_are_inside() -> None:
    entry = next(entry for entry in TABLE.values() if entry.maximum is not None and entry.kind is float)
    wire = params.float32(entry.maximum)
    assert params.read(params.write(Settings(), entry, wire), entry) == wire


def test_whole_numbers_are_asked_for_where_they_are_meant() -> None:
    for entry in TABLE.values():
        if entry.kind is not float:
            with pytest.raises(ValueError, match="whole number"):
                params.write(ALL, entry, (entry.minimum or 0.0) + 0.5)


@pytest.mark.parametrize("name", ["FS_GCS_ACTION", "FS_THR_ACTION"])
def test_between_two_choices_there_is_nothing_and_what_is_offered_is_whole(name: str) -> None:
    with pytest.raises(ValueError, match=rf"^{name} = 2.5: a whole number is needed$"):
        params.write(ALL, TABLE[name], 2.5)
    assert params.read(params.write(ALL, TABLE[name], 2.0), TABLE[name]) == 2.0


def test_a_vessel_without_gains_has_no_parameters_of_them() -> None:
    names = {entry.param.name for entry in params.present(Settings())}
    assert {entry.param.name for entry in params.present(ALL)} - names == {
        f"SEED_{loop}_{part}" for loop in ("SPD", "HDG") for part in ("P", "I", "D", "IMAX")
    }
    with pytest.raises(ValueError, match="no heading_gains"):
        params.write(Settings(), TABLE["SEED_HDG_P"], 1.0)
