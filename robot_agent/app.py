"""The shell of a robot's process."""

from __future__ import annotations

from collections.abc import Callable

import zmq

from protocol.effects import Note
from protocol.host import Host
from protocol.runner import JOIN_TIMEOUT_S, Runner


async def run_agent(
    host: Host,
    world: str,
    on_note: Callable[[Note], None],
    keep_going: Callable[[], bool],
    join_timeout: float = JOIN_TIMEOUT_S,
) -> str:
    """Run a robot's software as a member of a simulated team; return why it ended.

    Args:
        host: the host of the robot's core.
        world: the world's endpoint, `tcp://host:port`.
        on_note: is told each line that the core logs.
        keep_going: asked all the time; when false the robot leaves the team.
        join_timeout: how long to knock at the world's door [s].

    Raises:
        protocol.errors.RefusedError: the world does not take the robot in.
        TimeoutError: there is no world there, or it fell silent.
    """
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    try:
        runner = Runner(host, world, on_note, None, keep_going, join_timeout)
        return await runner.run(context)
    finally:
        context.term()
