"""How dear a robot's way is to the auction."""

from __future__ import annotations

from protocol.body import Body

# The speed [m/s] at which a metre of way costs just what the auction's settings say.
NOMINAL_SPEED = 0.5


def way_weight(body: Body, cost_weight: float = 1.0) -> float:
    """Return the factor on a robot's ways: a slow robot's cost more, as they take more time.

    Args:
        body: how fast it is.
        cost_weight: how dear its way is besides.
    """
    return cost_weight * NOMINAL_SPEED / body.drive.speed_max_m_s
