"""A sweep as a picture: lines or points of a result, or a map over two parameters."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError, SceneError, require
from hertzchain.report.style import COLOURS
from hertzchain.scene.quantities import to_si
from hertzchain.scene.scene import UNITS
from hertzchain.sweeps.design import Axis, Listed, Span
from hertzchain.sweeps.table import COLUMNS, COUNTS

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

LABELS = {
    "scene": "number of the scene",
    "backend": "backend",
    "chain.granules": "granules N",
    "chain.radius": "radius R [m]",
    "chain.young_modulus": "Young's modulus E [Pa]",
    "chain.poisson_ratio": "Poisson's ratio",
    "chain.density": "density [kg/m³]",
    "shock.profile": "profile",
    "shock.peak_force": "F0 [N]",
    "shock.duration_ratio": "n",
    "shock.momentum_ratio": "LM_ratio",
    "shock.rise_time": "rise time t0 [s]",
    "run.end_time": "end of the run [s]",
    "transition_granules": "p, granules in the transition",
    "solitary_wave_force_N": "F_SW [N]",
    "far_field_force_N": "peak force far from the shock [N]",
    "speed_m_s": "wave speed [m/s]",
    "largest_peak_force_N": "largest peak force [N]",
    "largest_peak_contact": "contact of the largest peak",
    "overlap_ratio": "largest overlap / R",
    "eq3_transition_granules": "p by Eq. 3, granules",
    "error_estimate": "error estimate of the peaks, relative",
    "force_evaluations": "force evaluations",
}
"""What the columns of a sweep are called on an axis."""

_TITLES = {
    "shock.profile": "{} pulse",
    "shock.duration_ratio": "n = {:.4g}",
    "shock.momentum_ratio": "LM_ratio = {:.4g}",
    "shock.rise_time": "t0 = {:.4g} s",
    "shock.peak_force": "F0 = {:.4g} N",
    "chain.granules": "{} granules",
    "chain.radius": "R = {:.4g} m",
    "chain.young_modulus": "E = {:.4g} Pa",
    "chain.poisson_ratio": "Poisson's ratio {:.4g}",
    "chain.density": "{:.4g} kg/m³",
    "run.end_time": "until {:.4g} s",
    "backend": "{}",
}
"""How a title says what is the same in all rows."""

_ALWAYS = 6
"""Of the titles: so many are told where they do not vary; the others where they were fixed."""

_TEXT = ("backend", "shock.profile", "failure")
_WHOLE = (*COUNTS, "chain.granules", "scene")

_OTHER_MEASURE = {
    "shock.momentum_ratio": "shock.rise_time",
    "shock.rise_time": "shock.momentum_ratio",
}
"""Either says how long a pulse lasts, and follows from the other."""

_NAMED: dict[str, dict[str, str]] = {
    "cosine": {"color": "#0072B2", "marker": "o"},
    "triangular": {"color": "#D55E00", "marker": "s"},
    "cosine-triangular": {"color": "#009E73", "marker": "^"},
    "table": {"color": "#CC79A7", "marker": "D"},
    "native": {"color": COLOURS["native"], "marker": "o"},
    "lammps": {"color": COLOURS["lammps"], "marker": "s"},
    "formulas": {"color": COLOURS["eq6"], "marker": "^"},
}
"""Okabe and Ito's colours, told apart by the colour-blind, too."""

_MARKERS, _DASHES = "os^Dv<>P", ("-", "--", "-.", ":")
_FEW = len(_MARKERS)
"""Values of a colour that a legend names; more have a colour bar."""

_MOST_LINES = 1000
"""Chosen: nobody tells more of them apart, and each costs a millisecond."""

_MOST_MARKED = 60
"""Points of a line that are marked; more would melt into one another."""

_MOST_VECTORS = 5000
"""Points from which PDF and SVG have a picture of them and not each of them."""

_DECADES = 100.0
"""Ratio of the largest value to the smallest from which an axis is logarithmic."""

_PLAIN = (1e-3, 1e4)
"""Between these, numbers on a logarithmic axis are written out: 0.1, and no power of ten."""

