"""The tasks under way: awarding them, sending awards again, keeping their leases, ending them.

All tasks hang in one tree: the mission runs one node per robot side by side, and each robot's node
holds what that robot is at. Messages to robots gather in an outbox.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from coordination.lease import Lease, LeaseTerms
from coordination.task import Kind, Point, Rectangle, Task, TaskState
from coordination.task_node import Leaf, Mend
from coordination.task_tree import Parallel
from protocol.effects import Send
from protocol.messages import Award, Terminate
from server.executive_settings import ExecutiveSettings
from server.pool import Member

FLEET = "fleet"

# A paused robot stays where it is until somebody says otherwise, also if it hears nothing [s].
PAUSE_LEASE = 86400.0
# A robot that waits has arrived when it is this near to its place [m].
WAIT_ARRIVED = 0.5
# A pause, or a drive by hand, has no way that could shrink [m].
NO_WAY = 1.0e9

# What the reason begins with when a robot finds no way to a place.
UNREACHABLE = "unreachable"

Happening = dict[str, object]


@dataclass(slots=True)
class _Commission:
    """What belongs to a live task: the lease, the award to send again, and when [s]."""

    leaf: Leaf
    lease: Lease
    award: Award
    resend_at: float
    pause: float


class Work:
    """The tasks under way.

    Attributes:
        mission: the root of the task tree.
        happenings: everything that happened to tasks and robots, oldest first, for the report.
    """

    def __init__(self, settings: ExecutiveSettings, now: float = 0.0) -> None:
        self.mission = Parallel("mission", is_open=True)
        self.mission.start(now)
        self.happenings: list[Happening] = []
        self._settings = settings
        self._commissions: dict[int, _Commission] = {}
        self._outbox: list[Send] = []
        self._count = 0
        # By robot: when it was last taken off an exploring task, that one's goal, and its lease.
        self._left: dict[str, tuple[float, Point, Lease]] = {}

    def new_robot(self, name: str, now: float) -> Parallel:
        """Return a node in the tree for a robot that joined."""
        node = Parallel(f"robot {name}", is_open=True)
        self.mission.add(node, now)
        return node

    def note(
        self, now: float, event: str, robot: str, task: Task | None = None, reason: str = ""
    ) -> None:
        """Put something on record."""
        self.happenings.append(
            {
                "t_s": now,
                "event": event,
                "robot": robot,
                "task": None if task is None else task.id,
                "kind": None if task is None else task.kind,
                "goal": None if task is None else list(task.goal),
                "gain_m2": None if task is None else round(task.gain, 2),
                "cost_m": None if task is None else round(task.cost, 2),
                "reason": reason,
            }
        )

    def leaf(
        self,
        robot: str,
        kind: Kind,
        goal: Point,
        on_failure: Mend | None = None,
        *,
        rectangle: Rectangle | None = None,
        gain: float = 0.0,
        cost: float = 0.0,
        speed: float = 0.0,
        turn_rate: float = 0.0,
    ) -> Leaf:
        """Return a new task as a leaf; it is awarded when the tree starts the leaf.

        Args:
            robot: who is to do it.
            kind: what it is.
            goal: (x, y) [m], map frame.
            on_failure: see `coordination.task_tree.Node`.
            rectangle: around the information gain region [m], map frame.
            gain: expected information [m2].
            cost: path length [m].
            speed: for a drive by hand [m/s].
            turn_rate: for a drive by hand [rad/s].
        """
        self._count += 1
        task = Task(self._count, kind, robot, goal, rectangle, gain, cost)

        def award(task: Task, now: float) -> None:
            self._award(leaf, lease_length, speed, turn_rate, now)

        lease_length = self._lease_length(kind)
        leaf = Leaf(task, award, self._ended, self._monitor(task.id), on_failure)
        return leaf

    def take_back(self, member: Member, reason: str, now: float) -> None:
        """Take back whatever a robot is at."""
        for child in tuple(member.node.children):
            child.terminate(reason, now)

    def expire(self, member: Member, reason: str, now: float) -> None:
        """Let whatever a robot is at expire."""
        for leaf in tuple(member.node.leaves()):
            leaf.expire(reason, now)

    def contact(self, member: Member, now: float) -> None:
        """Note that a robot was heard."""
        leaf = member.leaf
        if leaf is not None:
            self._commissions[leaf.task.id].lease.contact(now)

    def progress(self, leaf: Leaf, remaining: float, now: float) -> bool:
        """Note the way left of a live task [m]; return whether it has become shorter."""
        if leaf.task.state is TaskState.AWARDED:
            self.note(now, "active", leaf.task.robot, leaf.task)
        leaf.progressed()
        commission = self._commissions[leaf.task.id]
        commission.pause = self._settings.resend_s
        commission.resend_at = now + self._settings.probe_s
        return commission.lease.progress(remaining, now)

    def drive_on(self, leaf: Leaf, speed: float, turn_rate: float, now: float) -> None:
        """Change the speeds [m/s, rad/s] of a drive by hand under way, and let it run on."""
        commission = self._commissions[leaf.task.id]
        commission.award = commission.award.model_copy(
            update={"speed_m_s": speed, "turn_rate_rad_s": turn_rate}
        )
        commission.lease.renew(now)
        self._send(leaf.task.robot, commission.award)

    def dismiss(self, robot: str, task: int) -> None:
        """Tell a robot that a task it reports on is not its own any more."""
        self._send(robot, Terminate(task=task))

    def tick(self, now: float) -> None:
        """Let leases run out, and send awards of which nothing is heard again.

        A robot that never got it learns of it; one that ended the task, whose word was lost, tells
        again; one that is at it goes on.
        """
        self.mission.check(now)
        for commission in tuple(self._commissions.values()):
            if now >= commission.resend_at:
                self._resend(commission, now)

    def next_deadline(self) -> float | None:
        """Return when `tick` is due [s]."""
        times = [min(c.lease.deadline, c.resend_at) for c in self._commissions.values()]
        return min(times, default=None)

    def flush(self) -> list[Send]:
        """Return what is to be sent, and forget it.

        An award replaces whatever a robot is at, so a termination just before one is left out: the
        robot need not brake in between.
        """
        sends, self._outbox = self._outbox, []
        last_award = {s.to: k for k, s in enumerate(sends) if isinstance(s.message, Award)}
        return [
            send
            for k, send in enumerate(sends)
            if not (isinstance(send.message, Terminate) and k < last_award.get(send.to, -1))
        ]

    def live_tasks(self) -> list[Task]:
        """Return the tasks under way."""
        return [commission.leaf.task for commission in self._commissions.values()]

    def _resend(self, commission: _Commission, now: float) -> None:
        commission.pause = min(2.0 * commission.pause, self._settings.resend_longest_s)
        commission.resend_at = now + commission.pause
        self._send(commission.leaf.task.robot, commission.award)

    def _send(self, robot: str, message: Award | Terminate) -> None:
        self._outbox.append(Send(FLEET, robot, message))

    def _award(
        self, leaf: Leaf, lease_length: float, speed: float, turn_rate: float, now: float
    ) -> None:
        task, settings = leaf.task, self._settings
        message = Award(
            task=task.id,
            kind=task.kind,
            goal_map=task.goal,
            lease_s=lease_length,
            speed_m_s=speed,
            turn_rate_rad_s=turn_rate,
        )
        lease = self._lease(task, now)
        self._commissions[task.id] = _Commission(
            leaf, lease, message, now + settings.resend_s, settings.resend_s
        )
        self._send(task.robot, message)
        self.note(now, "awarded", task.robot, task)

    def _lease(self, task: Task, now: float) -> Lease:
        """Return a new lease; sent from one place to another beside it a robot keeps the old one.

        Else one that is sent to and fro between two places, and comes nearer to neither, would
        never be asked for progress.
        """
        left = self._left.pop(task.robot, None)
        if left is not None and task.kind == "explore":
            at, goal, lease = left
            if at == now and math.dist(goal, task.goal) <= self._settings.beside_m:
                return lease
        return Lease(self._terms(task.kind), now)

    def _ended(self, task: Task, reason: str, now: float) -> None:
        commission = self._commissions.pop(task.id)
        if task.kind == "explore" and task.state is TaskState.TERMINATED:
            self._left[task.robot] = now, task.goal, commission.lease
        self.note(now, str(task.state), task.robot, task, reason)
        # Also what a robot ended itself is answered: only then it knows that it was heard.
        self._send(task.robot, Terminate(task=task.id))

    def _monitor(self, task: int) -> Callable[[float], str | None]:
        return lambda now: self._commissions[task].lease.violation(now)

    def _lease_length(self, kind: Kind) -> float:
        if kind == "pause":
            return PAUSE_LEASE
        return self._settings.drive_s if kind == "drive" else self._settings.lease_s

    def _terms(self, kind: Kind) -> LeaseTerms:
        arrived = {"wait": WAIT_ARRIVED, "pause": NO_WAY, "drive": NO_WAY}.get(kind, 0.0)
        return LeaseTerms(
            patience=self._lease_length(kind),
            silence=self._settings.silence_s,
            step=self._settings.progress_step_m,
            arrived=arrived,
        )
