from __future__ import annotations

from protocol.body import Body, Drive
from server.bids import way_weight


def test_a_slow_robots_ways_cost_more() -> None:
    assert way_weight(Body()) == 1.0
    slow = Body(drive=Drive(speed_max_m_s=0.25))
    assert way_weight(slow) == 2.0
    assert way_weight(slow, 1.5) == 3.0
