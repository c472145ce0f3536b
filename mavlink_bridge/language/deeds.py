"""What the vessel has done for anybody, newest of each kind: so that who remembers an answer knows whether it is still true."""

from __future__ import annotations

from collections.abc import Container

from .nature import Ask, Matter


class Deeds:
    """One vessel's, shared by all ways to it: what one link's stations asked for, another link's may have undone."""

    def __init__(self) -> None:
        self.count = 0
        """How many requests were carried out."""
        self.settings = 0
        """How many of them changed what stands: a plan, home, the fence, a parameter. What was refused before may be allowed now."""
        self._newest: dict[type[Ask], tuple[int, Ask]] = {}

    def note(self, body: Ask) -> None:
        """A request was carried out. To be told before its sender is answered."""
        self.count += 1
        self.settings += body.nature.sets
        if body.nature.reaches:
            self._newest[type(body)] = self.count, body

    def undone(self, body: Ask, number: int, own: Container[int]) -> bool:
        """Whether something else than ``body``, the deed of this number, was done since that reaches what it settled.

        ``own``: numbers of deeds that do not count, because its sender has ordered them himself.
        """
        settled = body.nature.settles
        for later, other in self._newest.values():
            shared = other.nature.reaches & settled
            # the same words of somebody else are the same deed, but for who commands
            if shared and later > number and later not in own and (other != body or Matter.HELM in shared):
                return True
        return False
