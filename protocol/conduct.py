"""The world's shell: carries bundles between the world and every other process of the team.

In lockstep the next instant begins when all members are done with this one. In real time it begins
when the wall clock says so, and answers that come late count for the next instant: that one wait
is the only difference.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from contextlib import suppress

import msgpack
import zmq

from protocol.effects import Note
from protocol.errors import FrameError
from protocol.fields import is_name
from protocol.lockstep import Bundle, Conductor
from protocol.transports.bundles import (
    DONE,
    JOIN,
    OVER,
    PING,
    REFUSE,
    WELCOME,
    pack_bundle,
    unpack_parcels,
)
from protocol.transports.port import Port

PING_PERIOD = 0.5  # [s], wall; how soon a dead process is noticed
LINGER_MS = 500


def bind_router(context: zmq.Context[zmq.Socket[bytes]], endpoint: str) -> zmq.Socket[bytes]:
    """Return a ROUTER socket bound to `endpoint` that notices vanished peers.

    Raises:
        OSError: the port is in use or the address is not ours, with the mend.
    """
    socket = context.socket(zmq.ROUTER)
    socket.setsockopt(zmq.ROUTER_MANDATORY, 1)
    socket.setsockopt(zmq.ROUTER_HANDOVER, 1)
    socket.setsockopt(zmq.LINGER, LINGER_MS)
    socket.setsockopt(zmq.HEARTBEAT_IVL, 1000)
    socket.setsockopt(zmq.HEARTBEAT_TIMEOUT, 10000)
    socket.setsockopt(zmq.MAXMSGSIZE, 16_000_000)
    try:
        socket.bind(endpoint)
    except zmq.ZMQError as error:
        socket.close()
        raise OSError(
            f"cannot listen on {endpoint}: {error.strerror}; choose another port or end the "
            "process that uses it"
        ) from None
    return socket


def bound_endpoint(socket: zmq.Socket[bytes]) -> str:
    """Return where a bound socket really listens; port 0 was replaced by a free one."""
    return bytes(socket.getsockopt(zmq.LAST_ENDPOINT)).rstrip(b"\0").decode()


class Stage:
    """The bound socket of a simulated team and who is on it.

    Args:
        conductor: the world and its members.
        port: a bound ROUTER.
        expected: names that must be there before the mission begins.
        on_note: is told each line that the world logs.
        join_timeout: how long to wait for the next one who is missing [s].
    """

    def __init__(
        self,
        conductor: Conductor,
        port: Port,
        expected: Iterable[str],
        on_note: Callable[[Note], None],
        join_timeout: float,
    ) -> None:
        self._conductor = conductor
        self._port = port
        self._expected = frozenset(expected)
        self._on_note = on_note
        self._join_timeout = join_timeout
        self._routes: dict[str, bytes] = {}
        self._next_ping = 0.0

    async def run(self, realtime: bool, keep_going: Callable[[], bool]) -> str:
        """Wait for the team, run the mission, tell everybody that it is over; return why."""
        await self._gather(keep_going)
        wait = self._until_time if realtime else self._until_done
        began = time.monotonic() - self._conductor.now
        while self._conductor.stopped is None and keep_going():
            for bundle in self._conductor.begin():
                self._send(bundle)
            await wait(began + self._conductor.now + self._conductor.step, keep_going)
            self._report()
        self._report()
        self._tell_over()
        return self._conductor.stopped or "broken off"

    async def _gather(self, keep_going: Callable[[], bool]) -> None:
        """Wait until every expected process has joined.

        Raises:
            TimeoutError: nobody has joined for too long, and somebody is missing still.
        """
        asked = joined = time.monotonic()
        waiting = self._expected
        while keep_going() and (missing := self._expected - set(self._routes)):
            await self._take(0.2)
            self._ping()
            now = time.monotonic()
            if missing != waiting:
                waiting, joined = missing, now
            names = ", ".join(sorted(missing))
            if now - joined > self._join_timeout:
                self._tell_over()
                raise TimeoutError(
                    f"{names} did not join within {self._join_timeout:g} s: start each with "
                    "`expedition server` or `expedition agent NAME`, or ask for fewer --robots"
                )
            if now - asked > 10.0:
                asked = now
                self._on_note(Note("info", f"waiting for {names} to join"))

    def _tell_over(self) -> None:
        """Tell everybody who is there that the mission is over."""
        for name in list(self._routes):
            self._send_to(name, [OVER])

    async def _until_done(self, _: float, keep_going: Callable[[], bool]) -> None:
        """Lockstep: wait for the answers of all members that have this instant."""
        while self._conductor.awaited and keep_going():
            await self._take(PING_PERIOD)
            self._ping()

    async def _until_time(self, due: float, keep_going: Callable[[], bool]) -> None:
        """Real time: take answers as they come until the next instant is due."""
        while (left := due - time.monotonic()) > 0.0 and keep_going():
            await self._take(min(left, PING_PERIOD))
            self._ping()

    def _ping(self) -> None:
        """Ping everybody now and then: finds who is gone, and tells the rest that we are here."""
        if time.monotonic() < self._next_ping:
            return
        self._next_ping = time.monotonic() + PING_PERIOD
        for name in sorted(self._routes):
            self._send_to(name, [PING])

    async def _take(self, timeout: float) -> bool:
        """Take one message, if one comes within `timeout` [s]; return whether one came."""
        message = await self._port.take(timeout)
        if message is None:
            return False
        identity, kind = message[0], message[1] if len(message) > 1 else b""
        name = identity.split(b"#")[0].decode("utf-8", "replace")
        if not is_name(name):
            return True
        if kind == JOIN:
            self._join(name, identity)
        elif kind == DONE and self._routes.get(name) == identity:
            self._done(name, message[1:])
        return True

    def _join(self, name: str, identity: bytes) -> None:
        """Take a process in, or refuse a name that is unknown or taken."""
        if name not in self._expected:
            self._refuse(
                identity, f"no robot named {name!r} here: use {', '.join(sorted(self._expected))}"
            )
            return
        if self._routes.get(name) == identity:
            return  # it knocked more than once before the door was open
        if name in self._routes:
            self._send_to(name, [PING])  # notices when the holder of the name is gone
        if name in self._routes:
            reason = f"the name {name!r} is taken by a live process: end that one, or use another"
            self._refuse(identity, reason)
            return
        self._routes[name] = identity
        incarnation = self._conductor.join(name)
        self._send_to(name, [WELCOME, msgpack.packb(incarnation)])

    def _refuse(self, identity: bytes, reason: str) -> None:
        """Tell a process why it is not taken in."""
        self._on_note(Note("warning", f"refused to join: {reason}"))
        message = [identity, REFUSE, msgpack.packb(reason)]
        with suppress(zmq.ZMQError):  # whoever asked may be gone already
            self._port.send(message)

    def _done(self, name: str, message: list[bytes]) -> None:
        """Take a member's answer; one that cannot be read ends its part in the mission."""
        try:
            meta, parcels = unpack_parcels(message)
            deadline = None if meta[0] is None else float(meta[0])
        except (FrameError, IndexError, TypeError, ValueError) as error:
            self._on_note(Note("error", f"{name} sent a broken answer and is dropped: {error}"))
            self._leave(name)
            return
        self._conductor.done(name, parcels, deadline)
        if len(meta) > 1 and meta[1] is not None:
            self._leave(name)

    def _send(self, bundle: Bundle) -> None:
        """Send a member its bundle."""
        self._send_to(bundle.member, pack_bundle(bundle))

    def _send_to(self, name: str, message: list[bytes]) -> None:
        """Send a member something; notice when it is gone."""
        try:
            self._port.send([self._routes[name], *message])
        except zmq.ZMQError:
            self._on_note(
                Note("warning", f"{name} is gone: its process ended or cannot be reached")
            )
            self._leave(name)

    def _leave(self, name: str) -> None:
        """Forget a member."""
        self._routes.pop(name, None)
        self._conductor.left(name)

    def _report(self) -> None:
        """Hand on what the world logged."""
        for note in self._conductor.notes:
            self._on_note(note)
        self._conductor.notes.clear()
