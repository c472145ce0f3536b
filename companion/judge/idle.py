"""Keys that stand in the file and do nothing beside the others: they may be kept for another day, and are noted."""

from __future__ import annotations

from collections.abc import Iterator

from ..io.links import LinkConfigError
from ..security import is_local
from ..settings import Settings


def idle_notes(settings: Settings) -> list[str]:
    """Each key that is said and not used, with what would use it."""
    return [f"{key}: is not used, {why}" for key, why in _idle(settings)]


def _idle(settings: Settings) -> Iterator[tuple[str, str]]:
    depth, radio, board = settings.depth, settings.radio, settings.actuators.board
    said = {
        "depth": depth.model_fields_set,
        "depth.map": depth.map.model_fields_set,
        "radio": radio.model_fields_set,
        "failsafe": settings.failsafe.model_fields_set,
        "actuators.board": board.model_fields_set,
    }
    for table, keys, idle, why in (
        ("depth.map", ("order", "pitch_m", "spread_m"), depth.map.file is None, "no chart is named: depth.map.file"),
        ("depth", ("map_sigma_m",), depth.map.file is None, "no chart is named: depth.map.file"),
        ("radio", ("profile", "insecure"), not radio.url, "there is no radio: radio.url"),
        ("failsafe", ("radio_timeout_s",), not radio.url, "there is no radio: radio.url"),
        ("radio", ("insecure",), bool(radio.url) and radio.protocol == "compact", "the compact protocol has a key"),
        ("actuators.board", ("terminator",), board.level == "1", "it is for level 0"),
        ("actuators.board", ("batch", "silence_ms"), board.level == "0", "it is for level 1"),
    ):
        yield from ((f"{table}.{key}", why) for key in keys if idle and key in said[table])
    yield from _links(settings)


def _links(settings: Settings) -> Iterator[tuple[str, str]]:
    for number, sensor in enumerate(settings.sensors):
        if sensor.nmea.relay and not settings.plotter:
            yield f"sensors.{number}.nmea.relay", "no plotter is named: plotter"
    for number, item in enumerate(settings.endpoints):
        try:
            closed = item.insecure and is_local(item.url)
        except LinkConfigError:
            continue
        if closed:
            yield (
                f"endpoints.{number}.insecure",
                "only this computer reaches that link; leave it out, or it opens the next address too",
            )
