"""What a robot writes down, so that it can go on when its software is started anew."""

from __future__ import annotations

from dataclasses import dataclass

import msgpack

from mapping.geometry import Pose2
from protocol.errors import DamagedLogError
from protocol.log.observation_log import ObservationLog
from protocol.log.storage import dump, load


@dataclass(frozen=True, slots=True)
class Memory:
    """What is written down.

    Attributes:
        log: all that the robot holds.
        T_map_base: where it was, map frame; None if it did not know.
    """

    log: ObservationLog
    T_map_base: Pose2 | None

    def pack(self) -> bytes:
        """Return it as bytes."""
        where = self.T_map_base.as_tuple() if self.T_map_base else None
        packed: bytes = msgpack.packb((dump(self.log), where))
        return packed


def unpack(data: bytes) -> Memory:
    """Return what `Memory.pack` made these bytes of.

    Raises:
        DamagedLogError: the bytes are cut, changed, or something else.
    """
    try:
        log, where = msgpack.unpackb(data)
        T_map_base = None if where is None else Pose2(*(float(value) for value in where))
    except Exception as error:  # damaged bytes fail in many ways
        raise DamagedLogError(
            f"what the robot wrote down is damaged: {type(error).__name__}"
        ) from None
    return Memory(load(log), T_map_base)
