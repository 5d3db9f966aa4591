from __future__ import annotations

from mapping.geometry import IDENTITY, Pose2
from protocol.messages import PoseUpdate, ReportsReceived
from server.report_intake import ReportIntake
from tests.unit.server.master_rig import Rig, report


def intake_of(rig: Rig) -> ReportIntake:
    rig.hello("robot1", start=[0.0, 0.0, 0.0])
    made = ReportIntake(rig.master.merger, rig.master.roster, 0.25)
    made.begin("robot1")
    return made


def test_reports_are_taken_in_the_order_of_their_numbers() -> None:
    made = intake_of(Rig())
    received, update = made.take("robot1", report(1, IDENTITY, 0.0))
    assert isinstance(received, ReportsReceived) and received.number == 1
    assert isinstance(update, PoseUpdate) and update.matched
    (again,) = made.take("robot1", report(3, IDENTITY, 0.2))
    assert again == ReportsReceived(number=1)


def test_a_robot_that_never_began_is_not_heard() -> None:
    assert intake_of(Rig()).take("robot2", report(1, IDENTITY, 0.0)) == []


def test_teammates_are_discs_around_their_last_place() -> None:
    rig = Rig()
    made = intake_of(rig)
    rig.hello("robot2", start=[0.8, 0.0, 0.0])
    rig.beat("robot2", Pose2(0.1, 0.0, 0.0))
    (disc,) = made.discs("robot1", 0.0)
    assert (disc.x, disc.y) == (0.9, 0.0) and disc.radius > 0.25
