"""A robot that needs no server, by events alone."""

from __future__ import annotations

import pytest

from mapping.geometry import IDENTITY, Pose2
from protocol import messages as words
from protocol.effects import Effect, Note, PeerLeft, Rejected, Send, Stop
from protocol.log.messages import LogHave, Observations
from protocol.peer_messages import Beacon, LastHeard, Lookout
from protocol.world_messages import Join, Ping, Shutdown, Through
from tests.unit.protocol.test_crew import beacon
from tests.unit.robot_agent.decentral.peer_rig import Rig, seen_by
from tests.unit.robot_agent.test_agent import of_type
from tests.unit.rooms import sent

QUICK = {"decision": {"quiet_s": 0.4, "agreed_s": 0.3, "rest_s": 0.4, "max_tries": 1}}


def joined(**settings: object) -> Rig:
    rig = Rig(**settings)
    rig.join()
    return rig


def radio(effects: list[Effect]) -> list[Send]:
    return [e for e in effects if isinstance(e, Send) and e.channel == "radio"]


def test_it_knocks_at_the_worlds_door_and_at_no_servers() -> None:
    rig = Rig()
    assert rig.peer.next_deadline() == 0.0
    assert sent(rig.peer.tick(0.0)) == [Join(role="robot")]
    effects = rig.join() + rig.live(1.0)
    assert not [e for e in effects if isinstance(e, Send) and e.to == "server"]
    assert {e.to for e in radio(effects)} == {"*"}


def test_what_it_sees_it_tells_everybody_and_draws() -> None:
    rig = joined()
    effects = rig.live(2.0)
    told = of_type(effects, Observations)
    assert len(told) == 1 and told[0].numbers[0] == 1
    assert rig.sharing.home == (0.0, 0.0)
    rig.sharing.follow(rig.now)
    assert len(rig.sharing.shared.team) == rig.sharing.sync.log.own.count > 3
    assert rig.peer.agent.pose_map().distance_to(rig.T_world_base) < 0.1


def test_it_drives_where_it_decides_to() -> None:
    rig = joined()
    effects = rig.live(2.0)
    assert rig.T_world_base.x > 0.2
    assert any(b.busy and len(b.path_map) for b in of_type(effects, Beacon))


def test_its_beacons_say_what_it_holds() -> None:
    rig = joined(life=2)
    last = of_type(rig.live(1.0), Beacon)[-1]
    assert (last.life, last.radius_m) == (2, pytest.approx(0.2))
    assert rig.peer.choosing.crew.beacons["me"] == last


def test_a_teammates_beacon_tells_its_software_where_that_is() -> None:
    rig = joined()
    rig.radio("bob", beacon(1.5, radius_m=0.3))
    assert rig.peer.agent._teammates.places.tolist() == [[1.5, 0.0]]
    rig.radio("bob", beacon(0.5))  # of the same instant: not newer
    assert rig.peer.agent._teammates.places.tolist() == [[1.5, 0.0]]


def test_what_a_teammate_saw_is_on_the_map() -> None:
    rig = joined()
    rig.radio("bob", seen_by("bob", Pose2(1.0, 0.0, 0.0), Pose2(1.5, 0.0, 0.0)))
    rig.live(0.6)
    authors = {placed.author for placed in rig.sharing.shared.team.placed()}
    assert {("bob", 0), ("me", 0)} <= authors


def test_where_a_teammate_does_not_fit_it_does_not_go_and_tells_where_it_does_not_fit() -> None:
    rig = joined()
    rig.live(0.6)
    place = words.TightPlace(place_map=(1.0, 0.0))
    rig.radio("bob", place)
    assert rig.peer.agent._body_parts is not None
    assert (rig.peer.agent._body_parts[1]._tried == 2).any()
    assert rig.peer._carry_out([Send("radio", "server", place)], 1.0) == [Send("radio", "*", place)]


def test_one_that_is_lost_neither_tells_nor_believes_where_a_body_does_not_fit() -> None:
    rig = joined(life=1)
    rig.live(0.6)
    assert not rig.sharing.tied
    place = words.TightPlace(place_map=(1.0, 0.0))
    rig.radio("bob", place)
    assert not (rig.peer.agent._body_parts[1]._tried == 2).any()  # type: ignore[index]
    assert rig.peer._carry_out([Send("radio", "server", place)], 1.0) == []


