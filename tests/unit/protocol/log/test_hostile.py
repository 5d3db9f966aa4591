"""One hostile member among honest ones: what it sends, what becomes of it, and of the others."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from protocol.log.author_log import Author, Entry
from protocol.log.messages import LogHave, LogMessage, LogWant, Observations, PoseSet, observations
from protocol.log.pose_coding import pack_poses
from tests.unit.protocol.log.network import Links, Network

# Whole networks of members: minutes as plain Python.
pytestmark = pytest.mark.slow

HONEST = ["ann", "ben", "cid"]
EVE = "eve"


def told(
    author: Author, numbers: list[int], sender: str = EVE, pose: tuple[int, int, int] = (1, 2, 3)
) -> Observations:
    """A message of `sender` about entries that it made up."""
    made_up = [(n, Entry(b"made up %d" % n, pose, 0)) for n in numbers]
    return observations(author, made_up, sender, 0)


def have(*claims: tuple[str, int, int, int]) -> LogHave:
    """Claims of (robot, life, count, version)."""
    names, lives, counts, versions = zip(*claims, strict=True)
    sums = tuple(17 for _ in claims)
    return LogHave(authors=names, lives=lives, counts=counts, versions=versions, sums=sums)


def revision(version: int, count: int, author: str | None = None, x: int = 0) -> PoseSet:
    poses = np.full((count, 3), x, dtype=np.int32)
    return PoseSet(author=author, life=0, version=version, count=count, data=pack_poses(poses))


def forged(**changes: object) -> Observations:
    return told(Author(EVE, 0), [1, 2]).model_copy(update=changes)


def lies(rng: np.random.Generator, k: int) -> list[LogMessage]:
    """Something that must not be, of every kind."""
    ann, victim = Author("ann", 0), Author(HONEST[k % 3], 0)
    return [
        told(victim, [1, 2, 3]),
        told(ann, [k + 1]),
        told(Author(EVE, 0), [1], pose=(2**31 - 1, 0, 0)),
        told(Author(EVE, 0), [10_000 * k + 5]),
        told(Author(EVE, k), [1]),
        told(Author("ben", 7), [1]),
        told(Author(f"ghost{k}", 0), [1, 3, 5]),
        forged(numbers=(2, 1)),
        forged(sizes=(1, 1)),
        forged(numbers=(1, 2, 3)),
        forged(numbers=(), sizes=(), poses=np.zeros((0, 3), dtype=np.int32)),
        revision(1000 + k, 5, "ann"),
        revision(k + 1, 5, x=k),
        revision(1, 50_000, "ben"),
        PoseSet(life=0, version=k + 1, count=4, data=np.zeros(9, dtype=np.uint8)),
        have(("ann", 0, 2**31 - 1, 2**31 - 1), ("ben", 9, 5, 0), (EVE, k, 2**30, 2**30)),
        have(*((f"ghost{k}_{i}", 0, 1000, 9) for i in range(60))),
        LogWant(authors=("ann",), lives=(0,), versions=(1,), ranges=((0, 1, 2**31 - 1),) * 256),
        LogWant(authors=("ann",), lives=(0,), versions=(), ranges=()),
        LogWant(authors=("ann",), lives=(0,), versions=(0,), ranges=((3, 1, 2),)),
        LogWant(authors=("ann", "ann"), lives=(0, 0), versions=(0, 0)),
    ]


@pytest.mark.parametrize("seed", range(4))
def test_the_honest_ones_finish_and_isolate_the_liar(seed: int) -> None:
    rng = np.random.default_rng(seed)
    network = Network(HONEST, seed, Links(0.1, 0.1, (0.0, 0.3)))
    network.lives[EVE] = 1  # has a radio, and no log
    for second in range(60):
        for name in HONEST:
            network.observe(name)
        if second % 20 == 19:
            network.revise(HONEST[second // 20])
        kinds = lies(rng, second)
        chosen = [kinds[int(i)] for i in rng.integers(0, len(kinds), 3)]
        network.send(EVE, [("*", message) for message in chosen])
        network.run(1.0)
    authors = [Author(name, 0) for name in HONEST]
    for _ in range(400):
        if len({sync.log.digest(authors) for sync in network.members.values()}) == 1:
            break
        network.run(0.5)
    for name in HONEST:
        sync = network.members[name]
        assert sync.log.digest(authors) == network.members["ann"].log.digest(authors)
        assert [sync.log.of(author).count for author in authors] == [60, 60, 60]
        assert sorted(sync.standing.isolated) == [EVE]
        lines = [note.text for note in sync.take_notes() if "isolated" in note.text]
        assert len(lines) == 1 and lines[0].startswith("eve is isolated: 5 faults")
        assert sync.take_notes() == []


@pytest.mark.parametrize("kind", range(21))
def test_one_kind_of_lie_does_no_harm(kind: int) -> None:
    """Told again and again, from the beginning, when the honest ones know nothing yet."""
    network = Network(HONEST, kind)
    network.lives[EVE] = 1
    rng = np.random.default_rng(kind)
    for second in range(30):
        network.send(EVE, [("*", lies(rng, second)[kind])])
        for name in HONEST:
            network.observe(name)
        network.run(1.0)
    authors = [Author(name, 0) for name in HONEST]
    network.run(40.0)
    digests = {sync.log.digest(authors) for sync in network.members.values()}
    assert len(digests) == 1
    for name in HONEST:
        sync = network.members[name]
        assert [sync.log.of(author).count for author in authors] == [30, 30, 30]
        assert set(sync.standing.isolated) <= {EVE}
        assert all(peer == EVE for peer, _ in sync.standing.book.counts)


@pytest.mark.parametrize(
    "corrupt",
    [
        lambda sync: sync.log.put(Author("ann", 0), 3, Entry(b"rot", (0, 0, 0), 0), "cid"),
        lambda sync: sync.log.put_revision(
            Author("ann", 0),
            type(sync.log.of(Author("ann", 0)).revision)(1, np.ones((10, 3), dtype=np.int32)),
            "cid",
        ),
    ],
    ids=["entry", "poses"],
)
def test_a_silent_difference_is_found_and_mended_by_the_author(
    corrupt: Callable[[object], None],
) -> None:
    network = Network(HONEST, 2)
    for _ in range(10):
        network.observe("ann")
        network.run(1.0)
    network.revise("ann")
    network.run(10.0)
    corrupt(network.members["ben"])
    assert len(network.digests()) == 2
    network.settle()
    changes = network.members["ben"].log.take_changes()
    assert changes.repositioned


def test_a_difference_that_nobody_can_settle_is_said_once() -> None:
    network = Network(HONEST, 3)
    network.observe("ann")
    network.run(10.0)
    network.kill("ann")
    network.run(30.0)
    network.members["ben"].log.put(Author("ann", 0), 1, Entry(b"rot", (0, 0, 0), 0), "cid")
    network.run(400.0)
    for name in ("ben", "cid"):
        lines = [note.text for note in network.members[name].take_notes()]
        assert len(lines) == 1 and "different logs of ann" in lines[0]
