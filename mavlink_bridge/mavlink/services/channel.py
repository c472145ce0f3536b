"""What the services of one endpoint share: the way out to its stations, the way in to the vessel, and what both last said."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from ...language.requests import Origin, PlanKind, Reply, RequestBody
from ...language.snapshot import Snapshot
from ..commands.table import Context
from ..files.metadata import component_metadata
from ..files.params import EndpointParams
from ..files.stub_params import COMMON_STUBS, ROVER_STUBS
from ..persona import EndpointConfig, VehiclePort
from ..telemetry.outbox import Bulk, Outbox
from ..telemetry.speaker import Speaker
from ..telemetry.streams import MISSION_CURRENT, Streams
from ..wire.payload import Packed, packed
from .asking import FULL, Asking


class Channel:
    """One endpoint's. ``refuse``: takes the answer to a request for which there was no room, as if the vessel had given it."""

    def __init__(
        self,
        config: EndpointConfig,
        vehicle: VehiclePort,
        *,
        outbox: Outbox,
        speaker: Speaker,
        streams: Streams,
        refuse: Callable[[int, Reply], None],
    ) -> None:
        self.config, self.vehicle, self.streams = config, vehicle, streams
        self.asking = Asking()
        stubs = ROVER_STUBS if config.persona == "ardurover" else COMMON_STUBS
        self.params = EndpointParams(vehicle.params, stubs)
        """What this link shows of the parameters."""
        self.now_us = 0
        self.high_latency_on = False
        """Whether a station has switched the summaries of a high-latency link on."""
        self.is_slow = config.profile == "lora"
        """A plan's dialogue must not queue behind texts and values there: the station's timers run."""
        self._outbox, self._speaker, self._refuse = outbox, speaker, refuse

    # To the stations

    def answer(self, messages: Iterable[Any], *, urgent: bool = False) -> None:
        """Send what somebody waits for; ``urgent`` before all else."""
        queue = self._outbox.urgent if urgent else self._outbox.answer
        for message in messages:
            queue(packed(message))

    def answer_packed(self, messages: Iterable[Packed]) -> None:
        """Send answers that are packed already."""
        for message in messages:
            self._outbox.answer(message)

    def bulk(self, source: Bulk) -> None:
        """Send a long list as room allows."""
        self._outbox.bulk(source)

    def say(self, severity: int, text: str) -> None:
        """Send a text."""
        self._speaker.say(severity, text)

    def explain(self, reason: str, *, rarely: bool = False) -> None:
        """Say why something was refused, each reason at a bounded rate."""
        self._speaker.explain(reason, self.now_us, rarely=rarely)

    def show_plans_place(self) -> None:
        """Send MISSION_CURRENT with the next snapshot, whatever its rate."""
        self._speaker.wanted.add(MISSION_CURRENT)

    def hush(self, *, streams: bool) -> None:
        """Let streams wait, or flow again."""
        self._speaker.is_quiet = streams

    # To the vessel

    def ask(
        self, body: RequestBody, sender: int, note: Callable[[int], object] | None = None, origin: Origin | None = None
    ) -> None:
        """Ask the vessel. ``note`` is told the number of the request, under which the answer comes."""
        request_id = self.asking.number()
        if note is not None:
            note(request_id)
        if not self.asking.order(request_id, body, sender, origin):
            self._refuse(request_id, FULL)

    def stream(self, body: RequestBody | None, sender: int) -> None:
        """Hand on a set-point, sticks or data, if there are any: nobody waits for an answer."""
        if body is not None:
            self.asking.stream(body, sender)

    # What is known

    @property
    def snapshot(self) -> Snapshot | None:
        """The vessel after its newest tick; None before the first."""
        return self._speaker.snapshot

    @property
    def armed(self) -> bool:
        """Whether the vessel is armed, or nobody knows."""
        return self.snapshot is None or self.snapshot.armed

    def context(self) -> Context:
        """What a command's meaning depends on."""
        snapshot = self.snapshot
        return Context(
            home_item=self.config.has_home_item,
            plan_length=len(self.vehicle.plans.items(PlanKind.MISSION)),
            plan_seq=snapshot.progress.seq if snapshot else 0,
            psi_rad=snapshot.state.psi_rad if snapshot else None,
        )

    def compose(self, number: int) -> Packed | None:
        """The message of this id from the newest snapshot."""
        return self._speaker.compose(number)

    def component_metadata(self) -> Any:
        """COMPONENT_METADATA with the CRC of what FTP serves here; None on a slow link, which must not carry files."""
        return None if self.is_slow else component_metadata(self.params, self.now_us)
