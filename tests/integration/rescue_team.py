"""A team without a master in one process, watched instant by instant from the inside."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from expedition import cast
from expedition.commands.options import settings_from
from expedition.team import TeamSettings
from protocol.effects import Note
from protocol.in_process import run_in_process
from protocol.log.author_log import Author
from protocol.log.messages import LogHave, LogWant, Observations, PoseSet
from protocol.map_cells import map_digest, quantise
from robot_agent.decentral.peer import Peer
from sim_world.world import World
from tests.integration.hostile_robot import Hostile

SMALL = str(Path(__file__).parent / "four_rooms.toml")
KNOWN = "world.perturb_starts=false"
ALONE = "server.enabled=false"
APART = "2.5,7,0;10,6.2,90;5,1.5,180;11,2,0"  # in another of the four rooms each
LOG_TYPES = tuple(
    kind.model_fields["type"].default for kind in (Observations, PoseSet, LogHave, LogWant)
)


def rescue(
    *sets: str,
    seed: int = 1,
    max_time: float = 600.0,
    world: str = SMALL,
    starts: str | None = None,
) -> TeamSettings:
    """Return the settings of four robots that decide for themselves."""
    given = ["network.server_port=0", "robot.estimator=scan_matching", *sets]
    return settings_from("rescue", world, 4, None, seed, starts, None, max_time, given)


class Watched:
    """A mission and all who take part.

    Attributes:
        world: the world's core.
        hosts: by name, robots and server.
        notes: what was logged.
    """

    def __init__(self, team: TeamSettings) -> None:
        self.team = team
        self._stage = cast.set_stage(team)
        self._world = cast.world_host(team, self._stage)
        self.hosts = {m.name: cast.agent_host(team, m.name) for m in team.members()}
        if team.server.enabled:
            self.hosts[cast.SERVER_NAME] = cast.server_host(team)
        self.notes: list[str] = []

    @property
    def world(self) -> World:
        core = self._world.core
        assert isinstance(core, World)
        return core

    def run(self, each_instant: Callable[[float], None] = lambda now: None) -> str:
        """Run it to its end; return why it ended."""

        def keep_going() -> bool:
            each_instant(self.world.now)
            return True

        step = self.team.world.step_s
        return run_in_process(self._world, self.hosts, step, self._note, keep_going)

    def peer(self, name: str) -> Peer:
        core = self.hosts[name].core
        if isinstance(core, Hostile):
            core = core.core
        assert isinstance(core, Peer)
        return core

    @property
    def peers(self) -> dict[str, Peer]:
        """The cores of all robots, as they are now."""
        return {member.name: self.peer(member.name) for member in self.team.members()}

    def held(self) -> dict[str, int]:
        """The checksum of what each robot holds."""
        return {name: peer.sharing.checksum() for name, peer in self.peers.items()}

    def digests(self) -> dict[str, str]:
        """The fingerprint of each robot's map."""
        told = {}
        for name, peer in self.peers.items():
            peer.sharing.follow(self.world.now)
            grid = peer.sharing.shared.team.grid()
            told[name] = map_digest(quantise(grid.log_odds), grid.geometry)
        return told

    def numbers(self) -> dict[str, dict[Author, list[int]]]:
        """The numbers of all entries that each robot holds, by author."""
        logs = {name: peer.sharing.sync.log for name, peer in self.peers.items()}
        return {
            name: {a: sorted(log.of(a).entries) for a in log.authors() if log.of(a).entries}
            for name, log in logs.items()
        }

    def counts(self) -> dict[str, int]:
        """How many observations each robot has made."""
        return {name: peer.sharing.sync.log.own.count for name, peer in self.peers.items()}

    def bytes_since(self, counts: dict[str, int]) -> int:
        """Bytes of the observations that robots have made since they had made so many."""
        size = 0
        for name, peer in self.peers.items():
            entries = peer.sharing.sync.log.own.entries
            size += sum(len(entries[n].what.payload) + 12 for n in entries if n > counts[name])
        return size

    def missing_bytes(self) -> int:
        """Bytes of entries and newest poses that some robot holds and another one does not."""
        logs = [peer.sharing.sync.log for peer in self.peers.values()]
        authors = sorted({author: None for log in logs for author in log.authors()})
        size = 0
        for author in authors:
            held = [log.of(author) for log in logs]
            union = {n: told for log in held for n, told in sorted(log.entries.items())}
            lacking = [n for n in sorted(union) if not all(n in log.entries for log in held)]
            size += sum(len(union[n].what.payload) + 12 for n in lacking)
            newest = max(held, key=lambda log: log.version)
            if any(log.version < newest.version for log in held) and newest.revision:
                size += 6 * len(newest.revision.poses)
        return size

    def log_bytes(self) -> dict[str, int]:
        """Bytes of all messages about the map so far: on the air, and by link."""
        ledger = self.world.relay.ledger
        return {
            "air": sum(t.bytes for (_, kind), t in ledger.aired.items() if kind in LOG_TYPES),
            "link": sum(t.bytes for (_, _, kind), t in ledger.sent.items() if kind in LOG_TYPES),
        }

    def _note(self, name: str, note: Note) -> None:
        self.notes.append(f"{name} {note.level}: {note.text}")


def in_order(numbers: list[int]) -> bool:
    """Whether a log has no gap."""
    return numbers == list(range(1, len(numbers) + 1))
