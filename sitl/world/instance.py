"""Several simulators side by side: ports move by ten and the system id by one for each instance."""

from __future__ import annotations

import re
import shlex

from companion.settings import ConfigError

from .settings import SimSettings


def move_instance(settings: SimSettings, number: int) -> SimSettings:
    """Return settings for instance ``number``. Raises ConfigError when it cannot be."""
    system_id = settings.system.system_id + number
    if number < 0 or system_id > 250:
        raise ConfigError("--instance", [f"--instance {number}: 0...{250 - settings.system.system_id} are possible"])
    if number == 0:
        return settings

    def move(url: str) -> str:
        return re.sub(r":(\d+)(?=$|[?/])", lambda port: f":{int(port.group(1)) + 10 * number}", url)

    return settings.model_copy(
        update={
            "system": settings.system.model_copy(update={"system_id": system_id}),
            "sensors": tuple(item.model_copy(update={"url": move(item.url)}) for item in settings.sensors),
            "endpoints": tuple(item.model_copy(update={"url": move(item.url)}) for item in settings.endpoints),
        }
    )


def moved_words(settings: SimSettings, number: int) -> list[str]:
    """Return what a separate ``companion run`` must be told to meet the world of instance ``number``; nothing for the first."""
    if number == 0:
        return []
    moved = {"system.system_id": str(settings.system.system_id)}
    moved |= {f"sensors.{k}.url": item.url for k, item in enumerate(settings.sensors)}
    moved |= {f"endpoints.{k}.url": item.url for k, item in enumerate(settings.endpoints)}
    return [f"--set {shlex.quote(f'{key}={value}')}" for key, value in moved.items()]
