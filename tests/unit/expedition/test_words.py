import pytest

from expedition.results.words import DASH, area, duration, factor, length, percent, size, text


def test_nothing_is_a_dash() -> None:
    for word in (text, percent, duration, length, area, size, factor):
        assert word(None) == DASH
    assert text("") == DASH
    assert duration(float("nan")) == DASH


def test_words() -> None:
    assert text("<b>") == "&lt;b&gt;"
    assert text(0) == "0"
    assert percent(0.9842) == "98.4 %"
    assert percent(1.0) == "100.0 %"
    assert percent(0.99999) == "99.9 %"
    assert percent(0.9, 0) == "90 %"
    assert length(0.0412) == "4.1 cm"
    assert length(52.31) == "52.3 m"
    assert length(1250.0) == "1.25 km"
    assert area(0.25) == "0.25 m²"
    assert area(12.34) == "12.3 m²"
    assert area(1572.1) == "1,572 m²"
    assert factor(41.3) == "41&times;"
    assert factor(0.56) == "0.56&times;"


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (42.0, "42.0 s"),
        (99.96, "1 min 40 s"),
        (485.2, "8 min 05 s"),
        (3599.7, "1 h 00 min"),
        (7320.0, "2 h 02 min"),
    ],
)
def test_durations(seconds: float, words: str) -> None:
    assert duration(seconds) == words


def test_steps() -> None:
    assert duration(120.0, "steps") == "120 steps"


@pytest.mark.parametrize(
    ("count", "words"), [(812, "812 B"), (12_400, "12.4 kB"), (3.21e6, "3.21 MB"), (4e9, "4 GB")]
)
def test_sizes(count: float, words: str) -> None:
    assert size(count) == words
