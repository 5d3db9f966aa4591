from __future__ import annotations

import pytest

from expedition.team import UsageError, checked, load_team, ready_made

ALONE = {"name": "t", "server": {"enabled": False}}


def test_without_a_server_robots_must_decide_for_themselves() -> None:
    with pytest.raises(UsageError, match=r"robot\.decides = 'itself'"):
        checked(ALONE, "a test")
    assert not checked({**ALONE, "robot": {"decides": "itself"}}, "a test").server.enabled


@pytest.mark.parametrize("name", sorted(ready_made()))
def test_every_ready_made_team_says_what_it_is(name: str) -> None:
    team = load_team(name)
    assert team.name == name
    assert team.description


def test_the_rescue_team_needs_no_server() -> None:
    team = load_team("rescue", {"server": {"enabled": False}})
    assert team.robot.decides == "itself"
    assert len(team.members()) == 4
