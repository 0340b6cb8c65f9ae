"""Figures of the studies, described as data and drawn in greys, lines and hatches that survive a black printer.

Matplotlib (the extra `plots`) is imported where it draws, and nowhere else.
"""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import Any

from sgnlp.errors import InputError

COLUMNS = 3
"""Panels beside each other at most."""
PANEL = (3.0, 2.6)
"""Width and height of a panel [inch]."""
STYLES = (("0.0", "-", "o"), ("0.35", "--", "s"), ("0.55", "-.", "^"), ("0.7", ":", "D"), ("0.2", (0, (1, 1)), "v"))
"""Grey level, line and marker of the first series, the second, and so on, and round again."""
HATCHES = ("", "///", "...", "xxx", "\\\\\\")
"""Hatches of bars, in the same order; the second bar of a group is white, as are those after it."""


@dataclass(frozen=True)
class Series:
    """Values y over x; `low` and `high`, where given, are the ends of their intervals.

    A label that occurs in several panels should have the same place in each, for the place decides the style.
    """

    label: str
    x: Sequence[Any]
    y: Sequence[float]
    low: Sequence[float] = ()
    high: Sequence[float] = ()


@dataclass(frozen=True)
class Panel:
    """One pair of axes: lines, or a group of bars for each x. `diagonal` adds the line y = x."""

    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    bars: bool = False
    markers: bool = True
    diagonal: bool = False
    y_range: tuple[float, float] | None = None


def draw(panels: Sequence[Panel]) -> dict[str, bytes]:
    """The figure as files by suffix, `svg` and `png`; the same panels give the same svg.

    Raises:
        InputError: Matplotlib is not installed.
    """
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError:
        raise InputError("figures need Matplotlib: pip install 'sgnlp[plots]'") from None
    rows = -(-len(panels) // COLUMNS)
    columns = -(-len(panels) // rows)
    files: dict[str, bytes] = {}
    options: dict[str, dict[str, Any]] = {"svg": {"metadata": {"Date": None}}, "png": {"dpi": 150}}
    with rc_context({"svg.hashsalt": "sgnlp", "font.size": 8, "hatch.linewidth": 0.5}):
        figure = Figure(figsize=(columns * PANEL[0], rows * PANEL[1]), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False).ravel()
        for panel, ax in zip(panels, axes, strict=False):
            _fill(ax, panel)
        for ax in axes[len(panels) :]:
            ax.remove()
        _legend(figure, max(1, 2 * (columns - 1)))
        for suffix in options:
            file = io.BytesIO()
            figure.savefig(file, format=suffix, **options[suffix])
            files[suffix] = file.getvalue()
    return files


def _legend(figure: Any, columns: int) -> None:
    """One legend below all panels, of every label once; none where there is one label."""
    pairs = (zip(*ax.get_legend_handles_labels(), strict=True) for ax in figure.axes)
    handles = {label: handle for pair in pairs for handle, label in pair}
    if len(handles) > 1:
        figure.legend(handles.values(), handles, loc="outside lower center", ncols=columns, frameon=False)


def _fill(ax: Any, panel: Panel) -> None:
    (_bars if panel.bars else _lines)(ax, panel)
    ax.set(title=panel.title, xlabel=panel.x_label, ylabel=panel.y_label)
    if panel.y_range is not None:
        ax.set_ylim(*panel.y_range)
    ax.spines[["top", "right"]].set_visible(False)


def _lines(ax: Any, panel: Panel) -> None:
    if panel.diagonal:
        ends = [f(value for series in panel.series for value in series.x) for f in (min, max)]
        ax.plot(ends, ends, color="0.8", linewidth=3, zorder=0)
    for series, (grey, line, marker) in zip(panel.series, cycle(STYLES), strict=False):
        style = {"color": grey, "linestyle": line, "marker": marker if panel.markers else "", "markersize": 3}
        ax.plot(series.x, series.y, label=series.label, linewidth=1.2, **style)
        if series.low:
            ax.fill_between(series.x, series.low, series.high, color=grey, alpha=0.12, linewidth=0)


def _bars(ax: Any, panel: Panel) -> None:
    width = 0.8 / len(panel.series)
    styled = zip(panel.series, cycle(STYLES), cycle(HATCHES), strict=False)
    for i, (series, (grey, _, _), hatch) in enumerate(styled):
        places = [j + (i - (len(panel.series) - 1) / 2) * width for j in range(len(series.x))]
        face = grey if i == 0 else "white"
        ax.bar(places, series.y, width, label=series.label, color=face, edgecolor="0.0", hatch=hatch, linewidth=0.6)
        if series.low:
            spread = [[y - e for y, e in zip(series.y, series.low, strict=True)]]
            spread += [[e - y for y, e in zip(series.y, series.high, strict=True)]]
            ax.errorbar(places, series.y, spread, fmt="none", color="0.4" if i == 0 else "0.0", capsize=2, linewidth=1)
    names = [str(x) for x in panel.series[0].x]
    crowded = sum(map(len, names)) > 24
    ax.set_xticks(range(len(names)), names, rotation=90 if crowded else 0)
