from __future__ import annotations

import pytest

from mapping.geometry import Pose2
from protocol.body import Body
from tests.unit.server.executive_rig import Rig, awards, bid_of, terminations


def test_it_waits_a_short_while_in_case_other_bids_arrive() -> None:
    rig = Rig("anna", "ben")
    assert rig.bid("ben", (5, 20, 5), (9, 18, 9)) == []
    assert rig.executive.next_deadline() == pytest.approx(0.3)
    assert rig.wait(0.2) == []
    rig.bid("anna", (5, 20, 2), (9, 18, 6))
    assert awards(rig.wait(0.2)) == [("anna", "explore", 5), ("ben", "explore", 9)]


def test_robots_at_work_without_new_bids_go_on() -> None:
    rig = Rig("anna", "ben")
    rig.bid("anna", (5, 20, 5))
    rig.wait(0.4)
    rig.bid("ben", (5, 20, 1), (30, 20, 9))
    assert awards(rig.wait(0.4)) == [("ben", "explore", 30)]
    assert rig.goals() == {"anna": 5, "ben": 30}


def test_a_robot_whose_best_place_is_unchanged_keeps_its_task() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 20, 5), (30, 20, 30))
    rig.wait(0.4)
    task = rig.task("anna")
    rig.progress("anna", 4.0)
    rig.new_map()
    rig.bid("anna", (5.2, 19, 4), (30, 20, 30))
    assert awards(rig.wait(0.4)) == []
    assert rig.task("anna") == task
    assert rig.executive.tasks()[0].gain == 19


def test_a_robot_is_sent_elsewhere_when_its_goal_was_seen_by_others() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 20, 5), (30, 20, 30))
    rig.wait(0.4)
    rig.progress("anna", 4.0)
    rig.new_map()
    rig.bid("anna", (30, 20, 29))
    sends = rig.wait(0.4)
    assert awards(sends) == [("anna", "explore", 30)]
    assert terminations(sends) == []  # the award alone says it


def test_a_task_with_nothing_to_gain_any_more_is_taken_back() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 20, 5))
    rig.wait(0.4)
    rig.progress("anna", 4.0)
    task = rig.task("anna")
    rig.new_map()
    rig.bid("anna")
    assert terminations(rig.wait(0.4)) == [("anna", task)]


def test_robots_swap_tasks() -> None:
    rig = Rig("anna", "ben")
    rig.bid("anna", (0, 15, 2), (20, 15, 14))
    rig.bid("ben", (0, 15, 14), (20, 15, 2))
    rig.wait(0.4)
    assert rig.goals() == {"anna": 0, "ben": 20}
    rig.new_map()
    rig.bid("anna", (0, 15, 12), (20, 15, 6))
    rig.bid("ben", (0, 15, 1), (20, 15, 14))
    rig.wait(0.4)
    assert rig.goals() == {"anna": 20, "ben": 0}


def test_the_next_task_follows_at_once() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 20, 5), (9, 20, 9))
    rig.wait(0.4)
    sends = rig.end("anna")
    assert awards(sends) == [("anna", "explore", 9)]


def test_an_end_is_answered_even_if_nothing_follows() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 20, 5))
    rig.wait(0.4)
    task = rig.task("anna")
    assert task is not None
    assert terminations(rig.end("anna")) == [("anna", task)]
    assert terminations(rig.end("anna", task=task)) == [("anna", task)]


def test_words_about_old_tasks_are_harmless() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 20, 5), (30, 20, 30))
    rig.wait(0.4)
    old = rig.task("anna")
    assert old is not None
    rig.new_map()
    rig.bid("anna", (30, 20, 29))
    rig.wait(0.4)
    assert rig.end("anna", "failed", "stuck", task=old) == []  # it has not heard yet
    assert rig.progress("anna", 3.0, task=old) == []
    rig.progress("anna", 28.0)
    assert terminations(rig.progress("anna", 3.0, task=old)) == [("anna", old)]
    assert rig.goals() == {"anna": 30}


def test_a_place_just_visited_rests_until_the_map_has_caught_up() -> None:
    rig = Rig("anna", "ben")
    rig.bid("anna", (5, 20, 5))
    rig.wait(0.4)
    assert awards(rig.end("anna")) == []
    assert awards(rig.wait(3.5, "anna", "ben")) == []
    assert awards(rig.wait(1.0, "anna", "ben")) == [("anna", "explore", 5)]


