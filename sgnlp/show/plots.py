"""Figures of studies and reports, described as data, drawn in greys, lines and hatches that print in black and white.

Matplotlib (the extra `plots`) is imported only inside the functions that draw.
"""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import Any, Literal

from sgnlp.base.errors import InputError

COLUMNS = 3
"""Most panels in a row, if not given."""
PANEL = (3.0, 2.6)
"""Width and height of a panel [inch]."""
STYLES: tuple[tuple[str, Any, str], ...] = (
    ("0.0", "-", "o"),
    ("0.35", "--", "s"),
    ("0.5", "-.", "^"),
    ("0.25", ":", "D"),
    ("0.55", (0, (5, 1, 1, 1, 1, 1)), "v"),
    ("0.1", (0, (1, 1)), "x"),
    ("0.45", (0, (8, 2)), "P"),
    ("0.3", (0, (3, 3)), "*"),
)
"""Grey level, line and marker of the series, in order and repeating. No grey is lighter than 0.55."""
BARS = (("0.65", ""), ("1.0", "///"), ("0.85", "..."), ("1.0", "xxx"), ("0.45", "\\\\\\"))
"""Face and hatch of bars, in the same order. All have black edges, and intervals are visible on all of them."""
MARKERS = 10
"""Approximate number of markers on a line of many points."""
CROWDED = 24
"""Longest name that fits below upright bars [letters]; with longer names the bars are horizontal."""
SUFFIXES = ("svg", "png")
"""Suffixes of the files of a figure."""
NAME_WIDTH, BAR_HEIGHT = 0.06, 0.22
"""Width of a letter beside a horizontal bar, and height of the bar with its gap [inch]."""


@dataclass(frozen=True)
class Series:
    """Values y over x; `low` and `high`, where given, are the ends of their intervals.

    A label that occurs in several panels should have the same position in each, since the position decides the style.
    """

    label: str
    x: Sequence[Any]
    y: Sequence[float]
    low: Sequence[float] = ()
    high: Sequence[float] = ()
    look: Literal["both", "line", "points"] = "both"


@dataclass(frozen=True)
class Panel:
    """One pair of axes: lines and points, or a group of bars for each x.

    `diagonal` adds the line y = x, and `marks` are places on the x axis that get a vertical line.
    """

    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    bars: bool = False
    diagonal: bool = False
    log: bool = False
    log_x: bool = False
    marks: tuple[float, ...] = ()
    y_range: tuple[float, float] | None = None

    @property
    def lying(self) -> bool:
        """Whether it is one series of bars whose names are too long to fit side by side."""
        return self.bars and len(self.series) == 1 and sum(len(str(x)) for x in self.series[0].x) > CROWDED


