from expedition.results.colours import ROBOTS, ROBOTS_ON_DARK, TASKS, rgb, robot_colour, robot_dash
from expedition.results.report_style import SCRIPT, style_sheet


def test_every_colour_has_a_light_and_a_dark_form() -> None:
    css = style_sheet()
    assert css.count("{") == css.count("}")
    assert len(ROBOTS) == len(ROBOTS_ON_DARK)
    for name in [f"r{i}" for i in range(len(ROBOTS))] + list(TASKS):
        assert css.count(f"--{name}:") == 2
    assert SCRIPT.count("{") == SCRIPT.count("}")


def test_robots_beyond_the_colours_get_another_dash() -> None:
    looks = {(robot_colour(i), robot_dash(i)) for i in range(24)}
    assert len(looks) == 24
    assert robot_colour(0, dark=True) == ROBOTS_ON_DARK[0]
    assert rgb("#0a10ff") == (10, 16, 255)
