"""What the failsafe will do next, in how long, and what ends it: for panels, pages, texts and the log. Pure, like the engine."""

from __future__ import annotations

from mavlink_bridge.language.messages import Action
from mavlink_bridge.language.snapshot import Outlook

from .failsafe import FailsafeMemory
from .failsafe_barring import NOTHING, beside
from .failsafe_config import FailsafeConfig
from .failsafe_entry import acting, clock_us
from .failsafe_flags import Flags
from .failsafe_words import TAKEN_OVER, doing, named, until


def outlook(
    memory: FailsafeMemory, flags: Flags, now_us: int, config: FailsafeConfig, done: Action | None = None
) -> tuple[Outlook, ...]:
    """Return what is to be told of each condition that acts or warns, most urgent first.

    ``done``: what the vessel does; of a condition that asks for something else that is said, and for what. None = what each asks.
    """
    found, entries = [], memory.entries
    acted = [
        (rule, entry) for rule in config.rules if (entry := entries.get(rule.row.name)) and entry.fired_us is not None
    ]
    why = next((rule.row.text for rule, entry in acted if acting(rule, entry, flags) is done), "")
    for rule, entry in acted:
        action = acting(rule, entry, flags)
        grows = rule.then_us is not None and not (entry.escalated or entry.taken) and action is rule.action
        left_s = (rule.then_us - clock_us(entry, now_us)) * 1e-6 if grows and rule.then_us is not None else None
        order = named(rule.row, flags.helm.resume)
        others = beside(rule, acted, flags, order, now_us) if len(acted) > 1 else NOTHING
        found.append(
            Outlook(
                name=rule.row.name,
                cause=rule.row.text,
                doing=TAKEN_OVER if entry.taken else doing(action, done, why),
                next_action=rule.then_action if grows else Action.NONE,
                next_in_s=left_s,
                runs=entry.gone_us is None,
                until=until(rule.row, flags.helm.resume, others),
            )
        )
    return tuple(found)
