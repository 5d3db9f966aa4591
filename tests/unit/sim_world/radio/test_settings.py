from __future__ import annotations

from typing import Any

import pytest

from expedition.team import UsageError, checked
from sim_world.radio.settings import RadioSettings


def refused(**radio: Any) -> str:
    with pytest.raises(UsageError) as caught:
        checked({"name": "x", "world": {"radio": radio}}, "team x")
    return str(caught.value)


def part(*groups: tuple[str, ...], start: float = 1.0, duration: float = 1.0) -> dict[str, Any]:
    return {"start_s": start, "duration_s": duration, "groups": groups}


def test_what_needs_time_or_places_is_not_at_once() -> None:
    assert RadioSettings(loss=0.1).at_once
    for late in (
        {"latency_s": 0.1},
        {"jitter_s": 0.1},
        {"duplication": 0.1},
        {"reordering": 0.1},
        {"capacity_bit_s": 1e6},
        {"model": "disc"},
        {"model": "path_loss"},
    ):
        assert not RadioSettings.model_validate(late).at_once


def test_good_settings_name_robots_and_the_server() -> None:
    radio = {
        "partitions": (part(("robot1", "server"), ("robot2",)),),
        "one_way": ({"speaker": "server", "listener": "robot3"},),
    }
    team = checked({"name": "x", "world": {"radio": radio}}, "team x")
    assert team.world.radio.names() == ("robot1", "server", "robot2", "server", "robot3")


@pytest.mark.parametrize(
    ("radio", "named"),
    [
        ({"partitions": (part(("robot9",)),)}, "world.radio names 'robot9': use one of robot1,"),
        ({"one_way": ({"speaker": "robot1", "listener": "x"},)}, "world.radio names 'x'"),
        ({"one_way": ({"speaker": "robot1", "listener": "robot1"},)}, "both ends"),
        ({"partitions": (part(("robot1",), ("robot1", "robot2")),)}, "'robot1' stands twice"),
        ({"partitions": (part(),)}, "world.radio.partitions.0.groups"),
        ({"partitions": (part(()),)}, "world.radio.partitions.0.groups.0"),
        ({"partitions": (part(("robot1",), duration=0.0),)}, "partitions.0.duration_s"),
        ({"model": "laser"}, "world.radio.model"),
        ({"loss": 1.5}, "world.radio.loss"),
        ({"capacity_bit_s": 0}, "world.radio.capacity_bit_s"),
        ({"range": 5}, "there is no such setting"),
        ({"server_place": "roof"}, "world.radio.server_place: 'roof' is no place: write"),
        ({"server_place": (1.0,)}, "world.radio.server_place: (1.0,) is no place: write"),
    ],
)
def test_nonsense_is_refused_with_one_line_that_names_it(radio: dict[str, Any], named: str) -> None:
    message = refused(**radio)
    assert named in message
    assert "\n" not in message
