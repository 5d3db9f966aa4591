"""The shell of the world process."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import zmq

from protocol.conduct import Stage, bind_router, bound_endpoint
from protocol.effects import Note
from protocol.host import Host
from protocol.lockstep import Conductor
from protocol.transports.port import Port


async def run_world(
    host: Host,
    endpoint: str,
    step: float,
    members: Iterable[str],
    realtime: bool,
    on_note: Callable[[Note], None],
    keep_going: Callable[[], bool],
    on_bound: Callable[[str], None] = lambda endpoint: None,
    join_timeout: float = 120.0,
) -> str:
    """Play the world of a mission until it is over; return why it ended.

    Args:
        host: the host of the world's core.
        endpoint: where to listen, `tcp://address:port`; port 0 takes any free one.
        step: length of an instant [s].
        members: names of all processes that belong to the mission.
        realtime: pace instants by the wall clock instead of waiting for everybody.
        on_note: is told each line that the world logs.
        keep_going: asked all the time; when false the mission is broken off.
        on_bound: is told the endpoint once others can connect.
        join_timeout: how long to wait for the next one who is missing [s].

    Raises:
        OSError: the endpoint cannot be bound.
        TimeoutError: somebody of the team never joined.
    """
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    try:
        socket = bind_router(context, endpoint)
        on_bound(bound_endpoint(socket))
        port = Port(socket)
        try:
            stage = Stage(Conductor(host, step), port, members, on_note, join_timeout)
            return await stage.run(realtime, keep_going)
        finally:
            port.close()
    finally:
        context.term()
