"""An operator's side of the wire: one word to a running server, and its answer."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self, TypeVar
from urllib.parse import urlsplit

import zmq

from expedition.errors import NoServerError
from protocol.codec import Header, decode, encode
from protocol.errors import ProtocolError
from protocol.messages import SERVER, Hello, Message, Refused, Welcome
from protocol.operator_messages import Answer, DriveRequest

PATIENCE_S = 10.0  # a team in lockstep on a busy machine may take its time over one instant
_CONNECT_S = 2.0

_Reply = TypeVar("_Reply", bound=Message)


class Operator:
    """A connection to a running server; use it in a `with` statement.

    Args:
        endpoint: the server's, `tcp://address:port`.
        patience: how long to wait for an answer [s].
    """

    def __init__(self, endpoint: str, patience: float = PATIENCE_S) -> None:
        self._endpoint = endpoint
        self._patience = patience
        self._name = f"operator-{os.getpid():x}"
        self._incarnation = time.time_ns() // 1000  # the server tells each connection by it
        self._sequence = 0
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.DEALER)
        self._socket.setsockopt(zmq.IDENTITY, self._name.encode())
        self._socket.setsockopt(zmq.LINGER, 0)

    def __enter__(self) -> Self:
        """Connect and introduce ourselves.

        Raises:
            NoServerError: nobody is there, or does not answer.
        """
        try:
            self._find_server()
            self._socket.connect(self._endpoint)
            self.now()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the connection."""
        self._socket.close()
        self._context.term()

    def ask(self, request: Message) -> Answer:
        """Send a request; return the server's answer.

        Raises:
            NoServerError: no answer came.
        """
        self._send(request)
        return self._reply(Answer)

    def now(self) -> float:
        """Return mission time at the server [s].

        Raises:
            NoServerError: no answer came.
        """
        self._send(Hello(role="operator", incarnation=self._incarnation))
        return self._reply(Welcome).now_s

    def drive(
        self, robot: str, speed: float, turn_rate: float, seconds: float, going: Callable[[], bool]
    ) -> Answer:
        """Drive a robot by hand and halt it; return the last answer.

        A robot halts when no fresh word comes in time, so the word is said over and over; the
        server answers once an instant, which sets the pace.

        Args:
            robot: its name.
            speed: along its +x [m/s].
            turn_rate: counter-clockwise [rad/s].
            seconds: how long, mission time [s].
            going: asked before each word; when false the robot is halted early.

        Raises:
            NoServerError: the server does not answer any more.
        """
        until = self.now() + seconds
        words = DriveRequest(robot=robot, speed_m_s=speed, turn_rate_rad_s=turn_rate)
        answer = self.ask(words)
        while answer.accepted and going() and self.now() < until:
            answer = self.ask(words)
        if answer.accepted:
            self.ask(DriveRequest(robot=robot, speed_m_s=0.0, turn_rate_rad_s=0.0))
        return answer

    def _find_server(self) -> None:
        """Look whether anybody listens there at all, which ZeroMQ does not tell."""
        place = urlsplit(self._endpoint)
        try:
            socket.create_connection((place.hostname, place.port), _CONNECT_S).close()
        except OSError:
            raise self._nobody("nobody listens") from None

    def _nobody(self, what: str) -> NoServerError:
        return NoServerError(
            f"{what} at {self._endpoint}: start a team, or give the server's address with --server"
        )

    def _send(self, message: Message) -> None:
        self._sequence += 1
        header = Header(message.type, self._name, SERVER, self._sequence, 0.0)
        self._socket.send_multipart(encode(header, message))

    def _reply(self, kind: type[_Reply]) -> _Reply:
        """Wait for a reply of one kind; anything else that comes meanwhile is passed over."""
        deadline = time.monotonic() + self._patience
        while (left := deadline - time.monotonic()) > 0.0:
            if not self._socket.poll(int(left * 1000) + 1):
                continue
            try:
                _, message = decode(self._socket.recv_multipart())
            except ProtocolError:
                continue
            if isinstance(message, Refused):
                raise NoServerError(f"the server at {self._endpoint} refuses us: {message.reason}")
            if isinstance(message, kind):
                return message
        raise self._nobody(f"no answer within {self._patience:g} s")