def test_its_software_gets_the_whole_map_when_it_missed_a_change() -> None:
    rig = joined()
    rig.live(1.0)
    planning_map = rig.peer.agent._body_parts[1]  # type: ignore[index]
    planning_map.number = 0
    request = words.MapRequest(have=0)
    assert rig.peer._carry_out([Send("radio", "server", request)], 1.0) == []
    assert planning_map.number == rig.sharing.feed.number > 0
    assert rig.peer._carry_out([Send("radio", "server", words.Terminate(task=1))], 1.0) == []


def test_who_tells_nonsense_is_heard_no_more() -> None:
    rig = joined()
    notes = []
    for k in range(rig.sharing.sync.settings.faults_to_isolate):
        notes += rig.peer.handle(Rejected("radio", "bob", f"nonsense: {k}"), 0.1 * k)
    assert any(isinstance(note, Note) and "bob" in note.text for note in notes)
    assert list(rig.sharing.sync.standing.isolated) == ["bob"]
    assert rig.radio("bob", beacon(1.5)) == []
    assert "bob" not in rig.peer.choosing.crew.beacons


def test_what_is_none_of_its_business_is_passed_over() -> None:
    rig = joined()
    assert rig.peer.handle(PeerLeft("radio", "bob"), 0.0) == []
    assert rig.radio("bob", Ping()) == []
    (note,) = rig.peer.handle(Rejected("body", "world", "not msgpack"), 0.0)
    assert isinstance(note, Note)
    assert rig.world(Shutdown()) == [Stop("over")]


def test_the_judge_is_told_the_map_and_then_what_changed_of_it() -> None:
    rig = joined()
    (poses,) = rig.world(words.MapRequest(have=0))
    assert isinstance(poses, Send) and isinstance(poses.message, words.TeamPoses)
    rig.live(1.0)
    effects = rig.world(words.MapRequest(have=0))
    assert all(isinstance(e, Send) and (e.channel, e.to) == ("body", "world") for e in effects)
    (snapshot,) = of_type(effects, words.MapSnapshot)
    assert of_type(rig.world(words.MapRequest(have=snapshot.number)), words.MapDelta) == []
    rig.live(1.0)
    (delta,) = of_type(rig.world(words.MapRequest(have=snapshot.number)), words.MapDelta)
    assert delta.number == snapshot.number + 1
    assert of_type(rig.world(words.MapRequest(have=1)), words.MapSnapshot)


def test_when_nothing_is_left_it_says_that_it_is_through() -> None:
    rig = joined(**QUICK)
    effects = rig.live(6.0)
    word = of_type(effects, Through)[-1]
    assert word.through and word.held == rig.sharing.checksum()
    assert rig.peer.choosing.through
    assert any(isinstance(e, Note) and "through at" in e.text for e in effects)
    assert of_type(effects, Beacon)[-1].through


def test_it_goes_on_answering_teammates_when_it_is_through() -> None:
    rig = joined(**QUICK)
    rig.live(5.0)
    assert rig.peer.choosing.through
    rig.radio("bob", seen_by("bob", Pose2(1.0, 0.0, 0.0)))
    effects = rig.live(8.0)
    assert any("bob" in have.authors for have in of_type(effects, LogHave))


def test_with_nothing_to_find_it_drives_home() -> None:
    rig = joined(**QUICK)
    rig.radio("bob", beacon(-0.5))  # who finds something still
    rig.live(3.0)
    assert rig.peer.choosing.idle
    rig.sharing.home = (2.2, 0.0)
    before = rig.T_world_base.x
    rig.live(1.5)
    assert not rig.peer.choosing.through
    assert rig.T_world_base.x > before + 0.3


def test_a_task_that_does_not_get_on_is_put_down() -> None:
    rig = joined(decision={"patience_s": 1.5})
    rig.live(1.0)
    assert rig.peer.choosing.busy
    for _ in range(60):  # wheels that turn and do not get it anywhere
        rig.command = (0.0, 0.0)
        rig.live()
    _, tried, _ = rig.peer.choosing.last
    assert len(tried.kept_from("me", rig.now)) > 0


