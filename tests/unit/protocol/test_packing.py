from __future__ import annotations

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.codec import decode, encode
from protocol.errors import MessageError
from protocol.packing import PackedMessage, Packer, Unpacker
from tests.unit.protocol.samples import examples, header_of

PACKED = {name: each for name, each in examples().items() if isinstance(each, PackedMessage)}


@given(st.integers(0, 2**63 - 1), st.integers(-(2**62), 2**62 - 1), st.text(), st.binary())
def test_what_was_put_in_comes_out(number: int, signed: int, text: str, data: bytes) -> None:
    packer = Packer().number(number).signed(signed).text(text).raw(data)
    unpacker = Unpacker(packer.data())
    assert (unpacker.number(), unpacker.signed(), unpacker.text()) == (number, signed, text)
    assert unpacker.rest() == data
    unpacker.end()


@given(st.lists(st.integers(0, 2**31)))
def test_lists_come_out_as_they_were(values: list[int]) -> None:
    unpacker = Unpacker(Packer().numbers(values).steps(values).data())
    assert unpacker.numbers(len(values)) == tuple(values)
    assert unpacker.steps(len(values)) == values


def test_small_numbers_are_short() -> None:
    assert Packer().number(127).data() == b"\x7f"
    assert Packer().signed(-1).signed(63).signed(-64).data() == b"\x01\x7e\x7f"
    assert len(Packer().steps([1000, 1001, 1002]).data()) == 4


def test_bytes_that_nobody_packs_are_refused() -> None:
    with pytest.raises(ValueError, match="too soon"):
        Unpacker(b"\x80").number()
    with pytest.raises(ValueError, match="reason"):
        Unpacker(b"\xff" * 20).number()
    with pytest.raises(ValueError, match="at most 2"):
        Unpacker(b"\x03").count(2)
    with pytest.raises(ValueError, match="too soon"):
        Unpacker(b"\x05ab").text()
    with pytest.raises(ValueError, match="go on"):
        Unpacker(b"a").end()


@pytest.mark.parametrize("name", sorted(PACKED))
def test_any_cut_of_a_packed_message_is_refused_or_read(name: str) -> None:
    header, body = encode(header_of(PACKED[name]), PACKED[name])
    data = msgpack.unpackb(body)["~"]
    for end in range(len(data)):
        try:
            decode([header, msgpack.packb({"~": data[:end]})])
        except MessageError:
            continue


@pytest.mark.parametrize("name", sorted(PACKED))
@given(data=st.binary(max_size=80))
def test_any_bytes_are_refused_or_read(name: str, data: bytes) -> None:
    header, _ = encode(header_of(PACKED[name]), PACKED[name])
    try:
        decode([header, msgpack.packb({"~": data})])
    except MessageError:
        return


@pytest.mark.parametrize("name", sorted(PACKED))
def test_what_is_not_packed_is_refused_and_what_came_later_ignored(name: str) -> None:
    header, body = encode(header_of(PACKED[name]), PACKED[name])
    later = msgpack.packb({**msgpack.unpackb(body), "wings": 2})
    assert decode([header, later])[1].type == name
    for wrong in ([header, msgpack.packb({})], [header, body, b"array"]):
        with pytest.raises(MessageError, match="not packed"):
            decode(wrong)


def test_the_base_packs_nothing() -> None:
    base = PackedMessage(type="base")
    with pytest.raises(NotImplementedError):
        base.packed()
    with pytest.raises(NotImplementedError):
        base.unpacked(b"")
