"""The shore side of the radio link: a twin of the vessel between the modem's serial port and ground stations.

Stations see an ordinary vehicle through the same endpoints as on the vessel; only changes cross the air. Runs on a
ground station's computer, Windows included.
"""

from __future__ import annotations

import logging
import random
import secrets
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from pydantic import Field

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.requests import LoadPlan, Reply, Request, Result, SetParameter, TakeCommand
from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.mavlink.endpoint import Endpoint
from mavlink_bridge.mavlink.missions.service import MissionTiming, UploadLocks
from mavlink_bridge.mavlink.persona import EndpointConfig, Identity
from mavlink_bridge.mavlink.wire.codec import dialect
from mavlink_bridge.radio.air import Priority, RadioProfile
from mavlink_bridge.radio.codec.request import crosses
from mavlink_bridge.radio.memory import KeptLedger
from mavlink_bridge.radio.session import NONCE_BYTES
from mavlink_bridge.radio.shore import ShoreTwin
from mavlink_bridge.radio.shore.room import most_items
from mavlink_bridge.radio.shore.showing import Showing

from .core.config import Config
from .core.guard.gate import Gate, GateConfig
from .core.vehicle.config import OperatorIds
from .core.vehicle.operators import Operators
from .facade import SettingsParams, software_version
from .io.keeping import AnyStore, MemoryStore
from .io.keeping.content import SaveValue
from .io.keeping.shore_picture import PictureKeeper
from .io.links import Link, Opened, Received, open_link
from .ports import Conversation, GroundPort
from .radio import load_radio, read_key
from .security import Keeper
from .settings import Settings, load
from .settings.schema import EndpointSettings, SecurityConfig
from .strangers import Strangers

log = logging.getLogger(__name__)

MEMORY_KEY: Final = "gateway"
HEARD_KEY: Final = "gateway-heard"
"""Airtime of the vessel in the last hour, as heard."""
PERIOD_US: Final = 10_000
"""An order that waits for a state on the air goes out to the hundredth of a second."""
_SHOW_US: Final = 50_000
"""How often stations are shown the vessel; what an answer of it tells is shown at once."""
RATES_HZ: Final = {
    "ATTITUDE": 1.0,
    "GLOBAL_POSITION_INT": 1.0,
    "VFR_HUD": 1.0,
    "GPS_RAW_INT": 1.0,
    "SYS_STATUS": 1.0,
    "BATTERY_STATUS": 0.5,
    "EXTENDED_SYS_STATE": 1.0,
    "HOME_POSITION": 0.5,
    "MISSION_CURRENT": 1.0,
    "CURRENT_MODE": 0.5,
    "ALTITUDE": 1.0,
}
"""What the radio's states are shown as; what they do not tell, actuators for one, is not shown."""
_LOCAL_US: Final = 1_000_000
_SETTLE_US: Final = 2_000_000
"""The modem is given so long to open before it counts as missing."""
_PRESENT_US: Final = 3_500_000


class GatewaySettings(Config):
    """The whole configuration of a gateway."""

    url: str = "serial:/dev/ttyUSB0?baud=9600"
    """The shore modem's serial port; serial:COM5?baud=9600 on Windows."""
    profile: str = "o-10"
    """Radio profile, the same as on the vessel: name of a file in config/radio, or a path."""
    key_file: str = ""
    """The 32-byte key of the link, the same as on the vessel."""
    system_id: int = Field(1, ge=1, le=250)
    """The vessel's system id."""
    name: str = "usv"
    """The vessel's name as stations and texts here show it."""
    vessel_config: str = ""
    """The vessel's own configuration file: the parameters then start from its values. Empty: from the defaults."""
    store: str = "state/gateway.db"
    """Answers and airtime; must survive a restart. Empty = memory only."""
    entity_label: str = ""
    """The original's Entity Label: labels the log."""
    operator_ids: OperatorIds = ()
    """Who may command through this gateway, as the vessel's ``operator.ids``; empty: whoever orders."""
    endpoints: tuple[EndpointSettings, ...] = (EndpointSettings(name="gcs", url="udp://127.0.0.1:14550"),)
    security: SecurityConfig = SecurityConfig()
    """Signing between gateway and ground stations; its key has nothing to do with the radio's."""