_AS_GIVEN = 1e-3
"""How near, relatively, a value has to be to one of the sweep to be that one: three digits."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """A picture of a sweep.

    Parameters
    ----------
    figure
        It; the remarks are beneath it in small letters.
    remarks
        What it does not show, a sentence each.
    """

    figure: Figure
    remarks: tuple[str, ...]


class _Sweep(Protocol):
    """What is drawn of a ``Sweep``, which draws itself by ``draw``."""

    @property
    def manifest(self) -> Mapping[str, Any]: ...

    @property
    def rows(self) -> int: ...

    def to_frame(self, columns: Sequence[str] | None = None) -> pandas.DataFrame: ...


def draw(
    sweep: _Sweep,
    x: str,
    y: str,
    colour: str | None = None,
    where: Mapping[str, Any] | None = None,
) -> Drawn:
    """Draw a column of a sweep over another, as lines or points; or a map, over two parameters.

    Parameters
    ----------
    sweep
        What to draw, as far as it is done.
    x
        A column with numbers, in most cases a parameter.
    y
        A column with numbers; where it is a parameter that varies, the picture is a map.
    colour
        A column; for a map one with numbers. By default the backend where there are several.
    where
        Values, by the name of a parameter or ``backend``, that the rows are to have. Of numbers
        the nearest of the sweep is taken, if it is the same to three digits.

    Raises
    ------
    HertzchainError
        For a column that does not exist or cannot be drawn so, a value that the sweep has not,
        several values in one place of a map, too many lines, and where nothing is left to draw.
    """
    from matplotlib.figure import Figure

    x, y, colour = full_name(x), full_name(y), None if colour is None else full_name(colour)
    for name in (x, y):
        allowed = "is text: --x and --y must be columns of numbers, text is for --colour"
        require(name not in _TEXT, name, None, allowed)
    require(colour != "failure", "failure", None, "is a sentence, and no colour")
    require(len({x, y, colour}) == 3, x if x in (y, colour) else y, None, "is there twice")
    rows = _rows(sweep, (x, y), colour, where or {})
    figure = Figure(figsize=(8, 5), layout="constrained", dpi=150)
    axes = figure.subplots()
    if y in rows.left:
        drawn = _draw_map(axes, rows, x, y, colour)
    else:
        drawn = _draw_lines(axes, rows, x, y, colour or rows.default_colour)
    axes.set(xlabel=LABELS[x], ylabel=LABELS[y])
    _scale(rows, x, axes.set_xscale, axes.xaxis)
    _scale(rows, y, axes.set_yscale, axes.yaxis)
    axes.set_title(_title(rows, {x, y, colour}), fontsize="medium")
    remarks = (*rows.remarks, *drawn)
    if remarks:
        figure.supxlabel(textwrap.fill("; ".join(remarks), 120), fontsize=7, color="0.35")
    return Drawn(figure, remarks)


def full_name(name: str) -> str:
    """The name of a column, given with its section or without.

    Raises
    ------
    SceneError
        If there is none.
    """
    found = [one for one in COLUMNS if name in (one, one.partition(".")[2] or one)]
    allowed = f"is no column of a sweep, which has {', '.join(COLUMNS)}"
    require(len(found) == 1, name, None, allowed)
    return found[0]


# Which rows


@dataclass(frozen=True, eq=False)
class _Rows:
    """What is to be drawn: rows with numbers, and where each is among all that varies.

    Parameters
    ----------
    column
        Those that are drawn, by name, shape (rows,).
    place
        For each axis that is crossed, and the backend, which of its values a row has: numbers from
        0, shape (rows,).
    axes
        What varies, by name.
    left
        Names of all that takes several values and is not fixed; ``backend`` may be among them.
    fixed
        What is the same in all rows, by name.
    backends
        Of the sweep.
    remarks
        On rows that are not there.
    """

    column: Mapping[str, NDArray[Any]]
    place: Mapping[str, NDArray[np.int64]]
    axes: Mapping[str, Axis]
    left: tuple[str, ...]
    fixed: Mapping[str, Any]
    backends: tuple[str, ...]
    remarks: tuple[str, ...]

    @property
    def default_colour(self) -> str | None:
        """The backend, where there are several."""
        return "backend" if "backend" in self.left else None

    @property
    def drawn(self) -> tuple[str, ...]:
        """What is left and was sampled."""
        return tuple(name for name in self.left if name not in self.place)

    def behind(self, name: str | None) -> str | None:
        """The parameter that varies where a column does; None where that is not one alone."""
        for one in (name, _OTHER_MEASURE.get(name or "")):
            if one in self.left:
                return one
        return None

    def count(self, name: str) -> int:
        """How many values an axis that is crossed takes."""
        return len(self.backends) if name == "backend" else self.axes[name].count or 0

    def hidden(self, *shown: str | None) -> tuple[str, ...]:
        """What varies and is not shown."""
        seen = {self.behind(name) for name in shown}
        return tuple(name for name in self.left if name not in seen)


def _rows(
    sweep: _Sweep, numbers: tuple[str, str], colour: str | None, where: Mapping[str, Any]
) -> _Rows:
    manifest = sweep.manifest
    axes = {axis.name: axis for axis in map(_axis, manifest["vary"])}
    backends = tuple(one["name"] for one in manifest["backends"])
    fixed = {full_name(name): value for name, value in where.items()}
    allowed = f"is fixed twice: by {' and '.join(where)}"
    require(len(fixed) == len(where), next(iter(fixed), ""), None, allowed)
    fixed_to = {name: _number(name, value, axes, backends) for name, value in fixed.items()}

    named = ("scene", "backend", "failure", *numbers, *([colour] if colour else []))
    frame = sweep.to_frame(list(dict.fromkeys(named)))
    remarks = []
    if len(frame) < sweep.rows:
        there = f"{len(frame):,} of {sweep.rows:,} rows are there"
        remarks.append(f"the sweep is not complete, {there}")
    place = _places(frame, axes, backends, manifest["samples"])
    keep = np.ones(len(frame), np.bool_)
    for name, number in fixed_to.items():
        keep &= place[name] == number
    frame, place = frame[keep], {name: found[keep] for name, found in place.items()}
    values = {name: _column(frame, name) for name in dict.fromkeys((*named[3:], "backend"))}
    lacking = {name: np.isnan(found) for name, found in values.items() if name not in _TEXT}
    lost = np.any(list(lacking.values()), axis=0)
    without = " or ".join(name for name, holes in lacking.items() if holes.any())
    if lost.all():
        what = f"no row has {without}" if lost.size else "its rows are not there yet"
        raise HertzchainError(f"there is nothing to draw: {what}")
    if lost.any():
        failed = int((frame["failure"].notna().to_numpy() & lost).sum())
        more = f"; {failed:,} of them failed" if failed else ""
        remarks.append(
            f"{int(lost.sum()):,} of {lost.size:,} rows have no {without} and are left out{more}"
        )
    several = [name for name, axis in axes.items() if axis.count is None or axis.count > 1]
    several += ["backend"] if len(backends) > 1 else []
    return _Rows(
        {name: found[~lost] for name, found in values.items()},
        {name: found[~lost] for name, found in place.items()},
        axes,
        tuple(name for name in several if name not in fixed),
        _same_in_all(manifest, axes, backends, fixed_to),
        backends,
        tuple(remarks),
    )


def _axis(entry: Mapping[str, Any]) -> Axis:
    """An axis, as JSON knows it."""
    return Span(**entry) if "low" in entry else Listed(entry["name"], tuple(entry["values"]))


def _number(name: str, wanted: Any, axes: Mapping[str, Axis], backends: Sequence[str]) -> int:
    """Which of the values that a parameter takes is meant, from 0."""
    if name == "backend":
        require(wanted in backends, name, wanted, f"is not in the sweep: {', '.join(backends)}")
        return backends.index(wanted)
    allowed = f"does not vary in this sweep; what does: {', '.join(axes)}"
    require(name in axes, name, None, allowed)
    axis = axes[name]
    allowed = "was drawn, so that hardly two rows have the same: it cannot be fixed"
    require(axis.count is not None, name, None, allowed)
    assert axis.count is not None
    values = axis.at(np.arange(axis.count))
    if name in _TEXT:
        require(wanted in values, name, wanted, f"is not in the sweep: {', '.join(values)}")
        return int(np.nonzero(values == wanted)[0][0])
    given = wanted.strip() if isinstance(wanted, str) else wanted
    number = float(to_si(name, given, UNITS.get(name.partition(".")[2], "")))
    off = np.abs(values - number)
    nearest = np.argsort(off, kind="stable")[:2]
    if not off[nearest[0]] <= _AS_GIVEN * abs(values[nearest[0]]):
        said = " and ".join(f"{value:.5g}" for value in values[np.sort(nearest)])
        raise SceneError(name, wanted, f"is not in the sweep; the nearest there: {said}")
    return int(nearest[0])


def _places(
    frame: pandas.DataFrame,
    axes: Mapping[str, Axis],
    backends: Sequence[str],
    samples: Mapping[str, Any] | None,
) -> dict[str, NDArray[np.int64]]:
    """Where rows are on each axis that is crossed: by their numbers, which no digit is lost of."""
    crossed = {name: axis.count for name, axis in axes.items() if axis.count is not None}
    shape = (*crossed.values(), *([samples["count"]] if samples else []))
    found = np.unravel_index(frame["scene"].to_numpy(np.int64), shape)
    place = {name: at.astype(np.int64) for name, at in zip(crossed, found, strict=False)}
    place["backend"] = np.zeros(len(frame), np.int64)
    for number, name in enumerate(backends):
        place["backend"][(frame["backend"] == name).to_numpy(np.bool_)] = number
    return place


def _column(frame: pandas.DataFrame, name: str) -> NDArray[Any]:
    if name in _TEXT:  # each name is kept once, however many rows have it
        codes, names = frame[name].factorize()
        found: NDArray[Any] = np.asarray(names, object)[codes]
        return found
    return frame[name].to_numpy(np.float64, na_value=np.nan)


def _same_in_all(
    manifest: Mapping[str, Any],
    axes: Mapping[str, Axis],
    backends: Sequence[str],
    fixed_to: Mapping[str, int],
) -> dict[str, Any]:
    """What the title may name: what does not vary, and what was fixed."""
    base = {
        f"{section}.{key}": value
        for section, part in manifest["scene"].items()
        for key, value in part.items()
        if value is not None
    }
    varies = {*axes, *(_OTHER_MEASURE[name] for name in axes if name in _OTHER_MEASURE)}
    told = list(_TITLES)[:_ALWAYS]
    same = {name: base[name] for name in told if name in base and name not in varies}
    if "shock.time_s" in base:
        same["shock.profile"] = "table"
    for name, axis in axes.items():
        if name in fixed_to or axis.count == 1:
            same[name] = axis.at(np.array([fixed_to.get(name, 0)]))[0]
    if "backend" in fixed_to or len(backends) == 1:
        same["backend"] = backends[fixed_to.get("backend", 0)]
    return {name: same[name] for name in _TITLES if name in same}


# Lines and points


def _draw_lines(axes: Axes, rows: _Rows, x: str, y: str, colour: str | None) -> list[str]:
    """Draw lines where x follows from a parameter on a grid, else points."""
    along = rows.behind(x)
    hidden = _listed(rows.hidden(x, colour))
    axes.grid(alpha=0.3)
    if along in rows.place and not rows.drawn:
        assert along is not None
        lines = _lines(rows, along)
        if colour is None or all(len(set(rows.column[colour][line])) == 1 for line in lines):
            _draw_each(axes, rows, lines, along, (x, y, colour))
            return (
                [f"{hidden}, too: all values are lines of one colour; --colour tells them apart"]
                if hidden
                else []
            )
    if colour is None:
        _draw_points(axes, rows, x, y, {})
    elif looks := _looks(rows.column[colour], colour):
        for value, look in looks.items():
            _draw_points(axes, rows, x, y, look, rows.column[colour] == value)
        _legend(axes, colour)
    else:
        _draw_coloured(axes, rows, x, y, colour)
    return (
        [f"{hidden}, too: points of all values are drawn on top of one another"] if hidden else []
    )


def _lines(rows: _Rows, along: str) -> list[NDArray[np.intp]]:
    """Which rows each line has: those that differ in one parameter alone."""
    across = [name for name in rows.left if name != along]
    line = np.zeros(rows.place["backend"].size, np.int64)
    for name in across:
        line = line * rows.count(name) + rows.place[name]
    lines, sizes = np.unique(line, return_counts=True)
    if lines.size > _MOST_LINES:
        raise HertzchainError(
            f"{lines.size:,} lines cannot be told from one another, {_MOST_LINES:,} at most are"
            f" drawn: fix {' or '.join(across)} to one value (--where NAME=VALUE)"
        )
    return np.split(np.argsort(line, kind="stable"), np.cumsum(sizes)[:-1])


def _draw_each(
    axes: Axes,
    rows: _Rows,
    lines: Sequence[NDArray[np.intp]],
    along: str,
    names: tuple[str, str, str | None],
) -> None:
    """Draw lines; what is missing on one of them is a gap."""
    x, y, colour = names
    axis = rows.axes[along]
    count = rows.count(along)
    order = np.argsort(axis.at(np.arange(count)), kind="stable")
    plain = {"color": "#0072B2", "marker": "o", "markersize": 4}
    looks = {} if colour is None else _looks(rows.column[colour], colour)
    bar: Any = None if looks or colour is None else _colour_bar(axes, rows, colour)
    labelled = set()
    for line in lines:
        at, to = np.full((2, count), np.nan)
        at[rows.place[along][line]] = rows.column[x][line]
        to[rows.place[along][line]] = rows.column[y][line]
        look: dict[str, Any] = dict(plain)
        if colour is not None:
            value = rows.column[colour][line[0]]
            look = dict(looks[value]) if looks else plain | {"color": bar.to_rgba(value)}
            if value in labelled:
                look.pop("label", None)
            labelled.add(value)
        if count > _MOST_MARKED or bar is not None:  # a point between two gaps has no line
            look |= {"marker": "." if np.isnan(to).any() else "", "markersize": 2}
        axes.plot(at[order], to[order], **({"linewidth": 1.2} | look))
    if looks and colour is not None:
        _legend(axes, colour)


def _draw_points(
    axes: Axes, rows: _Rows, x: str, y: str, look: Mapping[str, Any], some: Any = slice(None)
) -> None:
    at, to = rows.column[x][some], rows.column[y][some]
    style: dict[str, Any] = {"marker": "o", "color": "#0072B2", "markersize": 4} | dict(look)
    style |= {"linestyle": "none", "rasterized": at.size > _MOST_VECTORS}
    if at.size > _MOST_MARKED:
        style["markersize"] *= 0.6 if at.size < 1000 else 0.3
    axes.plot(at, to, **style)


def _draw_coloured(axes: Axes, rows: _Rows, x: str, y: str, colour: str) -> None:
    """Points, coloured by a number."""
    bar = _colour_bar(axes, rows, colour)
    values = rows.column[colour]
    axes.scatter(
        rows.column[x],
        rows.column[y],
        s=min(20.0, max(2.0, 20_000 / values.size)),
        c=values,
        norm=bar.norm,
        cmap=bar.cmap,
        rasterized=values.size > _MOST_VECTORS,
    )


# Maps


def _draw_map(axes: Axes, rows: _Rows, x: str, y: str, colour: str | None) -> list[str]:
    """Draw a number over two parameters: cells of a grid, else points."""
    if colour is None or colour in _TEXT:
        raise SceneError(
            y, None, "varies, which makes a map: name the column of numbers to draw with --colour"
        )
    crossed = [name for name in rows.hidden(x, y) if name in rows.place]
    advice = " and ".join(f"--where {name}=VALUE" for name in crossed)
    if x in rows.left and {x, y} <= rows.place.keys():
        hidden = rows.hidden(x, y)
        if hidden:
            raise HertzchainError(
                f"{_listed(hidden)}, too, so that several values fall into each cell of the map:"
                f" {f'fix it, {advice}' if advice else f'take {hidden[0]} as --x or --y'}"
            )
        _draw_cells(axes, rows, x, y, colour)
        return []
    if crossed and len(np.unique(np.stack([rows.column[x], rows.column[y]]), axis=1).T) < (
        rows.column[x].size
    ):
        raise HertzchainError(
            f"{_listed(crossed)}, too, so that several values fall onto each point of the map:"
            f" fix it, {advice}"
        )
    _draw_coloured(axes, rows, x, y, colour)
    axes.grid(alpha=0.3)
    left_out = _listed(rows.hidden(x, y, colour))
    return [f"{left_out}, too: the map has points of all values"] if left_out else []


def _draw_cells(axes: Axes, rows: _Rows, x: str, y: str, colour: str) -> None:
    edges, ranks = [], []
    for name in (x, y):
        values = rows.axes[name].at(np.arange(rows.count(name))).astype(np.float64)
        order = np.argsort(values)
        edges.append(cell_edges(values[order], _is_log(rows, name)))
        ranks.append(np.argsort(order)[rows.place[name]])
    cells = np.full((edges[1].size - 1, edges[0].size - 1), np.nan)
    cells[ranks[1], ranks[0]] = rows.column[colour]
    bar = _colour_bar(axes, rows, colour)
    axes.set_facecolor("0.85")
    axes.pcolormesh(
        *edges, np.ma.masked_invalid(cells), norm=bar.norm, cmap=bar.cmap, rasterized=True
    )
    if np.isnan(cells).any():
        from matplotlib.patches import Patch

        axes.legend(handles=[Patch(facecolor="0.85", edgecolor="0.4", label="no number")])


def cell_edges(values: FloatArray, log: bool) -> FloatArray:
    """Edges half way between values, and as far beyond the first and the last.

    Parameters
    ----------
    values
        Increasing, at least two of them, shape (values,).
    log
        Whether half way is meant in logarithms.

    Returns
    -------
    FloatArray
        Shape (values + 1,).
    """
    at = np.log(values) if log else values
    between = (at[1:] + at[:-1]) / 2
    first, last = 2 * at[0] - between[0], 2 * at[-1] - between[-1]
    if not log and at[0] > 0:  # what is positive has no cell below 0
        first = max(first, 0.0)
    edges = np.concatenate([[first], between, [last]])
    return np.exp(edges) if log else edges


# Colours, scales and labels


def _looks(values: NDArray[Any], name: str) -> dict[Any, dict[str, Any]]:
    """How each of a few values, or names, is drawn; empty where there are too many.

    Markers are open and of several sizes: where lines agree, one is seen inside the other.
    """
    from matplotlib import colormaps

    found = sorted(set(values), key=list(_NAMED).index) if name in _TEXT else np.unique(values)
    if len(found) > _FEW:
        return {}
    shades = colormaps["viridis"](np.linspace(0, 0.88, len(found)))
    looks = {}
    for k, value in enumerate(found):
        look: dict[str, Any] = {"color": shades[k], "marker": _MARKERS[k]}
        label = value if name in _TEXT else f"{value:.4g}"
        if name in _TEXT:
            look = dict(_NAMED[value])
        looks[value] = look | {
            "label": label,
            "linestyle": _DASHES[k % len(_DASHES)],
            "fillstyle": "full" if k == 0 else "none",
            "markersize": 4 + k * min(2.5, 8 / len(found)),
        }
    return looks


def _legend(axes: Axes, colour: str) -> None:
    axes.figure.legend(loc="outside right upper", title=LABELS[colour], fontsize="small")


def _colour_bar(axes: Axes, rows: _Rows, name: str) -> Any:
    """A colour bar for a column of numbers; what has its colours."""
    from matplotlib.cm import ScalarMappable

    values = rows.column[name]
    scale = ScalarMappable(_norm(values, name in _WHOLE, _is_log(rows, name)), "viridis")
    bar = axes.figure.colorbar(scale, ax=axes, label=LABELS[name])
    if name in _WHOLE and not _is_log(rows, name):
        bar.locator = _at_whole_numbers()
        bar.minorticks_off()
        bar.update_ticks()
    return scale


def _norm(values: FloatArray, whole: bool, log: bool) -> Normalize:
    from matplotlib.colors import BoundaryNorm, LogNorm, Normalize

    low, high = float(np.min(values)), float(np.max(values))
    if log:
        return LogNorm(low, high)
    colours = 256  # of the colour map
    if whole and high - low < colours:
        return BoundaryNorm(np.arange(low, high + 2) - 0.5, colours)
    return Normalize(low, high)


def _is_log(rows: _Rows, name: str) -> bool:
    """Whether logarithms of a column are equally spaced, or its values span decades."""
    axis = rows.axes.get(name)
    if isinstance(axis, Span) and axis.log:
        return True
    values = rows.column[name]
    low, high = float(np.min(values)), float(np.max(values))
    return low > 0 and high / low > _DECADES and math.isfinite(high)


def _scale(rows: _Rows, name: str, set_scale: Callable[[str], None], axis: Any) -> None:
    """Make an axis of the picture logarithmic, or have it marked at whole numbers."""
    if _is_log(rows, name):
        set_scale("log")
        low, high = float(np.min(rows.column[name])), float(np.max(rows.column[name]))
        if low >= _PLAIN[0] and high <= _PLAIN[1]:
            digits = "23456789" if high < 5 * low else "235" if high < 50 * low else ""
            axis.set_major_formatter(lambda value, _: f"{value:g}")
            axis.set_minor_formatter(
                lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in digits else ""
            )
    elif name in _WHOLE:
        axis.set_major_locator(_at_whole_numbers())


def _at_whole_numbers() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(integer=True, min_n_ticks=1, steps=[1, 2, 5, 10])


def _title(rows: _Rows, shown: set[str | None]) -> str:
    """What is the same in all that is seen."""
    said = [
        "pulse table" if value == "table" else _TITLES[name].format(value)
        for name, value in rows.fixed.items()
        if name not in shown and value == value  # noqa: PLR0124
    ]
    return ", ".join(said)


def _listed(names: Sequence[str]) -> str:
    """Names, and that they vary; empty where there are none."""
    *most, last = names or ("",)
    return f"{', '.join(most)} and {last} vary" if most else f"{last} varies" if last else ""
