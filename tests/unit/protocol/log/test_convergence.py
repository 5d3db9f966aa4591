"""A team's logs over bad links: after healing all hold the same, and it costs what it may.

Seeds are in the names of the tests.
"""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from protocol.log.pose_coding import pack_poses
from protocol.log.settings import LogSyncSettings
from tests.unit.protocol.log.network import GOOD, Links, Network

# Whole networks of members: minutes as plain Python.
pytestmark = pytest.mark.slow

TEAM = ["robot1", "robot2", "robot3", "robot4"]
BAD = Links(loss=0.3, duplication=0.1, delay=(0.0, 0.4))


def drive(network: Network, seconds: int, revise_every: int = 60) -> None:
    """Let every robot observe once a second and revise its poses now and then, in turn."""
    for second in range(seconds):
        for name in TEAM:
            network.observe(name)
        if second % revise_every == revise_every - 1:
            network.revise(TEAM[second // revise_every % len(TEAM)])
        network.run(1.0)


def since(now: Counter[str], before: Counter[str]) -> int:
    """Return how many bytes were sent since."""
    return sum(now.values()) - sum(before.values())


def size_of(network: Network, names: list[str]) -> int:
    """Return the size of what some robots wrote: payloads, poses, newest revisions."""
    logs = [network.members[name].log.own for name in names]
    revisions = sum(len(pack_poses(log.poses)) for log in logs if log.revision)
    return revisions + sum(log.bytes + 12 * log.count for log in logs)


@pytest.mark.parametrize("seed", range(8))
def test_any_schedule_of_faults_ends_with_the_same_map_everywhere(seed: int) -> None:
    """Loss, duplicates, reordering, partitions, restarts with and without the log."""
    rng = np.random.default_rng(seed)
    names = TEAM[: int(rng.integers(2, 5))]
    loss, doubled = (float(v) for v in rng.uniform(0.0, 0.4, 2))
    network = Network(names, seed, Links(loss, doubled, (0.0, float(rng.uniform(0.1, 3.0)))))
    saved: dict[str, bytes | None] = {}
    for _ in range(60):
        alive = sorted(network.members)
        for name in alive:
            if rng.random() < 0.6:
                network.observe(name)
            if rng.random() < 0.04:
                network.revise(name)
        if rng.random() < 0.08:
            network.apart = [{name for name in names if rng.random() < 0.5}]
        if rng.random() < 0.06 and len(alive) > 1:
            name = str(rng.choice(alive))
            kept = network.kill(name)
            saved[name] = kept if rng.random() < 0.5 else None
        if rng.random() < 0.1 and saved:
            network.start(*saved.popitem())
        network.run(1.0)
    network.apart = []
    network.settle()
    network.links = GOOD
    network.run(60.0)
    assert len(network.digests()) == 1
    for sync in network.members.values():
        assert sync.standing.book.counts == {}
        assert not sync.overtaken


@pytest.mark.parametrize("seed", range(3))
def test_bytes_without_loss(seed: int) -> None:
    network = Network(TEAM, seed)
    drive(network, 120)
    network.settle()
    count = sum(network.members[name].log.own.count for name in TEAM)
    assert sum(network.air.values()) / count < 225.0
    assert network.air["log_want"] == 0


@pytest.mark.parametrize("seed", range(2))
def test_bytes_with_heavy_loss(seed: int) -> None:
    """By link, where a broadcast counts for each receiver: what is lost is sent again to it."""
    good, bad = Network(TEAM, seed), Network(TEAM, seed, BAD)
    for network in (good, bad):
        drive(network, 150)
        network.settle()
    assert since(bad.by_link, Counter()) <= 1.6 * since(good.by_link, Counter())
    assert since(bad.air, Counter()) <= 2.6 * since(good.air, Counter())


@pytest.mark.parametrize("seed", range(3))
def test_two_pairs_meet_again(seed: int) -> None:
    """Both of a pair lack the same, and hear it once."""
    network = Network(TEAM, seed)
    network.apart = [{"robot1", "robot2"}]
    drive(network, 150, revise_every=50)
    network.run(20.0)
    before = network.air.copy()
    network.apart = []
    seconds = network.settle()
    network.run(10.0)
    assert since(network.air, before) <= 1.2 * size_of(network, TEAM)
    assert seconds < 30.0


@pytest.mark.parametrize("seed", range(3))
def test_one_robot_comes_back(seed: int) -> None:
    network = Network(TEAM, seed)
    network.apart = [{"robot4"}]
    drive(network, 150, revise_every=50)
    network.run(20.0)
    air, by_link = network.air.copy(), network.by_link.copy()
    network.apart = []
    network.settle()
    network.run(10.0)
    alone, others = size_of(network, ["robot4"]), size_of(network, TEAM[:3])
    assert since(network.air, air) <= 1.2 * (alone + others)
    assert since(network.by_link, by_link) <= 1.2 * (3 * alone + others)


@pytest.mark.parametrize("seed", range(3))
def test_pairs_meet_again_where_every_receiver_counts(seed: int) -> None:
    """Without answers for all, each link carries just what its receiver lacks."""
    network = Network(TEAM, seed, settings=LogSyncSettings(broadcast_from=99))
    network.apart = [{"robot1", "robot2"}]
    drive(network, 150)
    network.run(20.0)
    before = network.by_link.copy()
    network.apart = []
    network.settle()
    network.run(10.0)
    assert since(network.by_link, before) <= 1.2 * 2 * size_of(network, TEAM)


@pytest.mark.parametrize("seed", range(3))
def test_what_a_robot_saw_reaches_others_through_a_third_when_it_is_gone(seed: int) -> None:
    network = Network(["a", "b", "c"], seed, Links(loss=0.2))
    network.deaf = {("a", "c"), ("c", "a")}
    for _ in range(40):
        network.observe("a")
        network.observe("c")
        network.run(0.5)
    network.revise("a")
    a, b = (network.members[name].log for name in ("a", "b"))
    while a.digest([a.me]) != b.digest([a.me]):
        network.run(1.0)
    network.kill("a")
    network.settle()
    author = network.members["b"].log.authors()[0]
    assert author.robot == "a"
    assert network.members["c"].log.of(author).count == 40
    assert network.members["c"].log.of(author).version == 1


@pytest.mark.parametrize("seed", range(3))
def test_a_chain_of_five_hands_everything_on(seed: int) -> None:
    names = ["a", "b", "c", "d", "e"]
    network = Network(names, seed, Links(loss=0.1))
    near = set(pairwise(names))
    network.deaf = {(x, y) for x in names for y in names if not near & {(x, y), (y, x)}}
    for _ in range(30):
        for name in names:
            network.observe(name)
        network.run(1.0)
    network.settle()


def test_answers_do_not_block_the_air() -> None:
    """A robot that lost all gets it at the rate that is set, while the others go on."""
    network = Network(["a", "b"], 5, settings=LogSyncSettings(answer_bytes_s=4000.0))
    for _ in range(1000):
        network.observe("a")
        network.run(0.1)
    network.run(10.0)
    network.kill("b")
    network.start("b")
    before, began = network.air.copy(), network.now
    missing = size_of(network, ["a"])
    rates = []
    while len(network.digests()) > 1:
        last = network.air["observations"]
        network.run(2.0)
        rates.append((network.air["observations"] - last) / 2.0)
    assert max(rates) <= 4000.0 + 10_000.0 / 2.0
    assert network.now - began < 1.5 * missing / 4000.0
    assert since(network.air, before) <= 1.2 * missing


def test_a_robot_restored_from_an_old_copy_is_told_so() -> None:
    network = Network(["a", "b"], 1)
    network.observe("a")
    network.run(5.0)
    old = network.kill("a")
    network.start("a", old)
    network.observe("a")
    network.run(10.0)
    assert not network.members["a"].overtaken
    network.kill("a")
    network.start("a", old)
    network.run(60.0)
    assert network.members["a"].overtaken
    network.kill("a")
    network.start("a")  # with nothing, in a new life
    network.observe("a")
    network.settle()
    lives = [author.life for author in network.members["b"].log.authors() if author.robot == "a"]
    assert lives == [0, 1]
