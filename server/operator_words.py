"""What an operator can have a robot do: visit a place, drive by hand, pause, go back to the team.

Each word takes the robot out of the exploration pool (or puts it back); the executive sees to it
that others cover for it.
"""

from __future__ import annotations

from typing import NamedTuple

from coordination.task import Point
from coordination.task_node import Act, Mend, Node
from coordination.task_tree import Retry, Sequence, TryAgain
from protocol.effects import Send
from server.executive_settings import ExecutiveSettings
from server.pool import Member, Pool
from server.work import UNREACHABLE, Work


class Reply(NamedTuple):
    """The answer to an operator, and what is to be sent."""

    accepted: bool
    text: str
    sends: list[Send]


class OperatorWords:
    """Carries out an operator's words. All of them return (accepted, an answer for people)."""

    def __init__(self, settings: ExecutiveSettings, pool: Pool, work: Work) -> None:
        self._settings = settings
        self._pool = pool
        self._work = work

    def visit(self, robot: str, place: Point, now: float) -> tuple[bool, str]:
        """Send a robot to a place (x, y) [m], map frame, and back to the team afterwards.

        Source: Simmons et al. 2000, section "Assigning Tasks": "terminates that robot's current
        task, ... assigns and monitors the new task, and then integrates the robot back into the
        exploration pool when it is finished".
        """
        member, refusal = self._present(robot)
        if member is None:
            return False, refusal
        errand = Sequence(f"visit by {robot}", on_failure=self._back_after_failure(member))
        again = Retry(self._settings.max_tries, self._visit_again(member, place))
        errand.append(Act("end the current task", lambda at: self._free(member, errand, at)))
        errand.append(self._work.leaf(robot, "visit", place, again))
        errand.append(Act("back to the pool", lambda at: self._hand_back(member, at)))
        member.node.add(errand, now)
        return True, f"{robot} goes to ({place[0]:.2f}, {place[1]:.2f})"

    def pause(self, robot: str, now: float) -> tuple[bool, str]:
        """Halt a robot until it is resumed; one that is lost halts when it is back."""
        member = self._pool.get(robot)
        if member is None:
            return False, self._unknown(robot)
        if member.mode == "pause":
            return True, f"{robot} is paused already"
        self._take(member, "pause", now)
        if not member.live:
            return True, f"{robot} is lost; it will be paused when it is back"
        self.renew_pause(member, now)
        return True, f"{robot} is paused"

    def renew_pause(self, member: Member, now: float) -> None:
        """Tell a robot (again) that it is paused."""
        member.node.add(self._work.leaf(member.name, "pause", member.place or (0.0, 0.0)), now)

    def drive(self, robot: str, speed: float, turn_rate: float, now: float) -> tuple[bool, str]:
        """Drive a robot by hand [m/s, rad/s] until the next word, or for `drive_s`."""
        member, refusal = self._present(robot)
        if member is None:
            return False, refusal
        leaf = member.leaf
        if leaf is not None and leaf.task.kind == "drive":
            self._work.drive_on(leaf, speed, turn_rate, now)
        else:
            self._take(member, "drive", now)
            goal = member.place or (0.0, 0.0)
            leaf = self._work.leaf(robot, "drive", goal, speed=speed, turn_rate=turn_rate)
            member.node.add(leaf, now)
        return True, f"{robot} drives at {speed:.2f} m/s, {turn_rate:.2f} rad/s"

    def resume(self, robot: str, now: float) -> tuple[bool, str]:
        """Give a robot back to the team."""
        member = self._pool.get(robot)
        if member is None:
            return False, self._unknown(robot)
        if member.mode == "pool":
            return True, f"{robot} is with the team already"
        self._work.take_back(member, "resumed", now)
        self._hand_back(member, now)
        return True, f"{robot} is back with the team"

    def _present(self, robot: str) -> tuple[Member | None, str]:
        """Return a robot that can hear, or None and why not."""
        member = self._pool.get(robot)
        if member is None:
            return None, self._unknown(robot)
        if not member.live:
            return None, f"{robot} is lost: it has not been heard of for a while"
        return member, ""

    def _unknown(self, robot: str) -> str:
        known = ", ".join(member.name for member in self._pool) or "none"
        return f"there is no robot '{robot}' in this team; its robots: {known}"

    def _take(self, member: Member, mode: str, now: float) -> None:
        """Take a robot out of the pool and off whatever it is at."""
        self._work.take_back(member, f"operator: {mode}", now)
        member.mode = "pause" if mode == "pause" else "drive"
        member.idle_since = None

    def _free(self, member: Member, errand: Sequence, now: float) -> None:
        """End everything a robot is at but the errand itself."""
        for child in tuple(member.node.children):
            if child is not errand:
                child.terminate("operator: visit", now)
        member.mode = "visit"
        member.idle_since = None

    def _hand_back(self, member: Member, now: float) -> None:
        member.mode = "pool"
        member.rejoin(now)
        self._work.note(now, "back to the pool", member.name)

    def _back_after_failure(self, member: Member) -> Mend:
        return lambda node, now: Act("back to the pool", lambda at: self._hand_back(member, at))

    def _visit_again(self, member: Member, place: Point) -> TryAgain:
        """Return what makes the next try of a visit, as long as there is sense in one."""

        def again(node: Node, mend: Mend) -> Node | None:
            if not member.live or node.reason.startswith(UNREACHABLE):
                return None
            return self._work.leaf(member.name, "visit", place, mend)

        return again
