from __future__ import annotations

import pytest
from pydantic import ValidationError

from robot_agent.decentral.settings import DecisionSettings, PeerSettings


def test_who_is_here_is_not_lost() -> None:
    settings = DecisionSettings()
    assert settings.here_s < settings.lost_s
    assert PeerSettings().beacon_rest_s < settings.here_s


@pytest.mark.parametrize(
    "wrong",
    [
        {"decision": {"here_s": 0.0}},
        {"decision": {"max_tries": 0}},
        {"beacon_points": 65},
        {"error_bound_m": 0.0},
        {"tying": {"fit": 1.5}},
        {"unheard_of": 1},
    ],
)
def test_what_makes_no_sense_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        PeerSettings.model_validate(wrong)
