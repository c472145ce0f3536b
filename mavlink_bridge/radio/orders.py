"""What an order from the shore means aboard: a command is made a MAVLink frame again, and read as if it had come on a wire."""

from __future__ import annotations

from typing import Final

from ..language.requests import Origin, Reply, RequestBody, Result
from ..mavlink.commands import command as mav
from ..mavlink.commands.command import Command, Refused
from ..mavlink.commands.table import MEANINGS, Context
from ..mavlink.wire.codec import Codec, decode
from ..mavlink.wire.framing import Deframer
from .codec.command import COMMAND_INT, COMMAND_LONG

_RESULTS: Final = {
    mav.ACCEPTED: Result.ACCEPTED,
    mav.REJECTED_NOW: Result.REJECTED_NOW,
    mav.DENIED: Result.DENIED,
    mav.UNSUPPORTED: Result.UNSUPPORTED,
    mav.FAILED: Result.FAILED,
}


def frame_of(origin: Origin) -> bytes:
    """The MAVLink 2 frame that the station sent, with sequence number 0 and without its signature."""
    return Codec(*origin.source).seal(origin.message_id, origin.payload)


def meaning_of(origin: Origin, context: Context, address: tuple[int, int]) -> RequestBody | Reply:
    """What a command asks of the vessel, or the answer when that is known already. ``address``: the vessel's system and component."""
    if origin.message_id not in (COMMAND_LONG, COMMAND_INT):
        return Reply(Result.UNSUPPORTED, f"message {origin.message_id} is not carried out when it comes by radio")
    found = Deframer(datagrams=True).receive(frame_of(origin), 0)
    message = decode(found[0]) if found else None
    if (
        message is None
        or message.target_system not in (0, address[0])
        or message.target_component not in (0, address[1])
    ):
        return Reply(Result.DENIED, "a command for somebody else")
    return _understood(Command.from_message(message), context)


def _understood(command: Command, context: Context) -> RequestBody | Reply:
    meaning = MEANINGS.get(command.id)
    if meaning is None:
        return Reply(Result.UNSUPPORTED, f"command {command.id} is not known aboard")
    try:
        body = meaning(command, context)
    except Refused as refusal:
        return Reply(_RESULTS[refusal.result], refusal.reason)
    return Reply(Result.ACCEPTED) if body is None else body
