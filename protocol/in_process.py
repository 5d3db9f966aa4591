"""A whole team in one process, without a socket: for experiments, tests and thousands of faults.

Frames are encoded and decoded as on the wire and travel in the order of lockstep, so the digest of
a run is the one that the same run over ZeroMQ has.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from protocol.effects import Note
from protocol.host import Host
from protocol.lockstep import Bundle, Conductor


def run_in_process(
    world: Host,
    hosts: Mapping[str, Host],
    step: float,
    on_note: Callable[[str, Note], None],
    keep_going: Callable[[], bool] = lambda: True,
) -> str:
    """Run a team until its world stops; return the world's word on why.

    Args:
        world: the host of the world's core.
        hosts: the members by name, robots and server.
        step: length of an instant [s], mission time.
        on_note: is told each line that a process logs, with the process's name.
        keep_going: asked once an instant; when false the run is broken off.
    """
    conductor = Conductor(world, step)
    for name in hosts:
        conductor.join(name)
    while conductor.stopped is None and keep_going():
        for bundle in conductor.begin():
            _carry(conductor, hosts[bundle.member], bundle, on_note)
        for note in conductor.notes:
            on_note("world", note)
        conductor.notes.clear()
    return conductor.stopped or "broken off"


def _carry(
    conductor: Conductor, host: Host, bundle: Bundle, on_note: Callable[[str, Note], None]
) -> None:
    """Let one member live through one instant."""
    if bundle.strike == "kill":
        return
    host.suffer(bundle.strike, bundle.incarnation)
    outbox = host.advance(bundle.parcels, bundle.now)
    conductor.done(bundle.member, outbox.parcels, host.next_deadline)
    for note in outbox.notes:
        on_note(bundle.member, note)
    if outbox.stop is not None:
        conductor.left(bundle.member)
