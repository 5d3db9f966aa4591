from __future__ import annotations

from protocol.body import Body
from server.executive_settings import ExecutiveSettings
from server.pool import Member, Pool
from server.work import Work
from tests.unit.server.executive_rig import bid_of


def member(name: str, joined: float = 0.0) -> Member:
    return Member(name, Body(), Work(ExecutiveSettings()).new_robot(name, joined), joined)


def test_robots_come_by_name() -> None:
    pool = Pool()
    for name in ("carl", "anna", "ben"):
        pool.add(member(name))
    assert [m.name for m in pool] == ["anna", "ben", "carl"]
    assert pool.get("zoe") is None


def test_fit() -> None:
    pool = Pool()
    for name in ("anna", "ben", "carl", "dora"):
        pool.add(member(name))
    anna, ben, carl, _ = pool
    anna.live = False
    ben.mode = "drive"
    carl.benched_until = 9.0
    assert [m.name for m in pool.fit(5.0)] == ["dora"]
    assert [m.name for m in pool.fit(9.0)] == ["carl", "dora"]


def test_lag() -> None:
    anna = member("anna", joined=3.0)
    assert anna.lag(5.0) == 2.0
    anna.bid = bid_of("anna", [], 1)
    assert anna.lag(5.0) == 0.0
    anna.behind_since = 4.0
    assert anna.lag(5.0) == 1.0


def test_tasks() -> None:
    work = Work(ExecutiveSettings())
    anna = Member("anna", Body(), work.new_robot("anna", 0.0), 0.0)
    assert anna.leaf is anna.task is anna.exploring is None
    leaf = work.leaf("anna", "wait", (1.0, 2.0))
    anna.node.add(leaf, 0.0)
    assert anna.leaf is leaf and anna.task is leaf.task and anna.exploring is None


def test_rejoin() -> None:
    anna = member("anna")
    anna.rejoin(2.0)
    assert (anna.idle_since, anna.behind_since) == (2.0, None)
    anna.behind_since = 1.0
    anna.rejoin(9.0)
    assert anna.behind_since == 9.0
