from __future__ import annotations

import numpy as np

from robot_agent.ways import leaders


def test_the_nearest_worthy_place_of_each_frontier_leads():
    component = np.array([0, 0, 0, 1, 2])
    costs = np.array([1.0, 4.0, 3.0, 2.0, 5.0])
    gains = np.array([0.2, 5.0, 6.0, 0.3, 9.0])
    assert leaders(component, costs, gains, 1.0, 9).tolist() == [2, 4]
    assert leaders(component, costs, gains, 1.0, 1).tolist() == [4]
    assert leaders(component, costs, gains, 99.0, 9).tolist() == []
