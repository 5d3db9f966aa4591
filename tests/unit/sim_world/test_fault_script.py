from __future__ import annotations

from sim_world.fault_script import outages, schedule
from sim_world.radio.partitions import Outage
from sim_world.settings import ScriptedFault

FAULTS = (
    ScriptedFault(kind="freeze", robot="robot2", at_s=20.0, duration_s=5.0),
    ScriptedFault(kind="kill", robot="robot1", at_s=10.0),
    ScriptedFault(kind="cut_link", robot="robot3", at_s=1.0, duration_s=2.0),
)


def test_strikes_come_in_order_of_time_and_a_freeze_ends_with_a_thaw() -> None:
    assert schedule(FAULTS) == [
        (10.0, "robot1", "kill"),
        (20.0, "robot2", "freeze"),
        (25.0, "robot2", "thaw"),
    ]


def test_cut_links_are_outages_of_the_radio() -> None:
    assert outages(FAULTS) == (Outage("robot3", 1.0, 3.0),)
