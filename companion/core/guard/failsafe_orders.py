"""Which order ends which condition while its cause still stands: one written table, order by row.

Everything else ends only when its cause is gone. Manual control goes its own way (``Takeover.MANUAL``).
"""

from __future__ import annotations

from enum import Enum
from typing import Final

from mavlink_bridge.language.messages import Mode


class Order(Enum):
    """What a person has decided, as the failsafe tells orders apart."""

    HOLD = "Hold"
    MANUAL = "Manual"
    RETURN = "Return"
    GUIDED = "a go-to"
    AUTO = "Auto"
    ARM = "arming"
    BYSTANDER_HOLD = "Hold on the page"
    """Of somebody who stands by and is no station: a return for want of a station gives way to it, and waits for one again."""


BY_MODE: Final = {
    Mode.MANUAL: Order.MANUAL,
    Mode.HOLD: Order.HOLD,
    Mode.LOITER: Order.HOLD,
    Mode.AUTO: Order.AUTO,
    Mode.RTL: Order.RETURN,
    Mode.GUIDED: Order.GUIDED,
    Mode.CIRCLE: Order.GUIDED,
}
"""What a person decides who orders a mode."""


def to_resume(resume: str) -> Order:
    """The order that a text names: a mode, with what to change first; "" = Auto."""
    return next((order for mode, order in BY_MODE.items() if resume.startswith(mode.value)), Order.AUTO)


_ANY_MOTION: Final = frozenset((Order.RETURN, Order.GUIDED, Order.AUTO))

ENDS_STANDING: Final[dict[str, frozenset[Order]]] = {
    # a correcting manoeuvre is what the row asks for; arming again is how it is begun after a disarm
    "depth_shallow": _ANY_MOTION | {Order.ARM},
    # back inside; a plan that would not lead inside is refused before it comes here
    "fence_breach": _ANY_MOTION,
    "plan_invalid": _ANY_MOTION,
    # the last charge is for the way back, not for the next leg of a plan
    "battery_empty": frozenset((Order.RETURN, Order.GUIDED)),
    "battery_critical": frozenset((Order.HOLD, Order.BYSTANDER_HOLD, Order.RETURN, Order.GUIDED)),
}
"""By row of the failsafe table: the orders that go on in spite of the standing cause."""


def ends(name: str, order: Order | None) -> bool:
    """Whether an order takes over from a condition whose cause stands."""
    if order is Order.BYSTANDER_HOLD and name in GIVES_WAY:
        return True
    return order is not None and order in ENDS_STANDING.get(name, frozenset())


GIVES_WAY: Final = frozenset(("gcs_lost", "radio_lost"))
"""Rows that a Hold on the page ends: a station's own order is speech and ends its silence, a page's is none and stops all the same."""

_UNNAMED: Final = (Order.ARM, Order.BYSTANDER_HOLD)
"""What a text for stations does not offer."""
_UNADVISED: Final = {"depth_shallow": (Order.AUTO,)}
"""What it does not offer for one row, obeyed all the same: the item that led onto the shoal leads onto it again."""


def names(*rows: str) -> str:
    """The orders that would go on in spite of all these causes, for a text: "Return or a go-to"."""
    allowed = frozenset(Order).intersection(*(ENDS_STANDING.get(name, frozenset()) for name in rows))
    unnamed = (*_UNNAMED, *(order for name in rows for order in _UNADVISED.get(name, ())))
    return " or ".join(order.value for order in Order if order in allowed and order not in unnamed)
