"""Settings of the radio links of the simulated world."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from mapping.geometry import Pose2
from protocol.fields import Coordinate, Finite, Name, NotNegative, Positive

Probability = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]
Group = Annotated[tuple[Name, ...], Field(min_length=1)]


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Partition(_Settings):
    """A time in which groups of the team do not hear each other.

    Attributes:
        start_s: mission time at which it begins.
        duration_s: how long it lasts.
        groups: names of robots, or `server`, as a list of lists. Who is in none of them is in one
            more group with all the others left over.
    """

    start_s: NotNegative
    duration_s: Positive
    groups: Annotated[tuple[Group, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _check_groups(self) -> Partition:
        names = [name for group in self.groups for name in group]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"{name!r} stands twice in the groups: leave it in one of them")
        return self


class OneWay(_Settings):
    """A link that carries frames in one direction only.

    Attributes:
        speaker: whose frames pass.
        listener: whose frames to the speaker are lost.
    """

    speaker: Name
    listener: Name

    @model_validator(mode="after")
    def _check_ends(self) -> OneWay:
        if self.speaker == self.listener:
            raise ValueError(f"{self.speaker!r} is both ends of the link: name two members")
        return self


class RadioSettings(_Settings):
    """The radio links among the robots, and between robots and server.

    As it stands everything is delivered at the next instant. `model` says who is in reach of whom;
    all the rest holds for each model. The channel is one, shared by all; see
    docs/decisions/0025.

    The defaults of `path_loss` are those of 2.4 GHz indoors: 15 dBm and -82 dBm are a usual card of
    IEEE 802.11b at 11 Mbit/s; 40 dB is the loss in free space over the first metre; 3 is the
    exponent of an office with hard partitions (Rappaport 2002, table 4.6); each wall takes 3.1 dB,
    and no more than four do (Bahl & Padmanabhan 2000, wall attenuation factor); where walls are
    counted the rest scatters by about 4 dB (Seidel & Rappaport 1992). Together, without fading, a
    frame gets 79 m far in the open and 30 m through four walls or more.

    Attributes:
        model: `perfect`: everybody is in reach; `disc`: whoever is within `range_m`; `path_loss`:
            whoever receives at least `receiver_floor_dbm`.
        server_place: where the server's antenna stands: `first_start`, at the first robot's start,
            where people carry the robots in; (x, y) in the world's metres; or `wired`: the server
            has no antenna, and its links with the robots are perfect whatever else is set.
        range_m: reach of `disc`.
        tx_power_dbm: transmit power.
        reference_loss_db: loss over the first metre.
        path_loss_exponent: the loss grows by ten times this [dB] when the distance grows tenfold.
        wall_loss_db: loss of each wall that the straight line crosses; every solid body counts.
        walls_max: walls beyond so many take nothing more: the signal finds ways around.
        fading_sigma_db: standard deviation of the log-normal fading. It depends on the two places
            and the seed alone: between the same places it is the same at all times.
        fading_cell_m: places in the same cell of this size share it.
        receiver_floor_dbm: the weakest signal that is received.
        capacity_bit_s: of the one channel, shared by all who send; without end when not set.
        turn_bytes: a long frame goes in packets of so many bytes; others have their turn between.
        queue_max_bytes: what a radio may hold that waits for the channel; a frame beyond that is
            lost, unless nothing else waits.
        latency_s: from the end of sending to arrival.
        jitter_s: up to so much more, uniform; frames of one link keep their order.
        loss: probability that a receiver does not get a frame.
        duplication: probability that it gets the frame once more, at once or by the jitter later.
        reordering: probability that a frame is held back for up to `reordering_delay_s` while those
            behind it pass.
        reordering_delay_s: see `reordering`.
        partitions: scheduled partitions of the team.
        one_way: links that carry frames in one direction only.
    """

    model: Literal["perfect", "disc", "path_loss"] = "perfect"
    server_place: Literal["first_start", "wired"] | tuple[Coordinate, Coordinate] = "first_start"
    range_m: Positive = 30.0
    tx_power_dbm: Finite = 15.0
    reference_loss_db: Finite = 40.0
    path_loss_exponent: Positive = 3.0
    wall_loss_db: NotNegative = 3.1
    walls_max: Annotated[int, Field(ge=0)] = 4
    fading_sigma_db: NotNegative = 4.0
    fading_cell_m: Positive = 1.0
    receiver_floor_dbm: Finite = -82.0
    capacity_bit_s: Positive | None = None
    turn_bytes: Annotated[int, Field(ge=1)] = 1500
    queue_max_bytes: Annotated[int, Field(ge=1)] = 100_000
    latency_s: NotNegative = 0.0
    jitter_s: NotNegative = 0.0
    loss: Probability = 0.0
    duplication: Probability = 0.0
    reordering: Probability = 0.0
    reordering_delay_s: Positive = 0.5
    partitions: tuple[Partition, ...] = ()
    one_way: tuple[OneWay, ...] = ()

    @field_validator("server_place", mode="before")
    @classmethod
    def _check_place(cls, value: object) -> object:
        if value in ("first_start", "wired") or (
            isinstance(value, list | tuple) and len(value) == 2
        ):
            return value
        raise ValueError(f"{value!r} is no place: write 'first_start', 'wired' or [x, y] in metres")

    @property
    def at_once(self) -> bool:
        """Whether every frame arrives at the instant at which it is sent, or never."""
        late = self.latency_s or self.jitter_s or self.duplication or self.reordering
        return self.model == "perfect" and self.capacity_bit_s is None and not late

    def antenna(self, T_world_start: Pose2) -> tuple[float, float]:
        """Return where the server's antenna stands, (x, y) [m], world frame.

        Args:
            T_world_start: where the first robot starts.
        """
        if isinstance(self.server_place, str):
            return T_world_start.x, T_world_start.y
        return self.server_place

    def names(self) -> tuple[str, ...]:
        """Return every member that a setting names, in order."""
        parted = [name for p in self.partitions for group in p.groups for name in group]
        return (*parted, *(name for link in self.one_way for name in (link.speaker, link.listener)))
