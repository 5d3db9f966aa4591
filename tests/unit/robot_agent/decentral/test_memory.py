from __future__ import annotations

import pytest

from mapping.geometry import Pose2
from protocol.errors import DamagedLogError
from protocol.log.observation_log import ObservationLog
from robot_agent.decentral.memory import Memory, unpack


@pytest.mark.parametrize("where", [None, Pose2(1.0, -2.0, 0.5)])
def test_what_was_written_down_comes_back(where: Pose2 | None) -> None:
    log = ObservationLog("ann", 2)
    log.append(b"seen", (1, 2, 3))
    memory = unpack(Memory(log, where).pack())
    assert memory.T_map_base == where
    assert memory.log.me == log.me and memory.log.digest() == log.digest()


@pytest.mark.parametrize(
    "damaged", [b"", b"\xc1", b"\x92\xc4\x00\xc0", Memory(ObservationLog("a"), None).pack()[:-3]]
)
def test_what_is_damaged_is_refused(damaged: bytes) -> None:
    with pytest.raises(DamagedLogError):
        unpack(damaged)
