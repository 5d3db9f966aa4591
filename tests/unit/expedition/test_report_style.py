from expedition.results.colours import ROBOTS, TASKS
from expedition.results.report_style import SCRIPT, style_sheet


def test_every_colour_has_a_light_and_a_dark_form() -> None:
    css = style_sheet()
    assert css.count("{") == css.count("}")
    for name in [f"r{i}" for i in range(len(ROBOTS))] + list(TASKS):
        assert css.count(f"--{name}:") == 2
    assert SCRIPT.count("{") == SCRIPT.count("}")
