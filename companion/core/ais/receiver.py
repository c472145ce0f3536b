"""One AIS receiver's line: sentence bodies in, reports out, everything else counted."""

from __future__ import annotations

from mavlink_bridge.language.value import value

from .assembly import Assembler, is_ais
from .decode import WrongLengthError, decode
from .reports import AisReport

__all__ = ["AisReceiver", "AisWord", "ReceivedReport", "is_ais"]


@value
class ReceivedReport:
    """One report as it came."""

    t_us: int
    """When its last byte was read."""
    own: bool
    """The receiver says that it is its own ship's (VDO)."""
    report: AisReport


@value
class AisWord:
    """A sentence in which a receiver speaks of itself ($AITXT, $AIALR)."""

    t_us: int
    fields: tuple[str, ...]


class AisReceiver:
    """Decodes the AIS sentences of one line. Never raises, whatever arrives; memory is bounded."""

    def __init__(self) -> None:
        self._assembler = Assembler()
        self.sentences = 0
        self.reports = 0
        self.wrong_length = 0

    @property
    def damaged(self) -> int:
        """Sentences and messages that cannot be what they say."""
        return self._assembler.malformed + self.wrong_length

    @property
    def broken_sets(self) -> int:
        """Messages of which a part was lost."""
        return self._assembler.broken_sets

    @property
    def open_sets(self) -> int:
        """Messages that wait for a part."""
        return self._assembler.open_sets

    def sentence(self, fields: list[str], now_us: int) -> tuple[ReceivedReport, ...]:
        """Take the fields of one VDM or VDO sentence with a good checksum, the address first."""
        self.sentences += 1
        payload = self._assembler.receive(fields, now_us)
        if payload is None:
            return ()
        try:
            reports = decode(payload.bits)
        except WrongLengthError:
            self.wrong_length += 1
            return ()
        self.reports += len(reports)
        return tuple(ReceivedReport(now_us, payload.own, report) for report in reports)
