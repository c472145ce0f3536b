"""The vessel's radio port: which protocol speaks on it, under which profile, with what memory of its airtime and
answers.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from hashlib import blake2s
from pathlib import Path

import config as shipped
from mavlink_bridge.language.witness import Witness
from mavlink_bridge.mavlink.endpoint import Endpoint
from mavlink_bridge.mavlink.missions.service import MissionTiming
from mavlink_bridge.mavlink.persona import EndpointConfig, VehiclePort
from mavlink_bridge.radio.aboard import VesselRadio
from mavlink_bridge.radio.air import Ledger, RadioProfile
from mavlink_bridge.radio.air.ledger import STOPS_KEPT
from mavlink_bridge.radio.json_radio import JsonRadio
from mavlink_bridge.radio.memory import KeptLedger, parted
from mavlink_bridge.radio.plain import PlainRadio

from .facade import Shared
from .io.keeping import AnyStore
from .io.keeping.content import SaveValue
from .ports import Conversation
from .settings import ConfigError, Settings, load
from .settings.device import no_device

MEMORY_KEY = "radio"
"""Answers that the compact link gave."""
AIRTIME_KEY = "radio-airtime"
"""Airtime of the hour, whatever protocol used it."""
SIMULATION_KEY = blake2s(b"simulated radio, not for a boat").digest()
"""The key of every simulated radio: everybody has it."""
Converse = Callable[[int, str], Conversation]


def load_radio(name: str) -> RadioProfile:
    """Read a radio profile by its shipped name or by path. Raises ConfigError."""
    path = Path(name) if name.endswith(".toml") else shipped.path("radio", f"{name}.toml")
    if not path.is_file():
        known = ", ".join(sorted(item.stem for item in shipped.path("radio").glob("*.toml")))
        mistake = f"radio.profile = {name!r}: no such file; shipped: {known}; or give a path to a .toml file"
        raise ConfigError("radio", [mistake])
    return load(path, model=RadioProfile)


def stops_of(profile: RadioProfile) -> str:
    """How many stops an hour of a profile holds, for people."""
    ledger = Ledger(profile.hour_us, profile.stop_us)
    count, kept = ledger.stops_left(0), STOPS_KEPT
    if count is None:
        return "any number: no limit of airtime"
    return f"an hour's airtime holds {count} at most, {kept} of them are never spent on anything else"


def read_key(path: str) -> bytes:
    """Read a radio key of 32 bytes. Raises ConfigError for a file that is missing, of another size, or open to others."""
    if not path:
        raise ConfigError(
            "radio", ["radio.key_file is empty: protocol 'compact' needs a key; make one with 'companion keys'"]
        )
    file = Path(path)
    try:
        key = no_device(file).read_bytes()
    except OSError as error:
        raise ConfigError("radio", [f"radio.key_file = {path!r}: {error.strerror}"]) from None
    if len(key) != 32:
        raise ConfigError("radio", [f"radio.key_file = {path!r}: {len(key)} bytes, a key has 32"])
    if file.stat().st_mode & 0o077 and hasattr(file.stat(), "st_blocks"):
        raise ConfigError("radio", [f"radio.key_file = {path!r}: others may read it; chmod 600 {path}"])
    return key


def radio_conversation(
    settings: Settings, vehicle: VehiclePort, store: AnyStore, shared: Shared, witness: Witness | None = None
) -> Converse:
    """Return what makes the conversation of the radio port. It lives as long as the process: a port that closes and opens goes on with it.

    ``shared``: what all endpoints of the vessel have in common. ``witness``: through whom the key is used; a replay's has none. Raises
    ConfigError.
    """
    profile = load_radio(settings.radio.profile)
    talk = _conversation(settings, profile, vehicle, store, shared=shared, witness=witness or Witness())
    return lambda channel, peer: talk


def _conversation(
    settings: Settings,
    profile: RadioProfile,
    vehicle: VehiclePort,
    store: AnyStore,
    *,
    shared: Shared,
    witness: Witness,
) -> Conversation:
    """The protocol's object."""
    protocol, system = settings.radio.protocol, settings.system
    values = store.snapshot().values
    before = values.get(MEMORY_KEY, "")
    hour, memory = parted(values.get(AIRTIME_KEY, ""), before)
    if memory != before:
        _save(store, MEMORY_KEY, memory)
    stop_us = profile.stop_us if protocol == "compact" else 0
    ledger = KeptLedger(profile.hour_us, hour, lambda text: _save(store, AIRTIME_KEY, text), stop_us=stop_us)
    if protocol == "compact":
        return VesselRadio(
            profile,
            witness.placeholder or read_key(settings.radio.key_file),
            vehicle,
            _rng(vehicle),
            nonce=bytes.fromhex(vehicle.identity.start_nonce),
            memory=memory,
            save=lambda text: _save(store, MEMORY_KEY, text),
            system_id=system.system_id,
            ledger=ledger,
            say=shared.say,
            witness=witness,
        )
    if protocol == "json":
        return JsonRadio(profile, system.name, ledger, say=shared.say)
    return plain_radio(profile, vehicle, _rng(vehicle), system_id=system.system_id, ledger=ledger, shared=shared)


def plain_radio(
    profile: RadioProfile,
    vehicle: VehiclePort,
    rng: random.Random,
    *,
    system_id: int = 1,
    ledger: Ledger | None = None,
    shared: Shared | None = None,
) -> PlainRadio:
    """Return the ``mavlink`` protocol: an ordinary endpoint that a ``PlainRadio`` lets speak."""
    config = EndpointConfig(name="radio", system_id=system_id, profile="lora", heartbeat_s=1.0)
    timing = MissionTiming(retry_us=1_500_000, window=1)
    composer, locks = (None, None) if shared is None else (shared.composer, shared.locks)
    return PlainRadio(
        lambda make: Endpoint(config, vehicle, composer=composer, locks=locks, timing=timing, make_outbox=make),
        profile,
        rng,
        ledger=ledger,
    )


def _rng(vehicle: VehiclePort) -> random.Random:
    """Waits by chance, from the start's own: two vessels of one number that start together must not speak at the same moments for ever."""
    return random.Random(f"radio/{vehicle.identity.start_nonce}")


def _save(store: AnyStore, key: str, text: str) -> None:
    store.submit(SaveValue(key, text))