class Gateway:
    """What ``companion gateway`` runs; driven by the loop like the vessel's app."""

    def __init__(
        self,
        settings: GatewaySettings,
        *,
        make_link: Callable[[str, str], Link] = open_link,
        modem: Link | None = None,
        store: AnyStore | None = None,
        rng: random.Random | None = None,
        started_utc_us: int = 0,
    ) -> None:
        self.settings = settings
        self.profile: RadioProfile = load_radio(settings.profile)
        self.store = store or MemoryStore()
        self.keeper = Keeper(
            settings, self.store, lambda severity, text: self._say(severity.value, text), started_utc_us
        )
        self.strangers = Strangers(lambda severity, text: self._say(severity.value, text))
        vessel = load(Path(settings.vessel_config), model=Settings) if settings.vessel_config else Settings()
        self.twin = ShoreTwin(
            profile=self.profile,
            key=read_key(settings.key_file),
            params=SettingsParams(vessel),
            identity=Identity(
                uid=0x5553_5600_0000_0000 | settings.system_id, version=software_version(), name=settings.name
            ),
            neutral=Gate(GateConfig(), 0.0, PERIOD_US).neutral(0, "not told by the radio"),
            rng=rng or random.Random(secrets.randbits(64)),
            nonce=secrets.token_bytes(NONCE_BYTES) if rng is None else rng.randbytes(NONCE_BYTES),
            memory=self.store.snapshot().values.get(MEMORY_KEY, ""),
            save=self._save,
            system_id=settings.system_id,
        )
        self.modem = modem or make_link("modem", settings.url)
        heard = self.store.snapshot().values.get(HEARD_KEY, "")
        theirs = KeptLedger(self.profile.hour_us, heard, self._save_heard, stop_us=self.profile.stop_us)
        self._showing = Showing(self.twin.link, theirs)
        self._modem_open: bool | None = None
        """None: neither seen to open nor found closed; it may have been open before."""
        self._modem_missing = False
        self._since_us: int | None = None
        self._locks = UploadLocks()
        self.grounds: list[GroundPort] = []
        for number, item in enumerate(settings.endpoints):
            self.grounds.append(self._ground(number, item, make_link(item.name, item.url)))
        self.operators = Operators(settings.operator_ids, gcs_s=_PRESENT_US / 1e6, radio_s=_PRESENT_US / 1e6)
        self._owners: dict[tuple[int, int], tuple[Conversation, Request]] = {}
        self._ticks = 0
        self._shown_us: int | None = None
        self._stood_us: int | None = None
        self.view: Callable[[Snapshot], None] | None = None
        """Shown each picture of the vessel that is fresh enough for stations."""
        self._local_us: int | None = None
        self._was_fresh = False
        self._memory = PictureKeeper(self.twin, self.store, started_utc_us)
        self._now_us = 0

    def _ground(self, number: int, item: EndpointSettings, link: Link) -> GroundPort:
        config = EndpointConfig(
            name=item.name,
            persona=item.persona,
            system_id=self.settings.system_id,
            link_class=item.link_class,
            profile="lan",
            rates_hz=RATES_HZ,
            give_up_s=self.profile.link.command_s + 5.0,
        )
        # the radio gives up sooner, and says so; what it leaves to the vessel's states it adds to its time
        store_us = round(2 * self.profile.link.upload_s * 1e6)
        timing = MissionTiming(hold_us=400_000, store_us=store_us, most_items=most_items(self.profile))

        def met(system_id: int, persona: str) -> None:
            warning = self.keeper.met(item.name)
            if warning:
                self._say(Severity.WARNING.value, warning)

        def converse(channel: int, peer: str) -> Endpoint:
            return Endpoint(
                config,
                self.twin,
                timing=timing,
                locks=self._locks,
                signing=self.keeper.state,
                link_id=number,
                on_key=self.keeper.take_key,
                on_station=met,
            )

        return GroundPort(link, "endpoint", converse, self.strangers.doorstep(config, self.keeper.state, number))

    def _save(self, text: str) -> None:
        self.store.submit(SaveValue(MEMORY_KEY, text))

    def _save_heard(self, text: str) -> None:
        self.store.submit(SaveValue(HEARD_KEY, text))

    # ---- what the loop drives -----------------------------------------------------------------------------------

    @property
    def links(self) -> Sequence[Link]:
        return (self.modem, *(ground.link for ground in self.grounds))

    def pump(self, now_us: int) -> None:
        """Serve modem and stations."""
        self._now_us = now_us
        for event in self.modem.poll(now_us):
            if isinstance(event, Received):
                self.twin.receive(event.data, now_us)
            else:
                self._modem_open = isinstance(event, Opened)
                log.info("modem %s", "opened" if isinstance(event, Opened) else f"closed: {event.reason}")
        for ground in self.grounds:
            ground.read(now_us)
            for talk, request in ground.requests():
                self._take_up(talk, request, now_us)
        self._answer(now_us)
        self._transmit(now_us)
        for ground in self.grounds:
            ground.flush(now_us)

    def tick(self, now_us: int, *, late_s: float = 0.0, load: float = 0.0) -> object:
        """Serve all, and every ``_SHOW_US`` let the stations see the vessel as last heard, if that is fresh enough."""
        shown_us = self._shown_us
        if shown_us is None or now_us - shown_us >= _SHOW_US - PERIOD_US // 2 or self.twin.stood_us != self._stood_us:
            self._shown_us, self._stood_us = now_us, self.twin.stood_us
            self._show(now_us)
        self.pump(now_us)
        return self

    def _show(self, now_us: int) -> None:
        self._ticks += 1
        self.twin.tick(now_us, station_present=self._station_present(now_us))
        snapshot = self.twin.snapshot(now_us, self._ticks)
        self.keeper.tick(now_us, snapshot)
        for ground in self.grounds:
            if snapshot is not None:
                ground.tick(now_us, snapshot)
        if snapshot is not None and self.view is not None:
            self.view(snapshot)
        for severity, text in self.operators.drain_texts():
            self._say(severity.value, text)
        if (word := self._showing.word(now_us, self.twin.state_us)) and not self._modem_missing:
            log.warning(word)
            self._say(Severity.WARNING.value, word)
        self._say_freshness(snapshot is not None)
        self._note_modem(now_us)
        if self._local_us is None or now_us - self._local_us >= _LOCAL_US:
            self._local_us = now_us
            self._local_values(now_us)
            self.strangers.look([ground.link for ground in self.grounds], now_us)
        self._memory.keep(now_us)
        self.store.completions()

    def shutdown(self, now_us: int) -> None:
        self._memory.keep(now_us, at_once=True)
        for link in self.links:
            link.close()
        self.keeper.close(now_us)
        self.store.close()

    # ---- inside -------------------------------------------------------------------------------------------------

    def _transmit(self, now_us: int) -> None:
        if self._modem_open is False:
            return  # a frame that is taken costs airtime
        frame = self.twin.take(now_us)
        taken = self.modem.write(0, frame) if frame else 0
        if frame and self._modem_open is None:
            self._modem_open = taken > 0
        if self._modem_open and taken != len(frame):
            log.warning("the modem took only part of a frame")

    def _note_modem(self, now_us: int) -> None:
        """Say in the log that the modem is missing, once it has had time to open, and when it is back."""
        if self._since_us is None:
            self._since_us = now_us
        missing = not self._modem_open and now_us - self._since_us >= _SETTLE_US
        if missing == self._modem_missing:
            return
        self._modem_missing = missing
        if missing:
            log.warning("modem is missing, tried again for ever: %s", self.modem.describe())
        else:
            log.info("modem is there: %s", self.modem.describe())

    def _take_up(self, talk: Conversation, request: Request, now_us: int) -> None:
        if isinstance(request.body, TakeCommand):
            talk.reply(request.id, self.operators.asked(request.body, request.station, now_us), now_us)
            return
        if refusal := self.operators.objection(request.body, request.station, now_us, manual=False):
            talk.reply(request.id, Reply(Result.REJECTED_NOW, refusal), now_us)
        elif isinstance(request.body, LoadPlan) or crosses(request.body):
            owner = (id(talk), request.id)
            self._owners[owner] = (talk, request)
            self.twin.submit(owner, request.body, now_us, request.origin, station=request.station)
        elif request.reply:
            reason = f"{type(request.body).__name__} does not cross the radio link"
            talk.reply(request.id, Reply(Result.DENIED, reason), now_us)
        else:
            self.twin.ignore(request.body, now_us)

    def _answer(self, now_us: int) -> None:
        owned = ((self._owners.pop(owner, None), reply) for owner, reply in self.twin.replies())  # type: ignore[call-overload]
        answers = [(*asked, reply) for asked, reply in owned if asked is not None]
        for _, request, reply in answers:
            if reply.result is Result.ACCEPTED:
                self._done(request, now_us)
        changed, self.twin.changed_params = self.twin.changed_params, []
        for name in changed:
            for talk in self._conversations():
                talk.param_changed(name)
        for talk, request, reply in answers:
            talk.reply(request.id, reply, now_us)

    def _done(self, request: Request, now_us: int) -> None:
        """The vessel has carried a request out; its sender is answered next."""
        body, station, state = request.body, request.station, self.twin.state
        self.twin.deeds.note(body)
        if isinstance(body, SetParameter):
            self.twin.changed_params.append(body.name)
        self.operators.obeyed(body, station, now_us, manual=False)
        self.operators.has_set(body, station, armed=state is not None and state.armed)

    def _conversations(self) -> list[Conversation]:
        return [talk for ground in self.grounds for talk in ground.conversations.values()]

    def _station_present(self, now_us: int) -> bool:
        """Whether the station that commands through this gateway is alive: no observer and no forwarder is told to the vessel."""
        heard = [each for ground in self.grounds for each in ground.heard()]
        age_s = self.operators.ages(heard, now_us).gcs_s
        return age_s is not None and age_s * 1e6 < _PRESENT_US

    def _say_freshness(self, fresh: bool) -> None:
        """Tell the stations when the vessel falls silent and when it is back."""
        if fresh == self._was_fresh:
            return
        self._was_fresh = fresh
        stale_s = self.profile.link.stale_after_s
        text = "Radio: the vessel is heard" if fresh else f"Radio: nothing from the vessel for {stale_s:.0f} s"
        if fresh and self.twin.link.heard_us is None:
            text = f"Radio: started anew; the vessel was heard {self.twin.age_s(self._now_us) or 0.0:.0f} s ago"
        log.warning(text)
        self._say((Severity.INFO if fresh else Severity.WARNING).value, text)

    def _say(self, severity: int, text: str) -> None:
        for talk in self._conversations():
            if isinstance(talk, Endpoint):
                talk.say(severity, text)

    def _local_values(self, now_us: int) -> None:
        """Age of the state, airtime left, link quality: the gateway's own. Texts when there is no snapshot for them."""
        twin = self.twin
        age_s = twin.age_s(now_us)
        left_us = twin.link.ledger.left_us(Priority.COMMAND, now_us)
        limit_us = self.profile.hour_us
        share = 100 if left_us is None or not limit_us else round(100 * left_us / limit_us)
        values = {
            "radio_age": -1.0 if age_s is None else age_s,
            "air_left": -1.0 if left_us is None else left_us * 1e-6,
        }
        messages = [
            dialect.MAVLink_named_value_float_message(now_us // 1000 & 0xFFFFFFFF, name.encode(), value)
            for name, value in values.items()
        ]
        bad = min(twin.link.opener.strange_bytes, 0xFFFF)
        messages.append(
            dialect.MAVLink_radio_status_message(
                rssi=255, remrssi=255, txbuf=share, noise=255, remnoise=255, rxerrors=bad, fixed=0
            )
        )
        for talk in self._conversations():
            if isinstance(talk, Endpoint):
                for message in messages:
                    talk.send(message)
        if not twin.is_fresh(now_us):
            for severity, text in twin.drain_texts():
                self._say(severity, text)
