"""When the exploration is over, or cannot go on."""

from __future__ import annotations

from server.assignment import Assignment
from server.executive_settings import ExecutiveSettings
from server.pool import Member, Pool


def nothing_left(
    pool: Pool,
    assignment: Assignment,
    map_changed: float,
    settings: ExecutiveSettings,
    now: float,
) -> bool:
    """Return whether nothing useful is left, by bids that can be trusted to be up to date.

    A visit under way is waited for.

    At least one robot of the pool must have bid. All of them are waited for, but none for ever: one
    that never bids, or whose bids stopped, is left out of account in the end.

    Args:
        pool: the robots.
        assignment: knows since when there has been nothing to explore.
        map_changed: when the map last changed [s].
        settings: see `ExecutiveSettings`.
        now: mission time [s].
    """
    since = assignment.nothing_since
    if since is None or now < since + settings.settle_s:
        return False
    if any(member.live and member.mode == "visit" for member in pool):
        return False
    members = pool.fit(now)
    heard = [m for m in members if m.bid is not None and m.lag(now) <= settings.bid_patience_s]
    if not heard:
        return False
    quiet = now >= map_changed + settings.settle_s
    # While idle robots drive about, the map keeps changing a little and bids are always somewhat
    # behind. If that has gone on for long without anything turning up, nothing will.
    lenient = quiet or now >= since + 2.0 * settings.settle_s
    return all(_spoke(member, lenient, settings, now) for member in members)


def _spoke(member: Member, lenient: bool, settings: ExecutiveSettings, now: float) -> bool:
    """Whether a robot's word is in, or not waited for any longer."""
    if member.lag(now) > settings.bid_patience_s:
        return True
    return member.bid is not None and (lenient or member.behind_since is None)


def stalled(pool: Pool, settings: ExecutiveSettings, now: float) -> str | None:
    """Return why no robot can explore at present, or None if one can or an operator holds one."""
    members = list(pool)
    live = [member for member in members if member.live]
    if not members:
        return "no robot has joined"
    if not live:
        return "every robot is lost"
    if any(member.mode != "pool" for member in live):
        return None
    fit = pool.fit(now)
    if not fit:
        return "every robot that is heard is left out: its tasks expired without progress"
    if all(member.lag(now) > settings.bid_patience_s for member in fit):
        return "no robot bids"
    return None
