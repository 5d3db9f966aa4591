from __future__ import annotations

from sim_world.radio.partitions import Cuts, Outage
from sim_world.radio.settings import OneWay, Partition


def test_without_cuts_everybody_is_with_everybody() -> None:
    assert not Cuts().off("a", 0.0)
    assert not Cuts().parted("a", "b", 0.0)


def test_an_outage_is_from_its_start_to_before_its_end() -> None:
    cuts = Cuts([Outage("a", 1.0, 2.0)])
    assert [cuts.off("a", t) for t in (0.9, 1.0, 1.9, 2.0)] == [False, True, True, False]
    assert not cuts.off("b", 1.5)


def test_who_is_in_no_group_is_with_the_others_left_over() -> None:
    cuts = Cuts(partitions=[Partition(start_s=1, duration_s=1, groups=(("a", "b"), ("c",)))])
    assert not cuts.parted("a", "c", 0.5)
    assert not cuts.parted("a", "c", 2.0)
    together = {pair: not cuts.parted(*pair, 1.0) for pair in ("ab", "ac", "ad", "cd", "de")}
    assert together == {"ab": True, "ac": False, "ad": False, "cd": False, "de": True}


def test_partitions_at_the_same_time_add_up() -> None:
    first = Partition(start_s=0, duration_s=9, groups=(("a",),))
    second = Partition(start_s=2, duration_s=1, groups=(("b",),))
    cuts = Cuts(partitions=[first, second])
    assert cuts.parted("a", "b", 0.0)
    assert not cuts.parted("b", "c", 0.0)
    assert cuts.parted("b", "c", 2.5)


def test_a_one_way_link_has_no_way_back() -> None:
    cuts = Cuts(one_way=[OneWay(speaker="a", listener="b")])
    assert not cuts.parted("a", "b", 5.0)
    assert cuts.parted("b", "a", 5.0)
