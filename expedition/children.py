"""A team as processes of this machine: started, watched, and never left behind.

The processes are forked from one that has compiled and loaded everything, so that they start at once
and share memory. Nothing of ZeroMQ, no thread and no event loop exists here before they are forked.
"""

from __future__ import annotations

import asyncio
import ctypes
import multiprocessing
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from expedition import cast, collect
from expedition.results.record import save_record_part
from expedition.team import TeamSettings
from protocol.effects import Note
from protocol.host import Host
from server.master import Master
from sim_world.world import World

_PATIENCE_S = 10.0  # how long processes get to write what they know before they are ended by force
_FORK = multiprocessing.get_context("fork")
_PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of prctl(2)


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
        self._failed = False

    def run(self, realtime: bool, keep_going: Callable[[], bool]) -> str | None:
        """Run the mission; return how it was broken off (`operator`, `failed`), or None.

        Raises:
            OSError: a port is in use.
        """
        try:
            self._start_all(realtime)
            interrupted = self._watch(keep_going)
        finally:
            self._end_all()
        if interrupted:
            return "operator"
        return "failed" if self._failed else None

    # --- starting -----------------------------------------------------------------------------

    def _start_all(self, realtime: bool) -> None:
        network = self._team.network
        at = f"tcp://{network.address}"
        self._start(cast.WORLD_NAME, self._world_child, f"{at}:{network.world_port}", realtime)
        world = self._wait_bound(cast.WORLD_NAME)
        self._start(cast.SERVER_NAME, self._server_child, world, f"{at}:{network.server_port}")
        for member in self._team.members():
            self._start(member.name, self._agent_child, world, member.name)
        self._note(cast.SERVER_NAME, Note("info", f"listens on {self._wait_bound('server')}"))

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
            OSError: it cannot listen there.
        """
        deadline = time.monotonic() + 60.0
        while name not in self._bound:
            child = self._children[name]
            self._hear(child, 0.1)
            if self._failed or not child.process.is_alive() or time.monotonic() > deadline:
                self._hear(child, 0.1)
                if name not in self._bound:
                    raise OSError(self._bound.get(f"{name} error", f"the {name} did not start"))
        return self._bound[name]

    # --- watching -----------------------------------------------------------------------------

    def _watch(self, keep_going: Callable[[], bool]) -> bool:
        """Hear the processes until world and server are through; return whether interrupted."""
        while self._alive(cast.WORLD_NAME):
            pipes = [child.pipe for child in self._children.values()]
            for pipe in wait(pipes, timeout=0.1):
                self._hear(next(c for c in self._children.values() if c.pipe is pipe), 0.0)
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
        elif kind == "error":
            self._bound[f"{child.name} error"] = value
            self._note(child.name, Note("error", value))

    def _gone(self, child: _Child) -> None:
        """A process has ended: note it once."""
        if child.name in self._bound.get("gone", "").split():
            return
        self._bound["gone"] = f"{self._bound.get('gone', '')} {child.name}"
        code = child.process.exitcode
        if code:
            how = f"killed by signal {-code}" if code < 0 else f"ended with status {code}"
            self._note(child.name, Note("warning", f"its process was {how}"))

    def _alive(self, name: str) -> bool:
        return name in self._children and self._children[name].process.is_alive()

    def _note(self, name: str, note: Note) -> None:
        self._on_note(name, note)

    # --- ending -------------------------------------------------------------------------------

    def _end_all(self) -> None:
        """End all processes: those that write results first get the time to."""
        world = self._children.get(cast.WORLD_NAME)
        if world is not None and world.process.is_alive():
            world.process.terminate()
            world.process.join(_PATIENCE_S)
        deadline = time.monotonic() + _PATIENCE_S
        for child in self._children.values():
            grace = deadline - time.monotonic() if world is not None else 0.0
            self._drain(child, max(grace, 0.0))
            for stop in (child.process.terminate, child.process.kill):
                if child.process.is_alive():
                    stop()
                    child.process.join(2.0)
            child.pipe.close()
        for child in self._children.values():
            child.process.join(0.1)

    def _drain(self, child: _Child, patience: float) -> None:
        """Wait for a process to end by itself, hearing what it still tells."""
        deadline = time.monotonic() + patience
        while child.process.is_alive() and time.monotonic() < deadline:
            self._hear(child, 0.05)
            child.process.join(0.02)
        self._hear(child, 0.0)

    # --- what runs in the processes -----------------------------------------------------------

    def _world_child(self, tell: _Tell, endpoint: str, realtime: bool) -> None:
        from sim_world.app import run_world

        host = cast.world_host(self._team, self._stage, not realtime)
        members = [member.name for member in self._team.members()] + [cast.SERVER_NAME]
        core = host.core
        assert isinstance(core, World)

        def keep_going() -> bool:
            if tell.due() and core.judge.timeline:
                tell("progress", core.judge.timeline[-1])
            return not tell.stop

        try:
            asyncio.run(
                run_world(
                    host,
                    endpoint,
                    self._team.world.step_s,
                    members,
                    realtime,
                    tell.note,
                    keep_going,
                    lambda bound: tell("bound", bound),
                )
            )
        finally:
            part = collect.world_part(core, self._stage, self._team)
            save_record_part(self._parts, "1-world", part)

    def _server_child(self, tell: _Tell, world: str, endpoint: str) -> None:
        from server.app import run_server

        host = cast.server_host(self._team)
        saved = time.monotonic()

        def keep_going() -> bool:
            nonlocal saved
            if time.monotonic() - saved > self._team.checkpoint_s > 0.0:
                saved = time.monotonic()
                self._save_server(host)
            return not tell.stop

        names = [member.name for member in self._team.members()]
        try:
            asyncio.run(
                run_server(
                    host,
                    world,
                    endpoint,
                    names,
                    tell.note,
                    keep_going,
                    lambda bound: tell("bound", bound),
                )
            )
        finally:
            self._save_server(host)

    def _save_server(self, host: Host) -> None:
        master = host.core
        assert isinstance(master, Master)
        save_record_part(self._parts, "2-server", collect.server_part(master, master.now))

    def _agent_child(self, tell: _Tell, world: str, name: str) -> None:
        from robot_agent.app import run_agent

        host = cast.agent_host(self._team, name)
        asyncio.run(run_agent(host, world, tell.note, lambda: not tell.stop))


class _Tell:
    """A process's end of its pipe; also holds the word to stop."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._told = 0.0
        self.stop = False

    def __call__(self, kind: str, value: Any) -> None:
        """Tell the launcher something; a launcher that is gone does not matter."""
        try:
            self._pipe.send((kind, value))
        except OSError:
            self.stop = True

    def note(self, note: Note) -> None:
        """Tell a line of the log."""
        self("note", note)

    def due(self) -> bool:
        """Whether it is time to tell about the progress again."""
        if time.monotonic() - self._told < 0.5:
            return False
        self._told = time.monotonic()
        return True


def _child_main(
    name: str, main: Callable[..., Any], pipe: Connection, arguments: tuple[Any, ...]
) -> None:
    """Run a process of the team; its errors go through the pipe."""
    import setproctitle
    import uvloop

    tell = _Tell(pipe)
    role = name if name in (cast.WORLD_NAME, cast.SERVER_NAME) else f"agent {name}"
    setproctitle.setproctitle(f"expedition {role}")
    ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, signal.SIGTERM)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the launcher decides what Ctrl-C means
    signal.signal(signal.SIGTERM, lambda *_: setattr(tell, "stop", True))
    uvloop.install()
    try:
        main(tell, *arguments)
    except OSError as error:
        tell("error", str(error))
        os._exit(1)
    except Exception:
        tell("error", traceback.format_exc())
        os._exit(1)
