"""The task executive: assigns tasks to robots and sees them through.

Robots bid; after a short while, in case more bids arrive, the strategy assigns places to the robots
that are idle or have sent new bids. The executive monitors every task by a lease, offers again what
failed, gives up what failed too often, interleaves an operator's wishes, sends idle robots to
places where they wait well, and knows when nothing is left to explore.

It computes only: the clock is handed in as `now` (mission seconds), messages are handed back.

Source: Simmons et al. 2000, section "Assigning Tasks".
"""

from __future__ import annotations

import math

from coordination.bid import RobotBid
from coordination.strategy import Strategy
from coordination.task import Task, TaskState
from coordination.task_node import Leaf
from coordination.tried_places import TriedPlaces
from mapping.geometry import Pose2
from protocol.body import Body
from protocol.effects import Send
from server.assignment import Assignment
from server.ending import nothing_left, stalled
from server.executive_settings import ExecutiveSettings
from server.invariants import check
from server.operator_words import OperatorWords, Reply
from server.pool import Member, Pool
from server.remaining import remaining
from server.waiting import ChooseWaitingPlaces, Waiting
from server.work import UNREACHABLE, Happening, Work


class TaskExecutive:
    """Assigns tasks and sees them through.

    Every method that takes an event returns the messages to be sent. `contact` must be called for
    every message of a robot that has no method of its own here: any traffic is a sign of life.
    """

    def __init__(
        self,
        settings: ExecutiveSettings,
        strategy: Strategy,
        choose_waiting_places: ChooseWaitingPlaces | None = None,
        strategy_name: str = "",
    ) -> None:
        """Make an executive without robots.

        Args:
            settings: see `ExecutiveSettings`.
            strategy: decides who explores what.
            choose_waiting_places: see `server.waiting`; None leaves idle robots where they are.
            strategy_name: what it is called, for people.
        """
        self.strategy_name = strategy_name
        self._settings = settings
        self._strategy = strategy
        self._pool = Pool()
        self._work = Work(settings)
        self._tried = TriedPlaces(settings.give_up_radius_m, settings.max_tries)
        self._assignment = Assignment(settings, strategy, self._pool, self._work, self._tried)
        self._operator = OperatorWords(settings, self._pool, self._work)
        self._waiting = Waiting(
            settings,
            self._pool,
            self._work,
            self._tried,
            strategy.min_gain,
            choose_waiting_places,
        )
        self._map_number = 0
        self._map_changed = -math.inf
        self._round_at: float | None = None

    # --- robots ------------------------------------------------------------------------------

    def robot_joined(self, robot: str, body: Body, now: float) -> list[Send]:
        """Take a robot in, or take it in again after its process began anew.

        A robot that an operator paused or drove stays out of the pool even so.
        """
        before = self._pool.get(robot)
        if before is not None:
            self._work.take_back(before, "the robot began anew", now)
        node = self._work.new_robot(robot, now) if before is None else before.node
        member = Member(robot, body, node, joined=now, heard=now, idle_since=now)
        self._pool.add(member)
        self._work.note(now, "joined", robot)
        if before is not None and before.mode in ("pause", "drive"):
            self._operator.pause(robot, now)
        return self._round_for_idle(now)

    def robot_lost(self, robot: str, now: float) -> list[Send]:
        """Note that a robot is gone: its task is free for others at once."""
        member = self._pool.get(robot)
        if member is not None and member.live:
            self._lose(member, "gone", now)
            return self._round_for_idle(now)
        return []

    def robot_back(self, robot: str, now: float) -> list[Send]:
        """Note that a lost robot is heard again."""
        return self.contact(robot, now)

    def contact(self, robot: str, now: float, T_map_base: Pose2 | None = None) -> list[Send]:
        """Note that a robot was heard, and where it is if that is known."""
        member = self._pool.get(robot)
        if member is None:
            return []
        if T_map_base is not None:
            member.place = (T_map_base.x, T_map_base.y)
        member.heard = max(member.heard, now)
        self._work.contact(member, now)
        if member.live:
            return []
        member.live = True
        self._work.note(now, "back", robot)
        if member.mode == "pause":
            self._operator.renew_pause(member, now)
        elif member.mode == "pool":
            member.rejoin(now)
        return self._round_for_idle(now)

    def bid(self, bid: RobotBid, now: float) -> list[Send]:
        """Take a robot's bid; one older than what is known is ignored."""
        sends = self.contact(bid.robot, now, bid.T_map_base)
        member = self._pool.get(bid.robot)
        if member is None or (member.bid is not None and bid.number <= member.bid.number):
            return sends
        member.bid = bid
        member.bid_is_new = True
        if bid.map_number >= self._map_number:
            member.behind_since = None
        if self._round_at is None:
            self._round_at = now + self._settings.bid_wait_s
        return sends

    # --- tasks -------------------------------------------------------------------------------

    def progress(self, robot: str, task: int, remaining_m: float, now: float) -> list[Send]:
        """Note that a robot is at work on a task with so much way left [m]."""
        sends = self.contact(robot, now)
        member = self._pool.get(robot)
        if member is not None:
            leaf = self._own(member, task)
            if leaf is not None and self._work.progress(leaf, remaining_m, now):
                member.expiries = 0
        return sends + self._work.flush()

    def task_ended(
        self, robot: str, task: int, outcome: str, reason: str, now: float
    ) -> list[Send]:
        """Note that a robot is through with a task: `done`, `unreachable` or `failed`."""
        sends = self.contact(robot, now)
        member = self._pool.get(robot)
        leaf = None if member is None else self._own(member, task)
        if member is None or leaf is None:
            return sends + self._work.flush()
        member.expiries = 0
        if outcome == "done":
            self._assignment.done(member, leaf, now)
        else:
            why = UNREACHABLE if outcome == "unreachable" else "failed"
            leaf.failed(f"{why}: {reason}" if reason else why, now)
        return sends + self._round_for_idle(now)

    def map_changed(self, map_number: int, now: float) -> list[Send]:
        """Note that the team's map has a new number; bids on older ones lag behind from now on."""
        if map_number > self._map_number:
            self._map_number = map_number
            self._map_changed = now
            for member in self._pool:
                behind = member.bid is not None and member.bid.map_number < map_number
                if behind and member.behind_since is None:
                    member.behind_since = now
        return []

    # --- operators ---------------------------------------------------------------------------

    def visit(self, robot: str, x: float, y: float, now: float) -> Reply:
        """Have a robot visit a place [m], map frame; the others cover for it meanwhile."""
        return self._reply(self._operator.visit(robot, (x, y), now), now)

    def pause(self, robot: str, now: float) -> Reply:
        """Halt a robot; the others cover for it."""
        return self._reply(self._operator.pause(robot, now), now)

    def resume(self, robot: str, now: float) -> Reply:
        """Give a robot back to the team after a pause, a visit or a drive."""
        return self._reply(self._operator.resume(robot, now), now)

    def drive(self, robot: str, speed: float, turn_rate: float, now: float) -> Reply:
        """Drive a robot by hand [m/s, rad/s]; it stays out of the pool until it is resumed."""
        return self._reply(self._operator.drive(robot, speed, turn_rate, now), now)

    # --- time --------------------------------------------------------------------------------

    def tick(self, now: float) -> list[Send]:
        """Do what is due."""
        before = len(self._work.happenings)
        for member in self._pool:
            if member.live and now >= member.heard + self._settings.silence_s:
                self._lose(member, f"silent for {now - member.heard:.0f} s", now)
        self._work.tick(now)
        wake_at = self._assignment.wake_at
        if self._round_at is not None and now >= self._round_at:
            self._round_at = None
            self._assignment.hold(now)
        elif len(self._work.happenings) > before or (wake_at is not None and now >= wake_at):
            self._assignment.hold(now, idle_only=True)
        self._waiting.tick(now)
        return self._work.flush()

    def next_deadline(self) -> float | None:
        """Return when `tick` is due next [s], or None."""
        silences = [m.heard + self._settings.silence_s for m in self._pool if m.live]
        due = [
            self._round_at,
            self._work.next_deadline(),
            self._assignment.wake_at,
            self._waiting.due(),
        ]
        return min([*silences, *(time for time in due if time is not None)], default=None)

    # --- the end and the record --------------------------------------------------------------

    def exhausted(self, now: float) -> bool:
        """Whether nothing useful is left to explore: the mission is over."""
        if self._round_at is not None:
            return False
        return nothing_left(self._pool, self._assignment, self._map_changed, self._settings, now)

    def stalled(self, now: float) -> str | None:
        """Return why no robot can explore at all at present, or None if one can."""
        return stalled(self._pool, self._settings, now)

    def remaining(self) -> list[dict[str, object]]:
        """Return the places left: x_m, y_m, gain_m2, reason; see `server.remaining`."""
        return remaining(self._pool, self._tried, self._strategy.min_gain)

    def busy(self, robot: str) -> bool:
        """Whether a robot drives for a task (and is neither paused nor only waiting)."""
        member = self._pool.get(robot)
        task = None if member is None else member.task
        return task is not None and task.kind not in ("pause", "wait")

    def free(self, robot: str, now: float) -> bool:
        """Whether a robot of the team has nothing to do but wait."""
        member = self._pool.get(robot)
        return member is not None and member.fit(now) and not self.busy(robot)

    def mode(self, robot: str) -> str:
        """Return whose a robot is: `pool`, `visit`, `drive`, `pause`, `lost` or `unknown`."""
        member = self._pool.get(robot)
        if member is None:
            return "unknown"
        return member.mode if member.live else "lost"

    def tasks(self) -> list[Task]:
        """Return the tasks under way, oldest first."""
        return self._work.live_tasks()

    @property
    def happenings(self) -> list[Happening]:
        """Everything that happened: t_s, event, robot, task, kind, goal, reason; oldest first."""
        return self._work.happenings

    def check_invariants(self) -> None:
        """Check what must hold between any two events; for tests.

        Raises:
            AssertionError: it does not.
        """
        check(self._pool, self._work)

    # --- steps -------------------------------------------------------------------------------

    def _own(self, member: Member, task: int) -> Leaf | None:
        """Return a robot's task if it is the one it speaks of.

        A robot without a task is told that it has none. One with an award under way gets that
        again anyhow.
        """
        leaf = member.leaf
        if leaf is not None and leaf.task.id == task:
            return leaf
        if leaf is None or leaf.task.state is TaskState.ACTIVE:
            self._work.dismiss(member.name, task)
        return None

    def _lose(self, member: Member, reason: str, now: float) -> None:
        member.live = False
        self._work.note(now, "lost", member.name, reason=reason)
        self._work.expire(member, f"the robot is lost: {reason}", now)

    def _round_for_idle(self, now: float) -> list[Send]:
        self._assignment.hold(now, idle_only=True)
        return self._work.flush()

    def _reply(self, answer: tuple[bool, str], now: float) -> Reply:
        accepted, text = answer
        return Reply(accepted, text, self._round_for_idle(now))