def draw(
    panels: Sequence[Panel], caption: str = "", columns: int = COLUMNS, suffixes: Sequence[str] = SUFFIXES
) -> dict[str, bytes]:
    """The figure as files by suffix; the same panels give the same svg.

    The caption is stored in the files' metadata.

    Raises:
        InputError: Matplotlib is not installed.
    """
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError:
        raise InputError("figures need Matplotlib: pip install 'sgnlp[plots]'") from None
    rows = -(-len(panels) // columns)
    columns = -(-len(panels) // rows)
    files: dict[str, bytes] = {}
    about = {"Description": caption} if caption else {}
    options: dict[str, dict[str, Any]] = {
        "svg": {"metadata": {"Date": None} | about},
        "png": {"metadata": about, "dpi": 150},
    }
    width, height = (max(size) for size in zip(*map(_size, panels), strict=True))
    with rc_context({"svg.hashsalt": "sgnlp", "font.size": 8, "hatch.linewidth": 0.5, "axes.axisbelow": True}):
        figure = Figure(figsize=(columns * width, rows * height), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False).ravel()
        for panel, ax in zip(panels, axes, strict=False):
            _fill(ax, panel)
        for ax in axes[len(panels) :]:
            ax.remove()
        _legend(figure, max(1, 2 * (columns - 1)))
        for suffix in suffixes:
            file = io.BytesIO()
            figure.savefig(file, format=suffix, **options[suffix])
            files[suffix] = file.getvalue()
            figure.set_layout_engine("none")  # the places are those of the first file: finding them takes half the time
    return files


def _size(panel: Panel) -> tuple[float, float]:
    """Width and height [inch]."""
    if not panel.lying:
        return PANEL
    names = panel.series[0].x
    return PANEL[0] + NAME_WIDTH * max(len(str(x)) for x in names), max(PANEL[1], 0.8 + BAR_HEIGHT * len(names))


def _legend(figure: Any, columns: int) -> None:
    """One legend below all panels, with every label once; none if there is only one label."""
    pairs = (zip(*ax.get_legend_handles_labels(), strict=True) for ax in figure.axes)
    handles = {label: handle for pair in pairs for handle, label in pair}
    if len(handles) > 1:
        look = {"loc": "outside lower center", "ncols": columns, "frameon": False, "handlelength": 4}
        figure.legend(handles.values(), handles, **look)


def _fill(ax: Any, panel: Panel) -> None:
    draw_in = _lying if panel.lying else _bars if panel.bars else _lines
    draw_in(ax, panel)
    x_label, y_label = (panel.y_label, panel.x_label) if panel.lying else (panel.x_label, panel.y_label)
    ax.set(title=panel.title, xlabel=x_label, ylabel=y_label)
    if panel.y_range is not None:
        (ax.set_xlim if panel.lying else ax.set_ylim)(*panel.y_range)
    if panel.log:
        ax.set_yscale("log")
    if panel.log_x:
        ax.set_xscale("log")
    for mark in panel.marks:
        ax.axvline(mark, color="0.0", linewidth=0.8, linestyle=(0, (2, 2)), zorder=0)
    ax.spines[["top", "right"]].set_visible(False)


def _lines(ax: Any, panel: Panel) -> None:
    if panel.diagonal:
        ends = [f(value for series in panel.series for value in series.x) for f in (min, max)]
        ax.plot(ends, ends, color="0.85", linewidth=3, zorder=0)
    for i, (series, (grey, line, marker)) in enumerate(zip(panel.series, cycle(STYLES), strict=False)):
        every = max(1, len(series.x) // MARKERS) if series.look == "both" else 1
        style = {"color": grey, "linestyle": "" if series.look == "points" else line, "linewidth": 1.2}
        if series.look != "line":
            style |= {"marker": marker, "markersize": 3.5, "markevery": (i % every, every)}
        ax.plot(series.x, series.y, label=series.label, **style)
        if series.low:
            ax.fill_between(series.x, series.low, series.high, color=grey, alpha=0.15, linewidth=0)


def _bars(ax: Any, panel: Panel) -> None:
    width = 0.8 / len(panel.series)
    for i, (series, (face, hatch)) in enumerate(zip(panel.series, cycle(BARS), strict=False)):
        places = [j + (i - (len(panel.series) - 1) / 2) * width for j in range(len(series.x))]
        ax.bar(places, series.y, width, label=series.label, color=face, edgecolor="0.0", hatch=hatch, linewidth=0.6)
        if series.low:
            ax.errorbar(places, series.y, _spread(series), fmt="none", color="0.0", capsize=2, linewidth=1)
    names = [str(x) for x in panel.series[0].x]
    ax.set_xticks(range(len(names)), names, rotation=90 if sum(map(len, names)) > CROWDED else 0)


def _lying(ax: Any, panel: Panel) -> None:
    """One series of bars, the first at the top, with their names beside them."""
    (series,), (face, _) = panel.series, BARS[0]
    places = range(len(series.x))
    ax.barh(places, series.y, 0.7, label=series.label, color=face, edgecolor="0.0", linewidth=0.6)
    if series.low:
        ax.errorbar(series.y, places, xerr=_spread(series), fmt="none", color="0.0", capsize=2, linewidth=1)
    ax.set_yticks(places, [str(x) for x in series.x])
    ax.invert_yaxis()


def _spread(series: Series) -> list[list[float]]:
    """Lengths of the intervals below and above the values."""
    below = [y - e for y, e in zip(series.y, series.low, strict=True)]
    return [below, [e - y for y, e in zip(series.y, series.high, strict=True)]]
