from __future__ import annotations

import pytest
from pydantic import ValidationError

from server.executive_settings import ExecutiveSettings


@pytest.mark.parametrize(
    "wrong", [{"lease_s": 0.0}, {"max_tries": 0}, {"bid_wait_s": float("nan")}, {"colour": 1}]
)
def test_nonsense_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        ExecutiveSettings(**wrong)  # type: ignore[arg-type]


def test_a_task_outlasts_the_wait_for_bids() -> None:
    settings = ExecutiveSettings()
    assert settings.bid_wait_s < settings.resend_s < settings.silence_s < settings.lease_s
