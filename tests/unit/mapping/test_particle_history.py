from __future__ import annotations

import numpy as np

from mapping.particle_history import ParticleHistory


def test_a_particle_has_the_way_of_its_ancestors_behind_it() -> None:
    history = ParticleHistory()
    poses = np.zeros((3, 3))
    for update, parents in enumerate(([0, 1, 2], [1, 1, 2], [0, 0, 2])):
        poses[:, 0] = 10 * update + np.arange(3)
        history.append(poses, np.array(parents))
    assert len(history) == 3
    assert history.path(1)[:, 0].tolist() == [1.0, 10.0, 21.0]
    assert history.path(2)[:, 0].tolist() == [2.0, 12.0, 22.0]
    assert history.path(1, since=1)[:, 0].tolist() == [10.0, 21.0]


def test_without_updates_there_is_no_way() -> None:
    assert ParticleHistory().path(0).shape == (0, 3)
