from __future__ import annotations

from typing import Any

import msgpack
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.errors import FrameError
from protocol.host import Parcel
from protocol.lockstep import FAR_END, Bundle
from protocol.transports.bundles import (
    DONE,
    INSTANT,
    pack_bundle,
    pack_parcels,
    unpack_bundle,
    unpack_parcels,
)

parcels = st.lists(
    st.builds(
        Parcel,
        st.sampled_from(sorted(FAR_END)),
        st.text(max_size=8),
        st.lists(st.binary(max_size=8), min_size=1, max_size=4),
    ),
    max_size=5,
)


@given(parcels, st.floats(0.0, 1e6), st.sampled_from([None, "kill", "restart"]), st.integers(0, 9))
@settings(deadline=None)
def test_a_bundle_comes_back_as_it_was(
    packed: list[Parcel], now: float, strike: str | None, incarnation: int
) -> None:
    bundle = Bundle("robot1", now, packed, strike, incarnation)
    message = pack_bundle(bundle)
    assert message[0] == INSTANT
    assert unpack_bundle("robot1", message) == bundle


def test_an_answer_comes_back_as_it_was() -> None:
    sent = [Parcel("radio", "server", [b"head", b"body", b""])]
    meta, back = unpack_parcels(pack_parcels(DONE, [1.5, None], sent))
    assert (meta, back) == ([1.5, None], sent)


def message_of(meta: Any, layout: Any, *parts: bytes) -> list[bytes]:
    return [DONE, msgpack.packb([meta, layout]), *parts]


@pytest.mark.parametrize(
    "message",
    [
        [],
        [DONE],
        [DONE, b""],
        [DONE, b"\xc1"],
        [DONE, msgpack.packb(3)],
        [DONE, b"\x91" * 5000 + b"\xc0"],
        [DONE, b"\xdd\xff\xff\xff\xff"],
        message_of(None, []),
        message_of([], 3),
        message_of([], [["body", "world"]], b"x"),
        message_of([], [["telepathy", "world", 1]], b"x"),
        message_of([], [[["body"], "world", 1]], b"x"),
        message_of([], [["body", 7, 1]], b"x"),
        message_of([], [["body", "world", 0]], b"x"),
        message_of([], [["body", "world", -1]], b"x"),
        message_of([], [["body", "world", 2]], b"x"),
        message_of([], [["body", "world", 1.0]], b"x"),
    ],
)
def test_what_is_no_bundle_is_refused(message: list[bytes]) -> None:
    with pytest.raises(FrameError):
        unpack_parcels(message)


@pytest.mark.parametrize(
    "meta", [[], [1.0], [1, None, 0], ["now", None, 0], [0.5, None, "x"], [0.5, None, None]]
)
def test_a_bundle_without_its_time_is_refused(meta: list[Any]) -> None:
    with pytest.raises(FrameError):
        unpack_bundle("robot1", message_of(meta, []))


@given(st.lists(st.binary(max_size=40), max_size=5))
@settings(deadline=None)
def test_random_bytes_are_refused(message: list[bytes]) -> None:
    with pytest.raises(FrameError):
        unpack_parcels([DONE, b"\xff", *message])
    try:
        unpack_parcels(message)
    except FrameError as error:
        assert str(error)
