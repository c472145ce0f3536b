"""A configuration judged whole: by its schema, and by what only the addresses and files that it names can tell.

Every command that opens links reads its settings here, so that whatever is wrong is told in one go, each mistake with its
key, its value and the mend, before anything opens.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from . import security
from .io.links import LinkConfigError, check_link
from .radio import load_radio
from .settings import ConfigError, Settings, load, load_vessel

if TYPE_CHECKING:
    from .gateway import GatewaySettings

AnySettings = TypeVar("AnySettings", bound=Settings)


def vessel_settings(path: Path, overrides: Sequence[str]) -> Settings:
    """Read a vessel's configuration. Raises ConfigError with every mistake."""
    return load(path, overrides, Settings, further=vessel_mistakes)


def gateway_settings(path: Path, overrides: Sequence[str]) -> GatewaySettings:
    """Read a gateway's configuration. Raises ConfigError with every mistake."""
    from .gateway import GatewaySettings

    return load(path, overrides, GatewaySettings, further=gateway_mistakes)


def vessel_mistakes(settings: Settings) -> list[str]:
    """What of a vessel's settings cannot be meant, though each value is of the right kind."""
    found = link_mistakes(settings) + security.mistakes(settings)
    if settings.radio.url:
        found += mistakes_of(lambda: load_radio(settings.radio.profile))
    return found + mistakes_of(lambda: load_vessel(settings.vessel))


def gateway_mistakes(settings: GatewaySettings) -> list[str]:
    """The same of a gateway's."""
    wanted = [("url", settings.url, None)]
    wanted += [(f"endpoints.{number}.url", item.url, None) for number, item in enumerate(settings.endpoints)]
    found = [*_wrong_links(wanted), *security.mistakes(settings)]
    found += mistakes_of(lambda: load_radio(settings.profile))
    if settings.vessel_config:
        found += mistakes_of(lambda: load(Path(settings.vessel_config), [], Settings))
    return found


def link_mistakes(settings: Settings) -> list[str]:
    """Every link of a vessel whose address cannot be meant, with its key."""
    wanted = [(f"sensors.{number}.url", item.url, item.baud) for number, item in enumerate(settings.sensors)]
    wanted.append(("actuators.url", settings.actuators.url, settings.actuators.baud))
    wanted += [(f"endpoints.{number}.url", item.url, None) for number, item in enumerate(settings.endpoints)]
    wanted.append(("radio.url", settings.radio.url, None))
    wanted.append(("plotter", settings.plotter, None))
    return _wrong_links(wanted)


def mistakes_of(read: Callable[[], object]) -> list[str]:
    """What a part of the configuration says when it is read."""
    try:
        read()
    except ConfigError as error:
        return list(error.mistakes)
    return []


def _wrong_links(wanted: Iterable[tuple[str, str, int | None]]) -> list[str]:
    """What is wrong with links, each as (key, address, baud rate)."""
    found = []
    for key, url, baud in wanted:
        if not url:
            continue
        try:
            check_link(url, **({} if baud is None else {"baud": baud}))
        except LinkConfigError as error:
            found.append(f"{key} = {url!r}: {error}")
    return found
