from expedition.results.colours import ROBOTS, ROBOTS_ON_DARK, rgb, robot_colour, robot_dash


def test_robots_beyond_the_colours_get_another_dash() -> None:
    assert len(ROBOTS) == len(ROBOTS_ON_DARK)
    assert len({(robot_colour(i), robot_dash(i)) for i in range(24)}) == 24
    assert robot_colour(0, dark=True) == ROBOTS_ON_DARK[0]


def test_rgb() -> None:
    assert rgb("#0a10ff") == (10, 16, 255)
