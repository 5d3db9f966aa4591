import pytest

from sim_world.errors import WorldError
from sim_world.victims import Victim, check_victims, places_of
from tests.unit.rooms import room


def victim(id: str, x: float, y: float) -> Victim:
    return Victim(id=id, x=x, y=y)


def test_victims_lie_on_free_floor() -> None:
    victims = (victim("a", 0.0, 0.0), victim("b", 0.5, 1.0))
    check_victims(room(), victims)
    assert places_of(victims).tolist() == [[0.0, 0.0], [0.5, 1.0]]
    assert places_of(()).shape == (0, 2)


@pytest.mark.parametrize(
    ("x", "y", "says"),
    [
        (9.0, 0.0, r"'b' cannot lie at \(9, 0\): that is outside the world.*move it inside"),
        (0.0, -1.5, "outside the world"),
        (2.0, 1.3, "something solid is there; move it onto free floor"),
    ],
)
def test_others_are_refused_with_one_line(x: float, y: float, says: str) -> None:
    with pytest.raises(WorldError, match=says) as caught:
        check_victims(room(), (victim("a", 0.0, 0.0), victim("b", x, y)))
    assert "\n" not in str(caught.value)


def test_each_has_its_own_name() -> None:
    with pytest.raises(WorldError, match="two victims are named 'a'; give each its own id"):
        check_victims(room(), (victim("a", 0.0, 0.0), victim("a", 0.5, 0.0)))
