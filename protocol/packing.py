"""Whole numbers in as few bytes as they need, one behind the other, and messages made of them.

A number takes seven bits a byte, the lowest first; the eighth says that another byte follows. A
signed one is told as 0, -1, 1, -2, 2 ... by 0, 1, 2, 3, 4 ...
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Self

from protocol.messages import Message

_LARGEST = 2**63


class PackedMessage(Message):
    """Base of messages whose fields travel as one byte string, for those that fill the air.

    What a later minor version adds goes beside it by name, as in all other messages.
    """

    def packed(self) -> bytes:
        """Return all fields as bytes."""
        raise NotImplementedError

    @classmethod
    def unpacked(cls, data: bytes) -> dict[str, object]:
        """Return the fields, not validated yet, that `packed` made these bytes of.

        Raises:
            ValueError: no message was packed so.
        """
        raise NotImplementedError


class Packer:
    """Puts numbers and texts one behind the other."""

    def __init__(self) -> None:
        self._data = bytearray()

    def number(self, value: int) -> Self:
        """Put a number that is not negative."""
        while value > 0x7F:
            self._data.append(value & 0x7F | 0x80)
            value >>= 7
        self._data.append(value)
        return self

    def signed(self, value: int) -> Self:
        """Put any number."""
        return self.number(2 * value if value >= 0 else -2 * value - 1)

    def numbers(self, values: Sequence[int]) -> Self:
        """Put how many there are, and the numbers."""
        self.number(len(values))
        for value in values:
            self.number(value)
        return self

    def steps(self, values: Iterable[int]) -> Self:
        """Put by how much each of some numbers differs from the one before it."""
        before = 0
        for value in values:
            self.signed(value - before)
            before = value
        return self

    def text(self, value: str) -> Self:
        """Put a text."""
        data = value.encode()
        self.number(len(data))
        return self.raw(data)

    def raw(self, data: bytes) -> Self:
        """Put bytes as they are."""
        self._data += data
        return self

    def data(self) -> bytes:
        """Return all that was put."""
        return bytes(self._data)


class Unpacker:
    """Takes out what a `Packer` put in, in the same order.

    All methods raise ValueError where the bytes end too soon, or hold what nobody puts there.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def number(self) -> int:
        """Take a number that is not negative."""
        value, shift = 0, 0
        while True:
            byte = self.raw(1)[0]
            value |= (byte & 0x7F) << shift
            if value >= _LARGEST:
                raise ValueError("a packed number beyond all reason")
            if byte <= 0x7F:
                return value
            shift += 7

    def signed(self) -> int:
        """Take any number."""
        value = self.number()
        return -(value + 1) // 2 if value & 1 else value // 2

    def count(self, most: int) -> int:
        """Take how many of something follow, at most so many."""
        value = self.number()
        if value > most:
            raise ValueError(f"{value} packed together, at most {most} are accepted")
        return value

    def numbers(self, most: int) -> tuple[int, ...]:
        """Take numbers, at most so many."""
        return tuple(self.number() for _ in range(self.count(most)))

    def steps(self, count: int) -> list[int]:
        """Take so many numbers that were told as steps."""
        values, value = [], 0
        for _ in range(count):
            value += self.signed()
            values.append(value)
        return values

    def text(self) -> str:
        """Take a text."""
        return self.raw(self.number()).decode()

    def raw(self, count: int) -> bytes:
        """Take so many bytes."""
        data = self._data[self._at : self._at + count]
        if len(data) < count:
            raise ValueError("packed bytes that end too soon")
        self._at += count
        return data

    def rest(self) -> bytes:
        """Take all that is left."""
        return self.raw(len(self._data) - self._at)

    def end(self) -> None:
        """Check that nothing is left."""
        if self._at < len(self._data):
            raise ValueError("packed bytes that go on")
