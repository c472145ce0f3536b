"""Puts the bridge together: the node's parts in the order in which they are asked, around one vehicle."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Final

from mavlink_bridge.imc import Node
from mavlink_bridge.mavlink.client import ClientConfig, VehicleClient
from mavlink_bridge.mavlink.wire.signing import SigningState

from ..core.hull.statics import top_speed_mps
from ..facade import SettingsParams
from ..io.imc_sockets import ImcSockets
from ..io.keeping import AnyStore, MemoryStore, Store
from ..io.keeping.content import SaveValue
from ..io.links import Link, open_link
from ..radio import read_key
from ..settings import Settings, load, load_vessel
from . import motion
from .bridge import Bridge
from .desk import Desk
from .desk.foresight import Foresight
from .logbook import LogBook
from .others import Others
from .picture import STREAMS_HZ, ImcPicture
from .settings import ImcSettings
from .state_out import StateOut

KEPT: Final = "imc-desk"


def compose(
    settings: ImcSettings,
    node: Node,
    sockets: ImcSockets,
    utc_us: Callable[[], int | None],
    *,
    link: Link | None = None,
    store: AnyStore | None = None,
) -> Bridge:
    """The whole bridge. Raises ConfigError and LinkConfigError for what cannot be meant."""
    kept = store or (Store(Path(settings.store)) if settings.store else MemoryStore())
    client = VehicleClient(
        ClientConfig(vehicle_id=settings.vehicle_id, answer_s=settings.desk.answer_s, streams_hz=STREAMS_HZ),
        _signing(settings, utc_us()),
    )
    picture, book = ImcPicture(), LogBook(node.utc_s)
    vessel = vessel_settings(settings)
    desk = Desk(
        settings.desk,
        client,
        SettingsParams(vessel),
        foresight=Foresight(
            _top_mps(settings, vessel),
            vessel.mission,
            lambda: motion.here(picture, client.now_us),
            lambda: motion.home(picture),
        ),
        saved=kept.snapshot().values.get(KEPT, ""),
        save=lambda text: _keep(kept, text),
        utc_s=node.utc_s,
    )
    state = StateOut(
        picture,
        desk.view,
        node.utc_s,
        skews=node.skews,
        rudder_full_rad=math.radians(settings.rudder_full_deg),
        state_hz=settings.state_hz,
    )
    others = Others(picture)
    for part in (desk, book, state, others):
        node.add(part)
    return Bridge(
        sockets=sockets,
        node=node,
        link=link or open_link("vehicle", settings.vehicle),
        client=client,
        desk=desk,
        picture=picture,
        others=others,
        book=book,
        utc_us=utc_us,
        store=kept,
    )


def vessel_settings(settings: ImcSettings) -> Settings:
    """The vessel's own settings, or the defaults: names, ranges and units of its parameters are in them."""
    return load(Path(settings.vessel_config), model=Settings) if settings.vessel_config else Settings()


def vessel_parameters(settings: ImcSettings) -> SettingsParams:
    """Names, ranges and units of the vessel's parameters."""
    return SettingsParams(vessel_settings(settings))


def _top_mps(settings: ImcSettings, vessel: Settings) -> float | None:
    """The hull's greatest speed; the default hull's is nobody's."""
    name = settings.vessel or (vessel.vessel if settings.vessel_config else "")
    return top_speed_mps(load_vessel(name)) if name else None


def _keep(store: AnyStore, text: str) -> None:
    store.submit(SaveValue(KEPT, text))


def _signing(settings: ImcSettings, utc_us: int | None) -> SigningState | None:
    if not settings.key_file:
        return None
    state = SigningState(read_key(settings.key_file))
    state.advance(utc_us or 0)
    return state