def test_a_second_start_is_not_taken_for_where_it_was_told() -> None:
    rig = Rig(life=1, reference=True, look_around=True)
    rig.join(start=IDENTITY)
    effects = rig.live(1.0)
    assert not rig.sharing.tied
    assert of_type(effects, Observations) == []


def test_a_teammate_that_started_anew_is_told_where_it_was() -> None:
    rig = joined()
    rig.radio("bob", beacon(1.0, sigma_m=0.0))
    assert of_type(rig.radio("bob", beacon(1.0, sigma_m=0.0)), LastHeard) == []
    rig.live(1.0)
    effects = rig.radio("bob", beacon(0.0, life=1, sigma_m=0.7))
    (word,) = of_type(effects, LastHeard)
    assert (word.life, word.T_map_base.x) == (0, 1.0)
    again = Rig(life=1)
    again.join()
    again.radio("ann", word)
    assert again.sharing.place.whereabouts.T_map_own.x == 1.0


# --- one that was told its start with an error ---------------------------------------------------


def uncertain(reference: bool = False, **settings: object) -> Rig:
    rig = Rig(reference=reference, look_around=True, **settings)
    rig.join(start_sigma_m=1.0, start_sigma_deg=20.0)
    return rig


def test_whom_it_sees_it_tells_while_somebody_does_not_know_its_place() -> None:
    rig = uncertain()
    told = of_type(rig.live(3.0), Lookout)
    assert 2 <= len(told) <= 4
    assert not told[0].tied and told[0].error_m == 1.0
    known = uncertain(reference=True)
    assert of_type(known.live(2.0), Lookout) == []
    known.radio("bob", beacon(1.0, sigma_m=0.5))
    assert of_type(known.live(2.0), Lookout)[0].tied


def test_what_a_teammate_saw_of_others_is_kept_until_that_is_isolated() -> None:
    rig = uncertain()
    word = of_type(uncertain(reference=True).live(0.5), Lookout) or of_type(rig.live(2.0), Lookout)
    assert rig.radio("bob", word[0]) == []
    lookouts = rig.sharing.place.lookouts
    assert "bob" in lookouts._frames
    for k in range(rig.sharing.sync.settings.faults_to_isolate):
        rig.peer.handle(Rejected("radio", "bob", f"nonsense: {k}"), 0.1 * k)
    rig.radio("bob", word[0])
    assert "bob" not in lookouts._frames


def test_what_looks_like_a_teammate_is_no_wall_while_that_may_be_anywhere() -> None:
    assert joined().peer.agent.unplaced == ()
    rig = uncertain(reference=True)
    assert rig.peer.agent.unplaced == (pytest.approx(0.2),)  # nobody was heard yet
    rig.radio("bob", beacon(1.0, sigma_m=0.5, radius_m=0.3))
    rig.live(1.0)
    assert rig.peer.agent.unplaced == (0.3,)
    rig.live(1.0)
    rig.radio("bob", beacon(1.0, sigma_m=0.0, radius_m=0.3))
    rig.live(1.0)
    assert rig.peer.agent.unplaced == ()


def test_one_that_waited_for_long_explores_on_its_own_and_shares_when_it_knows_its_place() -> None:
    rig = uncertain(tying={"alone_s": 3.0})
    rig.live(2.5)
    planning_map = rig.peer.agent._body_parts[1]  # type: ignore[index]
    assert planning_map.number == 0 and rig.command[1] > 0.0  # it turns on the spot
    effects = rig.live(9.0)
    assert planning_map.number == rig.sharing.feed.number > 0
    assert rig.command[1] == 0.0
    assert not rig.sharing.tied and rig.sharing.sync.log.own.count == 0
    assert not any(b.idle or b.through for b in of_type(effects, Beacon))
    seen = [Pose2(0.25 * k, 0.05 * k, 0.5 * k) for k in range(6)]
    rig.radio("ann", seen_by("ann", *seen))
    effects = rig.live(14.0)
    assert rig.sharing.tied
    assert rig.sharing.sync.log.own.count > 5
    assert rig.peer.agent.pose_map().distance_to(rig.T_world_base) < 0.1
    authors = {placed.author for placed in rig.sharing.shared.team.placed()}
    assert authors == {("ann", 0), ("me", 0)}
    assert planning_map.number == rig.sharing.feed.number
