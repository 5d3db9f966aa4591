from __future__ import annotations

from robot_agent.motion_commands import MotionCommands


def test_a_command_is_said_again_only_when_it_runs_out_or_changes() -> None:
    commands = MotionCommands()
    first = commands.say(0.2, 0.1, 0.0)
    assert first is not None and (first.speed_m_s, first.turn_rate_rad_s) == (0.2, 0.1)
    assert commands.say(0.2, 0.1, 0.2) is None
    assert commands.say(0.2, 0.1, 0.3) is not None
    assert commands.say(0.2, 0.0, 0.4) is not None
