"""A Matplotlib figure that notebooks show without pyplot, and pages as SVG; its axes and letters.

Nothing here changes Matplotlib's settings for others.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Collection, Sequence
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from hertzchain.errors import is_positive, require
from hertzchain.files import write_with
from hertzchain.report.document import MULTIPLES, prefixed

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SMALL = 6.0
"""Width below which a picture has small letters, and no room for sentences [inches]; chosen."""

_FILE_STYLE: Any = {"pdf.fonttype": 42, "ps.fonttype": 42}
"""Fonts of PDF as journals ask for them: TrueType, not Matplotlib's Type 3."""

_PAGE_STYLE: Any = {"svg.fonttype": "none", "path.simplify_threshold": 0.3, "savefig.dpi": 110}
"""Settings of pictures on a page: text as text, lines to a third of a pixel, bitmaps as fine as
most screens."""

_PLAIN_RANGE = (1e-3, 1e4)  # of a logarithmic axis with plain numbers, not powers of ten

DrawnAxis = Any
"""An axis of Matplotlib; its class does not have the name of the axis."""

Size = Any
"""Width and height as given by a user."""


def check_size(size: Size) -> None:
    """Raise a SceneError unless the size of a picture is a width and a height [inches]."""
    allowed = "must be a width and a height above 0 [inches], such as (3.4, 2.6)"
    are_two = len(size) == 2 and all(map(is_positive, size))
    require(are_two, "size", size, allowed)


class Picture(Figure):
    """A figure that belongs to no window; a notebook shows it as the last value of a cell."""

    def __init__(self, size: tuple[float, float], title: str = "") -> None:
        """An empty figure of a size [inches], with a title where there is room."""
        check_size(size)
        super().__init__(figsize=size, layout="constrained", dpi=150)
        if title and size[0] >= SMALL:
            self.suptitle(title, fontsize=10)

    def savefig(self, *given: Any, **options: Any) -> None:
        """Write the figure as Matplotlib does, with fonts that journals accept."""
        if self.get_figwidth() < SMALL:
            for axes in self.axes:
                for axis in (axes.xaxis, axes.yaxis):
                    axis.label.set_fontsize("small")
                axes.tick_params(which="both", labelsize="small")
        with rc_context(_FILE_STYLE):
            super().savefig(*given, **options)

    def write(self, path: Path | str) -> None:
        """Write the figure in the format of the suffix, whole or not at all."""
        write_with(path, self.savefig)

    def _repr_png_(self) -> bytes:
        stream = BytesIO()
        self.savefig(stream, format="png")
        return stream.getvalue()

    def inline(self) -> str:
        """Return the figure as an SVG element for a page."""
        stream = StringIO()
        with rc_context(_PAGE_STYLE | {"svg.hashsalt": "wide"}):
            self.savefig(stream, format="svg", metadata={"Date": None})
        svg = stream.getvalue()
        svg = re.sub(r'<g id="[^"]*"', "<g", svg[svg.index("<svg") :])
        svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
        # A hundredth of a point is not visible.
        svg = re.sub(r' d="[^"]*"|<use [^>]*>', lambda match: _rounded(match[0]), svg)
        return re.sub(r' (width|height)="[^"]*pt"', "", svg, count=2)  # as wide as there is room


def _rounded(numbers: str) -> str:
    return re.sub(r"(\.\d\d)\d+", r"\1", numbers).replace("\n", " ")


class _Scaled(ScalarFormatter):
    """Numbers at ticks in a multiple of the unit of the data, with equal decimals."""

    def __init__(self, scale: float) -> None:
        super().__init__(useOffset=False)
        self.set_scientific(False)
        self._scale = scale

    def format_ticks(self, values: Sequence[float]) -> list[str]:
        """Return the numbers at all ticks of an axis."""
        labels: list[str] = super().format_ticks(np.asarray(values) / self._scale)  # type: ignore[arg-type]
        return labels


def in_units(axis: DrawnAxis, label: str) -> None:
    """Label an axis or colour bar, whose limits are final, in a suitable multiple of its unit.

    The label has the unit in brackets, and more than one line where the figure has no room for it.
    Data stay in SI units.
    """
    before, unit, after = parts_of(label)
    low, high = sorted(abs(end) for end in axis.get_view_interval())
    is_log = axis.get_scale() == "log"
    name, scale = prefixed(float(np.sqrt(low * high)) if is_log else high, unit)
    if is_log and unit not in MULTIPLES:
        name, scale = unit, 1.0
    length = axis.axes.figure.get_size_inches()["xy".index(axis.axis_name)]
    text = f"{before}{f' [{name}]' if name else ''}{after}"
    # Letters of a label per inch of a figure; chosen: 13 fill an inch
    axis.set_label_text(textwrap.fill(text, max(1, int(11 * length))))
    if not is_log:
        axis.set_major_formatter(_Scaled(scale))
    elif low / scale >= _PLAIN_RANGE[0] and high / scale <= _PLAIN_RANGE[1]:
        digits = "23456789" if high < 5 * low else "235" if high < 50 * low else ""
        axis.set_major_formatter(lambda value, _: f"{value / scale:g}")
        axis.set_minor_formatter(
            lambda value, _: f"{value / scale:g}" if f"{value:.0e}"[0] in digits else ""
        )
    elif scale != 1:
        axis.set_major_formatter(lambda value, _: f"$10^{{{np.log10(value / scale):.0f}}}$")


def parts_of(label: str) -> tuple[str, str, str]:
    """Return the parts of a label: before its unit, the unit, and after it."""
    match = re.fullmatch(r"(.*?) \[([^]]*)\](.*)", label)
    return (match[1], match[2], match[3]) if match else (label, "", "")


def at_whole_numbers() -> MaxNLocator:
    """Return a locator of as many ticks at whole numbers as have room."""
    return MaxNLocator("auto", integer=True, min_n_ticks=1, steps=[1, 2, 5, 10])


def legend_above(axes: Axes, named: Collection[str] = ()) -> None:
    """Draw a legend above the axes, of labels not in one yet, in as many columns as fit."""
    entries = zip(*axes.get_legend_handles_labels(), strict=True)
    shown = {label: handle for handle, label in entries if label not in named}
    figure_width = axes.figure.get_figwidth()  # type: ignore[union-attr]
    # The layout makes axes narrow for a legend that is wider than they are before it.
    width = axes.get_position().width * figure_width
    if shown:
        axes.legend(
            shown.values(), shown.keys(), loc="lower left", bbox_to_anchor=(0, 1),
            borderaxespad=0.2, **legend_look(list(shown), width, figure_width < SMALL),
        )  # fmt: skip


def legend_look(labels: Sequence[str], width: float, is_small: bool) -> dict[str, Any]:
    """Return the look of a legend without a frame, with columns for a width [inches]."""
    size = "x-small" if is_small else "small"
    em = FontProperties(size=size).get_size_in_points() / 72
    # An entry has a line, gaps, and letters of 0.54 em (measured in the labels of engines).
    entry = (0.54 * max(map(len, labels)) + 4.2) * em
    return {
        "ncols": int(np.clip(width / entry, 1, len(labels))),
        "fontsize": size,
        "title_fontsize": size,
        "columnspacing": 1.0,
        "labelspacing": 0.3,
        "frameon": False,
    }
