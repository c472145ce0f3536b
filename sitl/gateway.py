"""The shore side of the radio beside the simulated vessel: ``companion sim --gateway``, both ends of the compact link in one process."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from companion.gateway import Gateway, GatewaySettings
from companion.io.links import Link
from companion.io.loop import LoopApp, Waited
from companion.radio import SIMULATION_KEY
from companion.settings import Settings
from companion.settings.schema import EndpointSettings

PORT = 14560
KEY_NAME = "radio.key"
AnySettings = TypeVar("AnySettings", bound=Settings)


def simulation_key(run_dir: Path) -> Path:
    """Write the key that both simulated ends use. It is the same in every simulation: no secret, and no key for a boat."""
    path = run_dir / KEY_NAME
    if not path.exists():
        path.touch(mode=0o600)
        path.write_bytes(SIMULATION_KEY)
    return path


def with_gateway(settings: AnySettings, run_dir: Path) -> AnySettings:
    """Return the vessel's settings with the compact link on its radio port; a profile made for plain MAVLink gives way to 'o-10'."""
    radio = settings.radio
    profile = "o-10" if radio.profile == "plain-10" else radio.profile
    key_file = radio.key_file or str(simulation_key(run_dir))
    radio = radio.model_copy(update={"protocol": "compact", "profile": profile, "key_file": key_file})
    return settings.model_copy(update={"radio": radio})


def vessel_words(settings: Settings) -> str:
    """What a separate ``companion run`` needs to talk to this gateway."""
    radio = settings.radio
    wanted = {"protocol": radio.protocol, "profile": radio.profile, "key_file": Path(radio.key_file).resolve()}
    words = [f"--set radio.{key}={value}" for key, value in wanted.items()]
    return " ".join([*words, f"--set system.system_id={settings.system.system_id}"])


def shore_gateway(settings: Settings, instance: int, run_dir: Path, *, modem: Link | None = None) -> Gateway:
    """Build the gateway on the simulated shore modem's serial port (or on ``modem``)."""
    port = PORT + 10 * instance
    return Gateway(
        GatewaySettings(
            url=f"serial:{run_dir}/lora?baud=9600",
            profile=settings.radio.profile,
            key_file=settings.radio.key_file,
            system_id=settings.system.system_id,
            name=settings.system.name,
            store="",
            endpoints=(EndpointSettings(name="gateway", url=f"udp://127.0.0.1:{port}"),),
        ),
        modem=modem,
        rng=random.Random(f"gateway/{instance}"),
    )


class WithGateway:
    """Vessel and gateway in one loop.

    ``vessel_us``: the time of a vessel that falls behind the clock on a busy machine instead of jumping. The gateway goes by it: two
    clocks that part by more than a second take each other's frames for held back, and the link is dead for minutes.
    """

    def __init__(self, vessel: LoopApp, gateway: Gateway, vessel_us: Callable[[], int] | None = None) -> None:
        self._vessel = vessel
        self._vessel_us = vessel_us
        self.gateway = gateway

    def _time_us(self, now_us: int) -> int:
        return now_us if self._vessel_us is None else self._vessel_us()

    @property
    def links(self) -> Sequence[Waited]:
        return (*self._vessel.links, *self.gateway.links)

    def pump(self, now_us: int) -> None:
        self._vessel.pump(now_us)
        self.gateway.pump(self._time_us(now_us))

    def tick(self, now_us: int, *, late_s: float = 0.0, load: float = 0.0) -> object:
        done = self._vessel.tick(now_us, late_s=late_s, load=load)
        self.gateway.tick(self._time_us(now_us))
        return done

    def shutdown(self, now_us: int) -> None:
        """The vessel writes neutral first."""
        self._vessel.shutdown(now_us)
        self.gateway.shutdown(self._time_us(now_us))
