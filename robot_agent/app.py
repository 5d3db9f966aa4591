"""The shell of a robot's process."""

from __future__ import annotations

from collections.abc import Callable

import zmq

from protocol.effects import Note
from protocol.host import Host
from protocol.runner import Runner


async def run_agent(
    host: Host, world: str, on_note: Callable[[Note], None], keep_going: Callable[[], bool]
) -> str:
    """Run a robot's software as a member of a simulated team; return why it ended.

    Args:
        host: the host of the robot's core.
        world: the world's endpoint, `tcp://host:port`.
        on_note: is told each line that the core logs.
        keep_going: asked all the time; when false the robot leaves the team.

    Raises:
        protocol.errors.RefusedError: the world does not take the robot in.
        TimeoutError: the world fell silent.
    """
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    try:
        return await Runner(host, world, on_note, keep_going=keep_going).run(context)
    finally:
        context.term()
