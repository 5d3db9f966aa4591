"""A virtual network for observation logs: real frames, virtual time, scripted faults.

Every frame is encoded and decoded. Bytes are counted twice: on the air, where a broadcast is sent
once, and by link, where it counts for each one it is meant for.
"""

from __future__ import annotations

import heapq
from collections import Counter
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from protocol.codec import Frame, Header, decode, encode, frame_bytes
from protocol.log.messages import LogMessage
from protocol.log.observation_log import ObservationLog
from protocol.log.settings import LogSyncSettings
from protocol.log.storage import dump, load
from protocol.log.sync import LogSync
from protocol.messages import EVERYONE
from tests.unit.protocol.log.invariants import check

STEP = 0.1
PRESENCE = 1.0  # [s]; members say so often, by other means, that they are there


@dataclass(frozen=True)
class Links:
    """How frames travel: shares lost and doubled, delays [s] between the two (reordering)."""

    loss: float = 0.0
    duplication: float = 0.0
    delay: tuple[float, float] = (0.05, 0.05)


GOOD = Links()
SETTINGS = LogSyncSettings()


class Network:
    """Members and the air between them."""

    def __init__(
        self,
        names: list[str],
        seed: int,
        links: Links = GOOD,
        settings: LogSyncSettings = SETTINGS,
    ) -> None:
        self.now = 0.0
        self.links = links
        self.settings = settings
        self.rng = np.random.default_rng(seed)
        self.air: Counter[str] = Counter()  # bytes by message type
        self.by_link: Counter[str] = Counter()
        self.frames: Counter[str] = Counter()
        self.apart: list[set[str]] = []  # groups that hear only themselves; none: all hear all
        self.deaf: set[tuple[str, str]] = set()  # pairs out of reach
        self.members: dict[str, LogSync] = {}
        self.lives: Counter[str] = Counter()
        self.checked = True
        self._flying: list[tuple[float, int, str, Frame]] = []
        self._sequence = 0
        for name in names:
            self.start(name)

    def start(self, name: str, saved: bytes | None = None) -> None:
        """Start a member anew: with a saved log in the same life, or in a new life."""
        if saved is None:
            log = ObservationLog(name, self.lives[name])
            self.lives[name] += 1
        else:
            log = load(saved)
        seed = int(self.rng.integers(2**32))
        self.members[name] = LogSync(log, self.settings, np.random.default_rng(seed), self.now)

    def kill(self, name: str) -> bytes:
        """End a member; return its log as it was saved."""
        return dump(self.members.pop(name).log)

    def observe(self, name: str, size: int = 0) -> None:
        """Let a member make an observation of `size` bytes, 130 or so by default."""
        size = size or int(self.rng.integers(110, 151))
        x, y = (int(v) for v in self.rng.integers(-20_000, 20_000, 2))
        theta = int(self.rng.integers(-31_415, 31_416))
        self.members[name].append(self.rng.bytes(size), (x, y, theta), self.now)

    def revise(self, name: str) -> None:
        """Let a member correct all its poses a little."""
        sync = self.members[name]
        own = sync.log.own
        poses = [own.pose(number) for number in range(1, own.count + 1)]
        table = np.array(poses, dtype=np.int32).reshape(-1, 3)
        table += self.rng.integers(-50, 51, table.shape).astype(np.int32)
        table[:, 2] = np.clip(table[:, 2], -31_415, 31_415)
        sync.revise(table, self.now)

    def run(self, seconds: float) -> None:
        """Let time pass."""
        for _ in range(round(seconds / STEP)):
            self.step()

    def step(self) -> None:
        """Let one step of time pass: frames arrive, members tick."""
        self.now = round(self.now + STEP, 6)
        while self._flying and self._flying[0][0] <= self.now:
            _, _, to, frame = heapq.heappop(self._flying)
            sync = self.members.get(to)
            if sync is not None:
                header, message = decode(frame)
                sync.handle(header.source, message, self.now)  # type: ignore[arg-type]
        if round(self.now / STEP) % round(PRESENCE / STEP) == 0:
            self._say_presence()
        for name in sorted(self.members):
            sync = self.members[name]
            if sync.next_deadline() <= self.now:
                self.send(name, sync.tick(self.now))
        if self.checked:
            for name in sorted(self.members):
                check(self.members[name], self.now)

    def _say_presence(self) -> None:
        """Let each hear, by chance, all that are in reach."""
        for source, to in permutations(sorted(self.members), 2):
            if self._reaches(source, to) and self.rng.random() >= self.links.loss:
                self.members[to].hear(source, self.now)

    def _reaches(self, source: str, to: str) -> bool:
        """Whether one is in another's reach now."""
        parted = any((source in group) != (to in group) for group in self.apart)
        return (source, to) not in self.deaf and not parted

    def send(self, source: str, outgoing: list[tuple[str, LogMessage]]) -> None:
        """Put messages on the air."""
        for to, message in outgoing:
            self._sequence += 1
            header = Header(message.type, source, to, self._sequence, self.now)
            frame = encode(header, message)
            receivers = [n for n in sorted(self.lives) if n != source and to in (n, EVERYONE)]
            self.air[message.type] += frame_bytes(frame)
            self.by_link[message.type] += frame_bytes(frame) * len(receivers)
            self.frames[message.type] += 1
            for receiver in receivers:
                self._carry(source, receiver, frame)

    def _carry(self, source: str, to: str, frame: Frame) -> None:
        """Let a frame fly to one receiver, or not."""
        if not self._reaches(source, to):
            return
        copies = 2 if self.rng.random() < self.links.duplication else 1
        for _ in range(copies):
            if self.rng.random() >= self.links.loss:
                at = self.now + self.rng.uniform(*self.links.delay)
                self._sequence += 1
                heapq.heappush(self._flying, (at, self._sequence, to, frame))

    def digests(self) -> list[str]:
        """Return the different digests there are: one when all hold the same."""
        return sorted({sync.log.digest() for sync in self.members.values()})

    def settle(self, most: float = 300.0) -> float:
        """Run until all hold the same; return how long that took [s].

        Raises:
            AssertionError: they do not within `most` seconds.
        """
        began = self.now
        while len(self.digests()) > 1:
            assert self.now - began < most, f"not the same after {most} s"
            self.run(0.5)
        return self.now - began
