"""Settings of the observation log's synchronisation."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from protocol.fields import NotNegative, Positive

Least1 = Annotated[int, Field(ge=1)]


class LogSyncSettings(BaseModel):
    """How robots keep their logs the same, and what they take from whom.

    Telling: new observations are collected for `batch_period_s`, or until none came for `quiet_s`,
    and broadcast in frames of about `frame_bytes`; new poses, if one moved by `revision_large_m`,
    wait no longer than `revision_delay_s`. All that waits while nobody was heard in the last
    `reached_s`, but no longer than `unheard_s`. All but such poses also wait, for `missed_s` at
    most, for a moment at which everybody was just heard who was within `missed_s`: in the last
    `fresh_s`, and somewhat longer ago the longer they wait, but within `reached_s`. While somebody
    does not know its place what others saw is told within `hurried_s`.

    Announcing: what a robot holds is broadcast every `announce_period_s` while something changes,
    ever more rarely to `announce_period_max_s` when nothing does, and at once when a peer is heard
    that was away: not heard for `away_s`.

    Asking: with `request_many` or more entries missing a robot asks at once, else it collects what
    it lacks for `request_patience_s`. It has no more than `request_entries` asked for at a time,
    and asks again, somebody else, after `request_timeout_s`, which grows with every attempt to
    `backoff_max_s`.

    Answering: after `answer_delay_s`, in which others may ask for the same, and with no more than
    `answer_bytes_s`. What `broadcast_from` or more peers want is broadcast.

    Limits: poses within `reach_m`; `payload_bytes_most` of an entry; of an author
    `author_entries_most` entries and `author_bytes_most`, and numbers no more than
    `window_entries` after the first gap; `authors_most` authors, `lives_most` of them of one robot.
    A peer with `faults_to_isolate` faults within `faults_window_s` is isolated.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    batch_period_s: Positive = 2.0
    quiet_s: Positive = 5.0
    revision_delay_s: NotNegative = 0.2
    revision_large_m: NotNegative = 0.05
    reached_s: Positive = 1.5
    fresh_s: Positive = 0.3
    hurried_s: NotNegative = 2.0
    missed_s: Positive = 20.0
    unheard_s: NotNegative = 300.0
    frame_bytes: Annotated[int, Field(ge=256, le=60_000)] = 4000
    announce_period_s: Positive = 5.0
    announce_period_max_s: Positive = 40.0
    away_s: Positive = 10.0
    request_many: Least1 = 16
    request_patience_s: Positive = 4.0
    request_entries: Annotated[int, Field(ge=1, le=256)] = 256
    request_timeout_s: Positive = 2.0
    backoff_max_s: Positive = 10.0
    answer_delay_s: Positive = 0.5
    answer_bytes_s: Positive = 20_000.0
    broadcast_from: Annotated[int, Field(ge=1)] = 2
    reach_m: Positive = 10_000.0
    payload_bytes_most: Annotated[int, Field(ge=1, le=60_000)] = 8192
    author_entries_most: Least1 = 65_536
    author_bytes_most: Least1 = 32_000_000
    window_entries: Least1 = 4096
    authors_most: Annotated[int, Field(ge=1, le=64)] = 64
    lives_most: Least1 = 16
    faults_to_isolate: Least1 = 5
    faults_window_s: Positive = 60.0
