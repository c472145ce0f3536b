"""The NMEA 0183 reader: bytes of one link in, stamped measurements out (the seed's LT1000 without its faults)."""

from __future__ import annotations

import re
from typing import Final, assert_never

from pydantic import Field, field_validator

from mavlink_bridge.language.messages import AngularVelocity, Distance, EulerAngles, Measurement, Severity, Source

from ..ais.receiver import AisReceiver, AisWord, ReceivedReport, is_ais
from ..config import Config, param
from .epoch import BODY_KINDS, Calendar, EpochBuilder
from .fields import BadFieldError, EpochPart, Part, PassedOverError, day_number
from .line import LineReader, frame
from .receivers import Receivers
from .sentences import DEPTH_KINDS, EPOCH_KINDS, Decoder, decoder_of, kind_of
from .wanted import WantedSentences
from .watch import NmeaWatch, SentenceRhythm

_Route = tuple[Decoder, int, SentenceRhythm, Source]
"""What decodes the sentences of one address and how old they are, what counts them, and whose they are."""

_CHECK_US: Final = 200_000
"""Silence is told to a fifth of a second, and costs nothing meanwhile."""
_TALKER: Final = re.compile("-?[A-Z0-9]{2}")
_RELAY_LINES: Final = 200
"""A second of the fullest line, at 115 200 baud; a plotter that reads no faster misses the oldest."""
_ROUTES_MAX: Final = 64
"""Pairs of talker and sentence; a line that invents talkers fills no memory."""
_VARIATION_HOLD_US: Final = 60_000_000
"""RMC gives the variation every second, if at all; over a minute it is the same."""
_AIS_WORDS: Final = frozenset(("AITXT", "AIALR"))
"""What an AIS receiver says of itself."""
_AIS_MAX: Final = 512
"""Reports kept between two ticks: a second of a full line is 47."""


