"""Settings refuse nonsense."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from robot_agent.navigation_settings import NavigationSettings


def test_defaults_and_overrides() -> None:
    settings = NavigationSettings.model_validate({"driving": {"lookahead_m": 0.6}})
    assert settings.driving.lookahead_m == 0.6
    assert settings.planning_map.p_obstacle > 0.5 > settings.planning_map.p_clear


@pytest.mark.parametrize(
    "wrong",
    [
        {"driving": {"lookahead_m": -1.0}},
        {"driving": {"speed": 1.0}},
        {"planning_map": {"p_clear": 0.9}},
        {"recovery": {"most_recoveries": -1}},
    ],
)
def test_nonsense_is_refused(wrong: dict) -> None:
    with pytest.raises(ValidationError):
        NavigationSettings.model_validate(wrong)


def test_settings_are_frozen() -> None:
    with pytest.raises(ValidationError):
        NavigationSettings().driving.lookahead_m = 1.0  # type: ignore[misc]