def test_a_frontier_that_stays_is_given_up_in_the_end() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 20, 5))
    for _ in range(3):
        rig.wait(5.0, "anna")
        rig.end("anna")
    rig.wait(9.0, "anna")
    assert rig.executive.exhausted(rig.now)
    (left,) = rig.executive.remaining()
    assert left["reason"] == "given up after 3 tries"
    assert left["tries"] == ["anna: visited, and the frontier was left"] * 3
    assert rig.events("given up") == [("given up", "anna")]


def test_a_failed_place_goes_to_another_robot() -> None:
    rig = Rig("anna", "ben")
    rig.bid("anna", (5, 20, 2), (40, 20, 40))
    rig.bid("ben", (5, 20, 8), (40, 20, 40))
    rig.wait(0.4)
    assert rig.goals() == {"anna": 5, "ben": 40}
    rig.end("anna", "failed", "stuck")
    rig.end("ben")
    assert rig.goals() == {"ben": 5}


def test_what_failed_for_everybody_gets_second_chances_and_is_given_up() -> None:
    rig = Rig("anna", "ben")
    rig.bid("anna", (5, 20, 2))
    rig.bid("ben", (5, 20, 8))
    rig.wait(0.4)
    rig.end("anna", "unreachable")
    assert rig.goals() == {"ben": 5}
    rig.end("ben", "failed", "stuck")
    assert ("second chances", "") in rig.events("second chances")
    assert rig.goals() == {"anna": 5}
    rig.end("anna", "unreachable", "no way")
    assert rig.goals() == {}
    (left,) = rig.executive.remaining()
    assert left["tries"] == ["anna: unreachable", "ben: failed: stuck", "anna: unreachable: no way"]
    rig.wait(9.0, "anna", "ben")
    assert rig.executive.exhausted(rig.now)


def test_a_lost_robots_task_is_free_at_once() -> None:
    rig = Rig("anna", "ben")
    rig.bid("anna", (5, 20, 2))
    rig.bid("ben", (5, 20, 8))
    rig.wait(0.4)
    assert rig.goals() == {"anna": 5}
    sends = rig.take(rig.executive.robot_lost("anna", rig.now))
    assert awards(sends) == [("ben", "explore", 5)]
    assert rig.executive.robot_lost("anna", rig.now) == []
    assert rig.executive.mode("anna") == "lost"
    assert rig.executive.remaining()[0]["reason"] == "not visited: mission ended first"


def test_a_silent_robot_is_lost_and_comes_back() -> None:
    rig = Rig("anna", "ben")
    rig.bid("anna", (5, 20, 2), (30, 20, 30))
    rig.bid("ben", (5, 20, 8))
    rig.wait(0.4)
    rig.wait(5.0, "ben")
    assert rig.events("lost") == [("lost", "anna")]
    assert rig.goals() == {"ben": 5}
    assert awards(rig.take(rig.executive.robot_back("anna", rig.now))) == [("anna", "explore", 30)]
    assert rig.executive.mode("anna") == "pool"


def test_a_robot_without_progress_loses_its_task() -> None:
    rig = Rig("anna", "ben")
    rig.bid("anna", (5, 20, 2))
    rig.bid("ben", (5, 20, 8))
    rig.wait(0.4)
    for _ in range(21):
        rig.wait(1.0, "anna", "ben")
        if rig.goals() == {"anna": 5}:
            rig.progress("anna", 4.0)
    assert rig.goals() == {"ben": 5}
    assert ("expired", "anna") in rig.events("expired")


@pytest.mark.parametrize(("apart", "kept"), [(1, False), (30, True)])
def test_a_robot_sent_to_and_fro_must_get_nearer_to_one_of_two_places(
    apart: int, kept: bool
) -> None:
    rig = Rig("anna", lease_s=5.0)
    for k in range(8):
        rig.new_map()
        better, worse = (5, 20, 8), (5 + apart, 15, 9)
        if k % 2:
            better, worse = (5 + apart, 20, 8), (5, 15, 9)
        rig.bid("anna", better, worse)
        rig.wait(1.0, "anna")
        rig.progress("anna", 8.0)
    assert (rig.events("expired") == []) == kept


def test_progress_keeps_the_task() -> None:
    rig = Rig("anna", lease_s=3.0)
    rig.bid("anna", (50, 20, 50))
    rig.wait(0.4)
    for meter in range(50):
        rig.wait(0.5)
        rig.progress("anna", 50.0 - meter)
    assert rig.goals() == {"anna": 50}