class NmeaConfig(Config):
    """How to read one NMEA line."""

    sentences: str = ""
    """Sentences to use, in the order sent, as full names or formatters: 'GPZDA, GPGGA, GPRMC, GPVTG, GPHDT' or
    'ZDA, GGA, RMC, VTG, HDT'. Any talker matches; of two sensors with one quantity the one named in full leads. A minus
    forbids: '-HDM', '-GPHDT'. Empty, or only forbidden ones: every other sentence that is understood."""
    talkers: tuple[str, ...] = ()
    """Talkers in order of preference, e.g. ["GN", "HE"]: their sensors lead, others step in when they are silent. Position,
    speed and time count from no other talker than those named, if one of them can have a position. A minus forbids a talker
    altogether: ["-II"]. Empty: sensors before repeaters (II, IN, EC, AP, AG), else the one heard first."""
    checksum_required: bool = True
    """False: also take sentences that carry no checksum (old loggers)."""
    epoch_limit_s: float = Field(0.25, gt=0.0, le=2.0)
    """An epoch is published after this time even when sentences are missing."""
    position_latency_s: float = param(
        0.12, "NMEA_POS_DELAY", "Age of a position when its first byte arrives", unit="s", ge=0.0, le=1.0
    )
    heading_latency_s: float = param(
        0.0, "NMEA_HDG_DELAY", "Age of heading, attitude and turn rate when they arrive", unit="s", ge=0.0, le=1.0
    )
    depth_latency_s: float = Field(0.0, ge=0.0, le=1.0)
    """Age of a depth when it arrives, seconds."""
    relay: bool = False
    """Keep the good sentences for ``take_relay``: a plotter listens to what the vessel hears."""
    earliest_year: int = Field(2025, ge=1980, le=2200)
    """Dates before this year are a receiver's roll-over (1024 weeks) or start value: the time is not used."""

    @field_validator("talkers")
    @classmethod
    def _two_letters(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        strange = [talker for talker in value if not _TALKER.fullmatch(talker.strip().upper())]
        if strange:
            raise ValueError(f"{', '.join(strange)}: a talker is two letters, such as GN; -GN forbids it")
        return value


class NmeaReader:
    """One link's reader. ``receive`` and ``poll`` never raise, whatever arrives; memory is bounded."""

    def __init__(self, config: NmeaConfig, name: str = "NMEA", depths_m: tuple[float, float] = (0.0, 0.0)) -> None:
        """``name`` begins every operator text. ``depths_m``: this link's transducer and the keel, below the waterline.

        They turn DBS (below surface) and DBK (below keel) into distances from the transducer.
        """
        self._transducer_m, self._keel_m = depths_m
        self.name = name
        self._line = LineReader()
        self._watch = NmeaWatch(name)
        self._routes: dict[str, _Route] = {}
        self._dropped = {"malformed": 0, "unknown": 0, "filtered": 0, "other_talker": 0}
        self._bytes = 0
        self._relay: list[bytes] = []
        self._ais: AisReceiver | None = None
        self.ais_found: list[ReceivedReport | AisWord] = []
        """What AIS receivers have brought since ``take_ais``."""
        self._checked_us = -_CHECK_US
        self._variation: tuple[float, int] | None = None
        self.configure(config)

    def configure(self, config: NmeaConfig) -> None:
        """Take new settings; an epoch being collected is dropped."""
        self.config = config
        self._line.checksum_required = config.checksum_required
        self._wanted = WantedSentences(config.sentences, config.talkers)
        self._routes.clear()
        self._receivers = Receivers(self._wanted, self.name, self._builder)
        self._heading_latency_us = round(config.heading_latency_s * 1e6)
        self._depth_latency_us = round(config.depth_latency_s * 1e6)

    def _builder(self) -> EpochBuilder:
        config = self.config
        bodies = [kind for kind in self._wanted.order if kind in BODY_KINDS]
        return EpochBuilder(
            limit_us=round(config.epoch_limit_s * 1e6),
            latency_us=round(config.position_latency_s * 1e6),
            calendar=Calendar(day_number(config.earliest_year, 1, 1)),
            last_kind=bodies[-1] if bodies else None,
        )

    def receive(self, data: bytes, now_us: int) -> list[Measurement]:
        """Take bytes as they came; return what they completed, oldest first."""
        self._bytes += len(data)
        found: list[Measurement] = []
        bodies = self._line.receive(data)
        for body in bodies:
            self._sentence(body, now_us, found)
        if self.config.relay:
            self._relay = [*self._relay, *(frame(body) for body in bodies if not body.startswith("AI"))][-_RELAY_LINES:]
        return found

    def take_relay(self) -> bytes:
        """The good sentences since the last call, framed anew, the newest 200; empty unless ``relay`` is set."""
        kept, self._relay = self._relay, []
        return b"".join(kept)

    def take_ais(self) -> list[ReceivedReport | AisWord]:
        """What AIS receivers on this line have brought since the last call."""
        found, self.ais_found = self.ais_found, []
        return found

    def poll(self, now_us: int) -> list[Measurement]:
        """Close an overdue epoch and look after the line's health. Call at least once per tick."""
        if now_us - self._checked_us >= _CHECK_US:
            self._checked_us = now_us
            self._check(now_us)
        receivers = self._receivers.all
        if len(receivers) == 1:
            return receivers[0].epochs.poll(now_us)
        return [fix for receiver in receivers for fix in receiver.epochs.poll(now_us)]

    @property
    def damaged(self) -> int:
        """Sentences lost to a wrong or missing checksum, to length, or to impossible fields."""
        line = self._line.counters
        ais = 0 if self._ais is None else self._ais.damaged
        return line.bad_checksum + line.no_checksum + line.too_long + line.not_text + self._dropped["malformed"] + ais

    @property
    def counters(self) -> dict[str, int]:
        """Good sentences per address (``GPGGA``), and what was dropped by cause in lower case."""
        epochs = {"late": 0, "partial_epochs": 0}
        for receiver in self._receivers.all:
            epochs["late"] += receiver.epochs.late
            epochs["partial_epochs"] += receiver.epochs.partial
        ais = self._ais
        return {
            **({} if ais is None else {"AIS": ais.sentences, "ais_broken_sets": ais.broken_sets}),
            **self._watch.counts(),
            **self._line.counters.as_dict(),
            **self._dropped,
            **epochs,
            "bytes": self._bytes,
        }

    def sentence_ages(self, now_us: int) -> dict[str, float]:
        """Seconds since each address was last heard, e.g. ``{"GPHDT": 0.08}``."""
        return self._watch.ages_s(now_us)

    def drain_texts(self) -> list[tuple[Severity, str]]:
        """Operator texts since the last call."""
        texts = self._watch.texts
        if texts:
            self._watch.texts = []
        return texts

    def closed(self, reason: str, now_us: int) -> None:
        """The link lost its device or peer."""
        self._watch.gone(now_us, reason)

    def _check(self, now_us: int) -> None:
        damaged = self.damaged
        if self.config.checksum_required:
            damaged -= self._dropped["malformed"]  # they arrived as they were sent
        self._watch.check(now_us, self._line.counters.sentences, damaged, self._bytes)
        several = self._receivers.several
        names = " and ".join("+".join(receiver.talkers) for receiver in several)
        text = f"two receivers on one line, {names}: compared, not mixed"
        self._watch.set_condition("talkers", bool(several), text, "one receiver again")
        refused = any(receiver.epochs.calendar.refused for receiver in self._receivers.all)
        text = "receiver's date is wrong (week roll-over?); time not used"
        self._watch.set_condition("date", refused, text, "date is good")

    def _sentence(self, body: str, now_us: int, found: list[Measurement]) -> None:
        fields = body.split(",")
        if is_ais(fields[0]) or fields[0] in _AIS_WORDS:
            self._take_ais(fields, now_us)
            return
        route = self._routes.get(fields[0]) or self._route(fields[0])
        if route is None:
            return
        decode, age_us, rhythm, source = route
        try:
            if "_" in body:
                raise BadFieldError("underscore")  # Python would take 1_0 for a number
            part = decode(fields, now_us - age_us)
        except BadFieldError:
            self._dropped["malformed"] += 1
            if self.config.checksum_required:
                self._watch.impossible(fields[0])
            return
        except PassedOverError:
            self._dropped["unknown"] += 1
            return
        rhythm.heard(now_us)
        self._pass_on(part, source, now_us, found)

    def _take_ais(self, fields: list[str], now_us: int) -> None:
        """AIS has no rhythm of its own, and a list of wanted sentences says nothing of it; only a minus keeps it out."""
        if self._wanted.forbids(fields[0]) or len(self.ais_found) >= _AIS_MAX:
            self._dropped["filtered"] += 1
            return
        if fields[0] in _AIS_WORDS:
            self.ais_found.append(AisWord(now_us, tuple(fields)))
            return
        if self._ais is None:
            self._ais = AisReceiver()
        self.ais_found += self._ais.sentence(fields, now_us)

    def _route(self, address: str) -> _Route | None:
        """How to decode an address, remembered; None (and counted) when it is unknown or not wanted."""
        decode = decoder_of(address)
        if decode is None or not self._wanted.allows(address):
            self._dropped["unknown" if decode is None else "filtered"] += 1
            return None
        source = Source(self.name, address, self._wanted.rank(address))
        route = decode, self._age_us(kind_of(address)[1]), self._watch.rhythm(address), source
        if len(self._routes) < _ROUTES_MAX:
            self._routes[address] = route
        return route

    def _age_us(self, kind: str) -> int:
        """How old what a sentence tells is when it has come; an epoch has the time in it."""
        if kind in EPOCH_KINDS:
            return 0
        return self._depth_latency_us if kind in DEPTH_KINDS else self._heading_latency_us

    def _pass_on(self, part: Part | None, source: Source, now_us: int, found: list[Measurement]) -> None:
        """Say whose it is, and what only the line's place tells."""
        match part:
            case None:
                pass
            case EpochPart():
                self._epoch(part, now_us, found)
            case EulerAngles():
                found.append(self._attitude(part, source, now_us))
            case AngularVelocity():
                found.append(AngularVelocity(part.t_us, part.r_radps, source))
            case Distance():
                found.append(self._from_transducer(part, source))
            case _:
                assert_never(part)

    def _epoch(self, part: EpochPart, now_us: int, found: list[Measurement]) -> None:
        receiver = self._receivers.of(part, now_us)
        if receiver is None or receiver is not self._receivers.all[0]:
            self._dropped["other_talker"] += 1
        if receiver is None:
            return
        if part.variation_rad is not None:
            self._variation = (part.variation_rad, now_us)
        receiver.epochs.add(part, now_us, found)

    def _attitude(self, part: EulerAngles, source: Source, now_us: int) -> EulerAngles:
        """Where a magnetic compass does not know the variation, or was never told (0.0), the receiver's of the last minute stands in."""
        variation_rad = part.variation_rad
        if not variation_rad and part.psi_magnetic_rad is not None and self._variation is not None:
            value, at_us = self._variation
            variation_rad = value if now_us - at_us < _VARIATION_HOLD_US else variation_rad
        return EulerAngles(
            t_us=part.t_us,
            phi_rad=part.phi_rad,
            theta_rad=part.theta_rad,
            psi_rad=part.psi_rad,
            psi_magnetic_rad=part.psi_magnetic_rad,
            psi_accuracy_rad=part.psi_accuracy_rad,
            variation_rad=variation_rad,
            source=source,
        )

    def _from_transducer(self, distance: Distance, source: Source) -> Distance:
        """DBS counts from the surface, DBK from the keel; a 0 of either is no depth, and stays one."""
        value_m, kind = distance.bottom_m, kind_of(source.address)[1]
        if value_m is None:
            value_m = distance.value_m
        elif kind == "DBS":
            value_m = max(0.0, value_m - self._transducer_m)
        elif kind == "DBK":
            value_m = max(0.0, value_m + self._keel_m - self._transducer_m)
        return Distance(
            t_us=distance.t_us,
            value_m=value_m,
            offset_m=distance.offset_m,
            range_max_m=distance.range_max_m,
            signal_quality=distance.signal_quality,
            source=source,
        )
