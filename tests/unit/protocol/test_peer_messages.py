from __future__ import annotations

import numpy as np
import pytest

from protocol.codec import decode, encode
from protocol.errors import MessageError
from protocol.peer_messages import Beacon
from tests.unit.protocol.samples import header_of
from tests.unit.protocol.test_crew import beacon


def test_a_beacon_comes_over_as_it_was_sent() -> None:
    said = beacon(1.5, path=2, busy=True, held=4_000_000_000)
    _, heard = decode(encode(header_of(said), said))
    assert isinstance(heard, Beacon)
    assert heard.T_map_base == said.T_map_base
    assert (heard.busy, heard.idle, heard.through, heard.held) == (True, False, False, said.held)
    np.testing.assert_array_equal(heard.path_map, said.path_map)


@pytest.mark.parametrize(
    "wrong",
    [{"life": -1}, {"sigma_m": -0.1}, {"radius_m": 0.0}, {"speed_m_s": float("nan")}, {"held": -1}],
)
def test_a_beacon_that_cannot_be_is_refused(wrong: dict[str, object]) -> None:
    said = beacon().model_copy(update=wrong)
    with pytest.raises(MessageError):
        decode(encode(header_of(said), said))
