"""A stranger's flood on the page leaves the operator's order its way to the vessel."""

import asyncio
import json

from companion.status.service import REPLIES_KEPT
from companion.web.vessel import ASKED_MAX, NotHeardError, VesselLink

FLOOD = 80


async def flooded(place):
    """What the operator is answered while a stranger has asked so often and hears nothing."""

    async def vessel(reader, writer):
        writer.write(b'{"hello":{}}\n')
        while line := await reader.readline():
            asked = json.loads(line)
            if asked["host"] == "operator":
                writer.write(json.dumps({"id": asked["id"], "answer": {}}).encode() + b"\n")
        writer.close()

    server = await asyncio.start_unix_server(vessel, place)
    link = VesselLink([place])
    running = asyncio.create_task(link.run())
    while not link._writer:
        await asyncio.sleep(0.001)
    strangers = [asyncio.create_task(link.ask(ask="challenge", host="stranger")) for _ in range(FLOOD)]
    await asyncio.sleep(0.01)
    answer = await link.ask(ask="order", host="operator")
    at_once = sum(isinstance(stranger.done() and stranger.exception(), NotHeardError) for stranger in strangers)
    for task in (running, *strangers):
        task.cancel()
    await asyncio.wait([running, *strangers])
    server.close()
    return answer, at_once


def test_an_order_is_heard_through_a_flood_of_challenges(tmp_path):
    answer, at_once = asyncio.run(flooded(tmp_path / "status.sock"))
    assert "answer" in answer
    assert FLOOD - 8 < at_once < FLOOD


def test_the_vessel_keeps_as_many_answers_as_a_page_asks():
    """Eight were kept of each tick's, and the oldest dropped: 200 challenges a second, and no order was heard."""
    assert REPLIES_KEPT >= ASKED_MAX
