from __future__ import annotations

from mapping.geometry import IDENTITY, Pose2
from protocol.messages import PoseUpdate, ReportsReceived
from server.report_intake import ReportIntake
from tests.unit.rooms import sent
from tests.unit.server.master_rig import Rig, begun, notes, report


def intake_of(rig: Rig) -> ReportIntake:
    rig.hello("robot1", start=[0.0, 0.0, 0.0])
    made = ReportIntake(rig.master.merger, rig.master.roster, 0.25, rig.master.faults)
    made.begin("robot1")
    return made


def test_reports_are_taken_in_the_order_of_their_numbers() -> None:
    made = intake_of(Rig())
    received, update = sent(made.take("robot1", report(1, IDENTITY, 0.0)))
    assert isinstance(received, ReportsReceived) and received.number == 1
    assert isinstance(update, PoseUpdate) and update.matched
    (again,) = sent(made.take("robot1", report(3, IDENTITY, 0.2)))
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


def test_a_report_from_nowhere_is_refused_and_its_robot_named_once() -> None:
    rig = begun()
    shape = rig.master.merger.geometry.shape
    rig.hello("robot2", start=[0.2, 0.1, 0.0], start_sigma_m=0.5)
    rig.beat("robot2")
    first = rig.says("robot2", report(1, Pose2(9.0e4, 9.0e4, 0.0), rig.now))
    assert "a report of robot2: too far away" in notes(first)
    received, update = sent(first)
    assert received == ReportsReceived(number=1)
    assert isinstance(update, PoseUpdate) and not update.matched
    again = rig.says("robot2", report(2, Pose2(-9.0e4, 0.0, 0.0), rig.now))
    assert notes(again) == "" and ReportsReceived(number=2) in sent(again)
    assert rig.master.merger.geometry.shape == shape
    ((key, count),) = rig.master.faults.counts.items()
    assert key[0] == "robot2" and count == 2
    # The others go on, and so does the robot once it is sane again.
    assert ReportsReceived(number=2) in sent(rig.report("robot1", 2, Pose2(0.2, 0.1, 0.1)))
    rig.report("robot2", 3)
    assert len(rig.master.merger.members["robot2"].held) <= 1
