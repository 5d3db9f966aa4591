"""A robot that is one of the team, and tells what cannot be from some time on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mapping.geometry import Pose2
from protocol.effects import Core, Effect, Event, Send
from protocol.log.messages import Observations
from protocol.messages import Message
from protocol.peer_messages import Beacon


def impossible_poses(message: Message) -> Message:
    """Its observations were made thousands of kilometres away."""
    if not isinstance(message, Observations):
        return message
    return message.model_copy(update={"poses": np.full_like(message.poses, 2_000_000_000)})


def nonsense_payloads(message: Message) -> Message:
    """What it observed decodes to nothing."""
    if not isinstance(message, Observations):
        return message
    return message.model_copy(update={"data": np.bitwise_xor(message.data, np.uint8(0xA5))})


def numbers_without_order(message: Message) -> Message:
    """The numbers of its entries fall, and leap."""
    if not isinstance(message, Observations):
        return message
    numbers = tuple(60_000 + 7_919 * number for number in reversed(message.numbers))
    return message.model_copy(update={"numbers": numbers})


def another_name(message: Message) -> Message:
    """It tells what it saw as what `robot1` saw."""
    if not isinstance(message, Observations) or message.author is not None:
        return message
    return message.model_copy(update={"author": "robot1"})


def no_numbers(message: Message) -> Message:
    """It is beyond all reach: its frames cannot even be read."""
    if not isinstance(message, Beacon):
        return message
    return message.model_copy(update={"T_map_base": Pose2(1e8, 0.0, 0.0)})


LIES: tuple[Callable[[Message], Message], ...] = (
    impossible_poses,
    nonsense_payloads,
    numbers_without_order,
    another_name,
    no_numbers,
)


@dataclass(slots=True)
class Hostile:
    """A core whose words by radio are twisted from a mission time on."""

    core: Core
    lie: Callable[[Message], Message]
    since: float

    def next_deadline(self) -> float | None:
        return self.core.next_deadline()

    def handle(self, event: Event, now: float) -> list[Effect]:
        return self._twisted(self.core.handle(event, now), now)

    def tick(self, now: float) -> list[Effect]:
        return self._twisted(self.core.tick(now), now)

    def _twisted(self, effects: list[Effect], now: float) -> list[Effect]:
        if now < self.since:
            return effects
        return [
            Send(effect.channel, effect.to, self.lie(effect.message))
            if isinstance(effect, Send) and effect.channel == "radio"
            else effect
            for effect in effects
        ]
