"""``companion check`` of a gateway's configuration: told by its keys from a vessel's."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path

from ...configuration import gateway_settings, mistakes_of
from ...doors import gateway_doors
from ...judge import gateway_notes, gateway_warnings, verdict
from ...radio import load_radio, read_key, stops_of
from ...settings.device import no_device

_OWN = ("url", "vessel_config", "key_file", "profile")
"""Keys at the top of a gateway's file that no vessel's has."""
_VESSELS = ("sensors", "actuators", "vessel", "steering")


def is_gateway(path: Path) -> bool:
    """Whether a file speaks of a gateway. An unreadable one does not; reading it as a vessel's tells why."""
    try:
        data = tomllib.loads(no_device(path).read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return False
    return any(key in data for key in _OWN) and not any(key in data for key in _VESSELS)


def check(path: Path, overrides: Sequence[str]) -> int:
    """Print what a gateway's configuration means. Raises ConfigError with every mistake."""
    settings = gateway_settings(path, overrides)
    profile = load_radio(settings.profile)
    warnings = gateway_warnings(settings)
    print(f"{path}: {verdict(warnings)}, a gateway's")
    print(f"  modem       {settings.url}")
    print(f"  radio       {profile.title}; {profile.band_rule.title}")
    print(f"  stops       {stops_of(profile)}")
    for endpoint in settings.endpoints:
        print(f"  endpoint    {endpoint.name}: {endpoint.url}, {endpoint.persona}, {endpoint.link_class}")
    for door in gateway_doors(settings):
        print(f"  socket      {door.line}")
    for note in gateway_notes(settings):
        print(f"  NOTE        {note}")
    for warning in warnings:
        print(f"  WARNING     {warning}")
    print(f"  vessel      {settings.name} (system id {settings.system_id})")
    print(f"  parameters  from {settings.vessel_config or 'their defaults: vessel_config spares the radio'}")
    for problem in mistakes_of(lambda: read_key(settings.key_file)):
        print(f"  NOT YET     {problem}")
    return 0
