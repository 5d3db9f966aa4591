"""A team as processes of this machine: started, watched, and never left behind.

The processes are forked from one that has compiled and loaded everything, so that they start at
once and share memory. No socket, thread or event loop may be open here when they are forked.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from expedition import cast
from expedition.errors import StartError
from expedition.last_will import end_with_parent
from expedition.processes import Ties, live_as, play_world, serve
from expedition.team import TeamSettings
from protocol.effects import Note

_PATIENCE_S = 10.0  # how long processes get to write what they know before they are ended by force
_START_S = 60.0  # how long the world and the server get until they listen
_LISTENERS = (cast.WORLD_NAME, cast.SERVER_NAME)
_FORK = multiprocessing.get_context("fork")


@dataclass(slots=True)
class _Child:
    """A process of the team and the pipe that it speaks through."""

    name: str
    process: BaseProcess
    pipe: Connection


class Children:
    """The processes of one mission.

    Args:
        team: the effective settings.
        stage: the world and the robots in it.
        parts: folder for the parts of the record.
        on_note: is told each line that a process logs.
        on_progress: is told mission time [s] and coverage now and then.
    """

    def __init__(
        self,
        team: TeamSettings,
        stage: cast.Stage,
        parts: Path,
        on_note: Callable[[str, Note], None],
        on_progress: Callable[[Any], None],
    ) -> None:
        self._team = team
        self._stage = stage
        self._parts = parts
        self._on_note = on_note
        self._on_progress = on_progress
        self._children: dict[str, _Child] = {}
        self._bound: dict[str, str] = {}
        self._errors: dict[str, str] = {}
        self._gone_names: set[str] = set()
        self._failed = False

    def run(self, realtime: bool, keep_going: Callable[[], bool]) -> str | None:
        """Run the mission; return how it was broken off (`operator`, `failed`), or None.

        Raises:
            StartError: a process cannot listen where it was told to, or did not start.
        """
        patience = 0.0
        try:
            self._start_all(realtime)
            patience = _PATIENCE_S
            interrupted = self._watch(keep_going)
        finally:
            self._end_all(patience)
        if interrupted:
            return "operator"
        return "failed" if self._failed else None

    # --- starting -----------------------------------------------------------------------------

    def _start_all(self, realtime: bool) -> None:
        """Start the world, then all who join it.

        Nobody needs to know the world's port, so any free one does; operators look for the server
        at its usual port, and are told when that is taken. A port that was asked for is a must.
        """
        network = self._team.network
        at, asked = f"tcp://{network.address}:", network.model_fields_set
        world_port = network.world_port if "world_port" in asked else 0
        self._start(cast.WORLD_NAME, self._world_child, f"{at}{world_port}", realtime)
        world = self._wait_bound(cast.WORLD_NAME)
        wanted = f"{at}{network.server_port}"
        endpoints = (wanted,) if "server_port" in asked else (wanted, f"{at}0")
        if self._team.server.enabled:
            self._start(cast.SERVER_NAME, self._server_child, world, endpoints)
        for member in self._team.members():
            self._start(member.name, self._agent_child, world, member.name)
        if not self._team.server.enabled:
            return
        server = self._wait_bound(cast.SERVER_NAME)
        taken = "" if server == wanted or network.server_port == 0 else f", as {wanted} is in use"
        self._note(cast.SERVER_NAME, Note("info", f"listens on {server}{taken}"))

    def _start(self, name: str, main: Callable[..., Any], *arguments: Any) -> None:
        """Fork a process that runs `main` with its end of a pipe."""
        ours, theirs = _FORK.Pipe(duplex=False)
        process = _FORK.Process(target=_child_main, args=(name, main, theirs, arguments), name=name)
        sys.stdout.flush()
        sys.stderr.flush()
        process.start()
        theirs.close()
        self._children[name] = _Child(name, process, ours)

    def _wait_bound(self, name: str) -> str:
        """Return the endpoint that a process listens on.

        Raises:
            StartError: it cannot listen there.
        """
        deadline = time.monotonic() + _START_S
        child = self._children[name]
        while name not in self._bound:
            ended = not child.process.is_alive()
            self._hear(child, 0.1)
            if name not in self._bound and (ended or time.monotonic() > deadline):
                raise StartError(self._errors.get(name, f"the {name} did not start"))
        return self._bound[name]

    # --- watching -----------------------------------------------------------------------------

    def _watch(self, keep_going: Callable[[], bool]) -> bool:
        """Hear the processes until world and server are through; return whether interrupted."""
        while self._alive(cast.WORLD_NAME):
            here: dict[object, _Child] = {
                child.pipe: child
                for child in self._children.values()
                if child.name not in self._gone_names
            }
            for pipe in wait([child.pipe for child in here.values()], timeout=0.1):
                self._hear(here[pipe], 0.0)
            if not keep_going():
                return True
        world = self._children[cast.WORLD_NAME]
        self._hear(world, 0.1)
        if world.process.exitcode:
            self._failed = True
        return False

    def _hear(self, child: _Child, timeout: float) -> None:
        """Take what a process tells through its pipe."""
        try:
            while child.pipe.poll(timeout):
                kind, value = child.pipe.recv()
                timeout = 0.0
                self._take(child, kind, value)
        except (EOFError, OSError):
            child.process.join(0.05)
            if not child.process.is_alive():
                self._gone(child)

    def _take(self, child: _Child, kind: str, value: Any) -> None:
        if kind == "note":
            self._note(child.name, value)
        elif kind == "bound":
            self._bound[child.name] = value
        elif kind == "progress":
            from expedition.launch import Progress

            self._on_progress(Progress(*value))
        elif child.name in _LISTENERS and child.name not in self._bound:
            self._errors[child.name] = value  # whoever waits for it will say so
        else:
            self._note(child.name, Note("error", value))

    def _gone(self, child: _Child) -> None:
        """A process has ended: note it once."""
        if child.name in self._gone_names:
            return
        self._gone_names.add(child.name)
        code = child.process.exitcode
        if code and child.name not in self._errors:
            how = f"killed by signal {-code}" if code < 0 else f"ended with status {code}"
            self._note(child.name, Note("warning", f"its process was {how}"))

    def _alive(self, name: str) -> bool:
        return name in self._children and self._children[name].process.is_alive()

    def _note(self, name: str, note: Note) -> None:
        self._on_note(name, note)

    # --- ending -------------------------------------------------------------------------------

    def _end_all(self, patience: float) -> None:
        """End all processes; the world goes first and tells the others that it is over.

        Args:
            patience: how long each may take to write what it knows [s].
        """
        world = self._children.get(cast.WORLD_NAME)
        if world is not None and world.process.is_alive():
            world.process.terminate()
            self._drain(world, patience)
        if self._failed:  # nobody is left to tell the others that it is over
            for child in self._children.values():
                child.process.terminate()
        deadline = time.monotonic() + patience
        for child in self._children.values():
            self._drain(child, max(deadline - time.monotonic(), 0.0))
            for stop in (child.process.terminate, child.process.kill):
                if child.process.is_alive():
                    stop()
                    child.process.join(2.0)
            child.pipe.close()

    def _drain(self, child: _Child, patience: float) -> None:
        """Wait for a process to end by itself, hearing what it still tells."""
        deadline = time.monotonic() + patience
        while child.process.is_alive() and time.monotonic() < deadline:
            self._hear(child, 0.05)
            child.process.join(0.02)
        self._hear(child, 0.0)

    # --- what runs in the processes -----------------------------------------------------------

    def _world_child(self, tell: _Tell, endpoint: str, realtime: bool) -> None:
        play_world(self._team, self._stage, self._parts, endpoint, realtime, tell.ties())

    def _server_child(self, tell: _Tell, world: str, endpoints: Sequence[str]) -> None:
        serve(self._team, self._parts, world, endpoints, tell.ties())

    def _agent_child(self, tell: _Tell, world: str, name: str) -> None:
        live_as(self._team, name, self._parts, world, tell.ties())


class _Tell:
    """A process's end of its pipe; also holds the word to stop."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self.stop = False

    def __call__(self, kind: str, value: Any) -> None:
        """Tell the launcher something; a launcher that is gone does not matter."""
        try:
            self._pipe.send((kind, value))
        except OSError:
            self.stop = True

    def ties(self) -> Ties:
        """Return what ties the process to the launcher."""
        return Ties(
            lambda note: self("note", note),
            lambda: not self.stop,
            lambda endpoint: self("bound", endpoint),
            lambda now, coverage: self("progress", (now, coverage)),
        )


def _child_main(
    name: str, main: Callable[..., Any], pipe: Connection, arguments: tuple[Any, ...]
) -> None:
    """Run a process of the team; its errors go through the pipe."""
    import setproctitle

    tell = _Tell(pipe)
    role = name if name in (cast.WORLD_NAME, cast.SERVER_NAME) else f"agent {name}"
    setproctitle.setproctitle(f"expedition {role}")
    end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the launcher decides what Ctrl-C means
    signal.signal(signal.SIGTERM, lambda *_: setattr(tell, "stop", True))
    try:
        main(tell, *arguments)
    except OSError as error:
        tell("error", str(error))
        os._exit(1)
    except Exception:
        tell("error", traceback.format_exc())
        os._exit(1)
