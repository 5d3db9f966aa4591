"""The shell of the server process."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress

import zmq

from protocol.conduct import bind_router, bound_endpoint
from protocol.effects import Note
from protocol.host import Host
from protocol.runner import JOIN_TIMEOUT_S, Runner
from protocol.transports.direct import DirectPeers


async def run_server(
    host: Host,
    world: str,
    endpoints: Sequence[str],
    robots: Iterable[str],
    on_note: Callable[[Note], None],
    keep_going: Callable[[], bool],
    on_bound: Callable[[str], None] = lambda endpoint: None,
    join_timeout: float = JOIN_TIMEOUT_S,
) -> str:
    """Run the server of a simulated team; return why it ended.

    Args:
        host: the host of the server's core.
        world: the world's endpoint, `tcp://host:port`.
        endpoints: where operators and observers connect: the first that can be bound counts; port 0
            takes any free one.
        robots: names that speak only through the world's relay.
        on_note: is told each line that the core logs.
        keep_going: asked all the time; when false the server leaves.
        on_bound: is told the endpoint once others can connect.
        join_timeout: how long to knock at the world's door [s].

    Raises:
        OSError: no endpoint can be bound.
        protocol.errors.RefusedError: the world does not take the server in.
        TimeoutError: there is no world there, or it fell silent.
    """
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    try:
        socket = _bind_first(context, endpoints)
        on_bound(bound_endpoint(socket))
        try:
            direct = DirectPeers(socket, frozenset(robots) | {"world", "server"})
            runner = Runner(host, world, on_note, direct, keep_going, join_timeout)
            return await runner.run(context)
        finally:
            socket.close()
    finally:
        context.term()


def _bind_first(
    context: zmq.Context[zmq.Socket[bytes]], endpoints: Sequence[str]
) -> zmq.Socket[bytes]:
    """Return a socket bound to the first endpoint that is free."""
    for endpoint in endpoints[:-1]:
        with suppress(OSError):
            return bind_router(context, endpoint)
    return bind_router(context, endpoints[-1])
