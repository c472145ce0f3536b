"""What an order from the shore means aboard: a command is read from its own numbers, by the table that reads those of a wire."""

from __future__ import annotations

from typing import Final

from ..language.requests import Origin, Reply, RequestBody, Result
from ..mavlink.commands import command as mav
from ..mavlink.commands.command import COMMAND_INT, COMMAND_LONG, Command, Refused
from ..mavlink.commands.table import MEANINGS, Context

_RESULTS: Final = {
    mav.ACCEPTED: Result.ACCEPTED,
    mav.REJECTED_NOW: Result.REJECTED_NOW,
    mav.DENIED: Result.DENIED,
    mav.UNSUPPORTED: Result.UNSUPPORTED,
    mav.FAILED: Result.FAILED,
}


def meaning_of(origin: Origin, context: Context, address: tuple[int, int]) -> RequestBody | Reply:
    """What a command asks of the vessel, or the answer when that is known already. ``address``: the vessel's system and component."""
    if origin.message_id not in (COMMAND_LONG, COMMAND_INT):
        return Reply(Result.UNSUPPORTED, f"message {origin.message_id} is not carried out when it comes by radio")
    command, (system, component) = Command.from_payload(origin.message_id, origin.payload, origin.source)
    if system not in (0, address[0]) or component not in (0, address[1]):
        return Reply(Result.DENIED, "a command for somebody else")
    return _understood(command, context)


def _understood(command: Command, context: Context) -> RequestBody | Reply:
    meaning = MEANINGS.get(command.id)
    if meaning is None:
        return Reply(Result.UNSUPPORTED, f"command {command.id} is not known aboard")
    try:
        body = meaning(command, context)
    except Refused as refusal:
        return Reply(_RESULTS[refusal.result], refusal.reason)
    return Reply(Result.ACCEPTED) if body is None else body