def test_a_robot_whose_tasks_all_expire_is_left_out_for_a_while() -> None:
    rig = Rig("anna", lease_s=2.0, expiries_max=2, bench_s=10.0)
    rig.bid("anna", (5, 20, 2), (15, 20, 12), (25, 20, 22))
    rig.wait(6.0, "anna")
    assert rig.events("expired", "left out") == [
        ("expired", "anna"),
        ("expired", "anna"),
        ("left out", "anna"),
    ]
    assert rig.goals() == {}
    assert rig.executive.stalled(rig.now) is not None
    rig.wait(10.0, "anna")
    assert rig.events("awarded")[2:] == [("awarded", "anna")] * (len(rig.events("awarded")) - 2)
    assert rig.goals() == {"anna": 25}


def test_awards_are_sent_again_until_they_have_an_echo() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 20, 5))
    first = rig.wait(0.4, "anna")
    again = rig.wait(4.0, "anna")
    assert awards(again) == awards(first) * 2  # after 1 s and after 2 s more
    assert {send.message.task for send in again} == {rig.task("anna")}  # type: ignore[attr-defined]
    rig.progress("anna", 4.0)
    assert rig.wait(2.9, "anna") == []
    assert awards(rig.wait(0.2, "anna")) == awards(first)  # it may have ended it, and we not heard
    rig.end("anna")
    assert rig.wait(3.0, "anna") == []


def test_old_and_unknown_bids_are_ignored() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 20, 5))
    rig.take(rig.executive.bid(bid_of("anna", [(9, 90, 1)], 1), rig.now))
    rig.take(rig.executive.bid(bid_of("zoe", [(9, 90, 1)], 1), rig.now))
    rig.wait(0.4)
    assert rig.goals() == {"anna": 5}


def test_unknown_robots_do_no_harm() -> None:
    rig = Rig("anna")
    executive = rig.executive
    assert executive.progress("zoe", 1, 2.0, 0.0) == []
    assert executive.task_ended("zoe", 1, "done", "", 0.0) == []
    assert executive.contact("zoe", 0.0) == [] == executive.robot_lost("zoe", 0.0)
    assert executive.mode("zoe") == "unknown" and not executive.busy("zoe")


def test_a_robot_that_begins_anew_starts_without_a_task() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 20, 5))
    rig.wait(0.4)
    assert rig.executive.busy("anna")
    rig.take(rig.executive.robot_joined("anna", Body(), rig.now))
    assert not rig.executive.busy("anna")
    rig.take(rig.executive.bid(bid_of("anna", [(7, 20, 5)], 0), rig.now))
    rig.wait(0.4)
    assert rig.goals() == {"anna": 7}


def test_a_paused_robot_that_begins_anew_stays_paused() -> None:
    rig = Rig("anna")
    rig.executive.pause("anna", rig.now)
    rig.take(rig.executive.robot_joined("anna", Body(), rig.now))
    assert rig.executive.mode("anna") == "pause" and not rig.executive.busy("anna")
    assert rig.goals("pause").keys() == {"anna"}


def test_an_old_map_number_changes_nothing() -> None:
    rig = Rig("anna")
    rig.bid("anna")
    assert rig.executive.map_changed(0, 0.0) == []
    rig.wait(4.5, "anna")
    assert rig.executive.exhausted(rig.now)


def test_the_record_says_what_happened() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 20, 5))
    rig.wait(0.4)
    rig.progress("anna", 4.0)
    rig.end("anna")
    events = [event for event, _ in rig.events("joined", "awarded", "active", "done")]
    assert events == ["joined", "awarded", "active", "done"]
    record = rig.executive.happenings[-1]
    assert record["task"] == 1 and record["kind"] == "explore" and record["goal"] == [5.0, 0.0]


def test_the_next_deadline_is_never_missed() -> None:
    """Ticking at the deadlines alone does all that is due, and never twice at one time."""
    rig = Rig("anna", lease_s=8.0)
    rig.executive.contact("anna", 0.0, Pose2(1.0, 0.0, 0.0))
    rig.bid("anna", (5, 20, 5))
    times = []
    for _ in range(12):
        deadline = rig.executive.next_deadline()
        if deadline is None:
            break
        assert deadline > rig.now
        rig.now = deadline
        times.append(deadline)
        rig.take(rig.executive.tick(deadline))
    assert times[:4] == pytest.approx([0.3, 1.3, 3.3, 5.0])
    assert rig.executive.next_deadline() is None  # nobody is there any more
    assert rig.events("lost") == [("lost", "anna")]
