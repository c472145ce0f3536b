"""A simulated vessel that can be rebooted in virtual time: its program ends, is off for a while and begins anew, its world goes on."""

from __future__ import annotations

from typing import Final

from companion.build import build_app
from companion.facade import identity_of
from companion.io.links import Link
from companion.io.links.mem import MemLink
from sitl.world.world import World

OFF_S: Final = 5.0
"""From the end of one start to the first tick of the next: a service that systemd starts again, on a Raspberry Pi."""


class _Off:
    """No program runs."""

    def tick(self, now_us: int, **_: float) -> None:
        pass

    def pump(self, now_us: int) -> None:
        pass

    def shutdown(self, now_us: int) -> None:
        pass


class RebootingWorld(World):
    """As on the boat: when a station's reboot was obeyed the program ends after the tick, and it is started again."""

    starts = 1
    _off_until_us: int | None = None

    def _tick(self) -> object:
        done = super()._tick()
        if self._off_until_us is None:
            if self.stop_wanted:
                self.app.shutdown(self.now_us)
                self.loop_app, self._off_until_us = _Off(), self.now_us + round(OFF_S * 1e6)
        elif self.now_us >= self._off_until_us:
            self._begin_anew()
        return done

    def _begin_anew(self) -> None:
        """What was kept in the store is all that the new program knows."""
        self.starts += 1
        self._off_until_us = None
        self.app = build_app(
            self.settings,
            make_link=self._same_cable,
            store=self.app.store,
            identity=identity_of(self.settings, chance=f"start {self.starts}"),
            board_seen=True,
        )
        self.loop_app = self.app

    def _same_cable(self, name: str, url: str, **_: object) -> Link:
        """A new end on the cable of the program that has ended."""
        old = self.vessel_end(name)
        new = MemLink(old.name, datagrams=old.datagrams)
        assert old._peer is not None
        new.connect(old._peer)
        self._vessel_ends[name] = new
        return new
