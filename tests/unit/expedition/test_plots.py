import io
from pathlib import Path

from PIL import Image

from expedition.experiments.plots import new_figure, plot_points, plot_spreads, save_figure


def test_lines_with_bars(tmp_path: Path) -> None:
    figure, axes = new_figure("Time", "robots", "time [s]")
    full = {"min": 1.0, "median": 2.0, "max": 4.0}
    plot_spreads(
        axes,
        {
            "50 %": [(1, full), (2, full), (3, {"min": None, "median": None, "max": None})],
            "90 %": [(1, {"median": 3.0}), (2, full)],
        },
    )
    assert axes.get_xticks().tolist() == [1, 2, 3]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["50 %", "90 %"]
    path = save_figure(figure, tmp_path / "deep" / "plot.png")
    first = path.read_bytes()
    assert Image.open(io.BytesIO(first)).size[0] == 1050
    save_figure(figure, path)
    assert path.read_bytes() == first


def test_points_and_svg(tmp_path: Path) -> None:
    figure, axes = new_figure("Points", "x", "y", width=4.0)
    plot_points(axes, {"a": iter([(0.0, 1.0), (1.0, 2.0)]), "b": []})
    assert save_figure(figure, tmp_path / "plot.svg").read_text().startswith("<?xml")


def test_nothing_to_plot() -> None:
    _, axes = new_figure("Empty", "x", "y")
    plot_spreads(axes, {})
    plot_points(axes, {})
    plot_spreads(axes, {"odd": [(0.5, {"min": 0.0, "median": 1.0, "max": 2.0})]})
    assert axes.get_title(loc="left") == "Empty"
