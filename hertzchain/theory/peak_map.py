"""Peak forces of a long uniform chain without a simulation: interpolation of a precomputed map.

In natural units the peaks F_i / F0 depend on profile, n, LM_ratio and i only (similarity). The map
holds ln(F_i / F0) of contacts 2 to 80 and of the far field on a grid over ln LM_ratio and 1/n, for
each profile of Table 1. validation/make_map.py computes it with the native solver.

A peak is the largest of several local maxima of a contact's force over time; where another maximum
becomes the largest, the peak has a kink as a function of LM_ratio and n. Kinks limit interpolation,
so the grid is fine. The file holds only the differences from the prediction of a grid twice as
coarse (Deslauriers and Dubuc, Constr. Approx. 5 (1989) 49): zeros where the peaks are smooth.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import require
from hertzchain.scene.keys import Positive
from hertzchain.scene.shocks import PROFILES

FILE = Path(__file__).with_name("peak_map.npz")

MOMENTUM_RATIOS = (0.1, 10.0)
"""The smallest and the largest LM_ratio of the map."""

DURATION_RATIOS = (2.0, 50.0)
"""The smallest and the largest n of the map."""

LAST_CONTACT = 80
"""The last contact of the map, which begins with contact 2. p is 47 at most, and changes beyond
contact 60 are below 0.25 %, so that contacts beyond the map cannot make p larger.
"""

PEAK_ERROR = 1e-2
"""Upper bound of the relative error of a peak (chosen).

The largest error at 20,000 random points is 4.6e-3, at a kink of an early contact under a long
pulse; 1 peak of 1000 is off by more than 3e-4.
"""

FAR_FIELD_ERROR = 1e-5
"""Upper bound of the relative error of the far-field force (chosen).

The largest that was measured is 4e-6, at LM_ratio 10 and n 2.
"""

STEP = 2e-6  # unit of the numbers in the file; its ln F differ from the simulated ones by less

_SECOND_DIFFERENCES = np.vstack(
    [
        np.kron([[1, -2, 1, 0], [0, 1, -2, 1]], np.eye(4)),
        np.kron(np.eye(4), [[1, -2, 1, 0], [0, 1, -2, 1]]),
    ]
)
"""Second differences of 4 by 4 nodes: eight along LM_ratio, then eight along n, shape (16, 16)."""

_COARSE_NODES = (13, 4)
_DOUBLINGS = 5
_SHAPE = tuple((nodes - 1) * 2**_DOUBLINGS + 1 for nodes in _COARSE_NODES)
_COLUMNS = LAST_CONTACT  # contacts 2 to 80 and the far field


@dataclass(frozen=True, eq=False)
class Peaks:
    """Peaks of a long chain at one LM_ratio and n, in units of F0."""

    peak_force: FloatArray  # F_2 ... F_80, shape (79,); relative error PEAK_ERROR
    far_field_force: float  # limit far from the shock; relative error FAR_FIELD_ERROR
    # Largest error of abs(F_{k+1} - F_k) / F_{k+1}, k = 2 ... 79, shape (78,)
    change_error: FloatArray


def grid() -> tuple[FloatArray, FloatArray]:
    """LM_ratio and n of the nodes, shapes (385,) and (97,)."""
    low, high = map(math.log, MOMENTUM_RATIOS)
    ratio = np.exp(np.linspace(low, high, _SHAPE[0]))
    inverse = np.linspace(1 / DURATION_RATIOS[0], 1 / DURATION_RATIOS[1], _SHAPE[1])
    return ratio, 1 / inverse


def outside(momentum_ratio: Positive, duration_ratio: Positive) -> str | None:
    """Return why an LM_ratio and n lie outside the map; None inside it."""
    (low, high), (short, long) = MOMENTUM_RATIOS, DURATION_RATIOS
    if low <= momentum_ratio <= high and short <= duration_ratio <= long:
        return None
    return f"the map of peaks has LM_ratio {low:g} to {high:g} and n {short:g} to {long:g}"


def peaks(profile: str, momentum_ratio: Positive, duration_ratio: Positive) -> Peaks:
    """Return the peaks by cubic interpolation of ln F, in about 50 us once the profile is loaded.

    Parameters
    ----------
    profile
        One of Table 1.
    momentum_ratio, duration_ratio
        LM_ratio and n, within MOMENTUM_RATIOS and DURATION_RATIOS.

    Raises
    ------
    SceneError
        For a profile, LM_ratio or n outside the map.
    """
    require(profile in PROFILES, "profile", profile, f"must be one of {', '.join(PROFILES)}")
    reason = outside(momentum_ratio, duration_ratio)
    require(reason is None, "LM_ratio, n", (momentum_ratio, duration_ratio), f"{reason}")
    low, high = map(math.log, MOMENTUM_RATIOS)
    slow, fast = 1 / DURATION_RATIOS[0], 1 / DURATION_RATIOS[1]
    i, row_weight = _stencil((math.log(momentum_ratio) - low) / (high - low), _SHAPE[0])
    j, column_weight = _stencil((1 / duration_ratio - slow) / (fast - slow), _SHAPE[1])
    around = table(profile)[i : i + 4, j : j + 4].reshape(16, _COLUMNS).astype(np.float64)
    force = np.exp(np.outer(row_weight, column_weight).ravel() @ around)
    bend = np.abs(_SECOND_DIFFERENCES @ (around[:, 1:-1] - around[:, :-2]))
    along_rows, along_columns = bend[:8].max(0), bend[8:].max(0)
    # Largest error of a change over nearby second differences; measured 0.17
    kinks = (3 / 8) * (along_rows + along_columns)
    # Error of a change at a node: of two forces 3e-6 each, times 2.7 near the rim
    return Peaks(force[:-1], float(force[-1]), kinks + 1.6e-5)


def _stencil(position: float, nodes: int) -> tuple[int, FloatArray]:
    """Return the first of the four nodes around a position from 0 to 1, and Lagrange's weights."""
    at = position * (nodes - 1)
    first = min(max(math.floor(at) - 1, 0), nodes - 4)
    x = at - first
    a, b, c, d = x, x - 1, x - 2, x - 3
    return first, np.array([-b * c * d / 6, a * c * d / 2, -a * b * d / 2, a * b * c / 6])


@functools.cache
def table(profile: str) -> NDArray[np.float32]:
    """ln(F / F0) on the whole grid, shape (385, 97, 80): contacts 2 to 80, last the far field.

    The file is read when a profile is first used, in about 0.2 s.
    """
    with np.load(FILE) as file:
        values = decode(file[profile])
    values.setflags(write=False)
    return values


def decode(counts: NDArray[np.int32]) -> NDArray[np.float32]:
    """Return the grid from the numbers of the file, shape (nodes times columns,) [STEP].

    The file has the coarsest grid first, then the differences of each refinement, as
    validation/make_map.py writes them.
    """
    start = _COLUMNS * _COARSE_NODES[0] * _COARSE_NODES[1]
    taken = start

    def correct(predicted: FloatArray, _: tuple[slice, ...]) -> FloatArray:
        nonlocal taken
        piece = counts[taken : taken + predicted.size]
        taken += predicted.size
        return predicted + STEP * piece.reshape(predicted.shape)

    coarse = counts[:start].reshape(_COLUMNS, *_COARSE_NODES).astype(np.float64)
    values = refine(STEP * coarse, correct)
    return np.ascontiguousarray(np.moveaxis(values, 0, 2), np.float32)


def refine(
    coarse: FloatArray, correct: Callable[[FloatArray, tuple[slice, ...]], FloatArray]
) -> FloatArray:
    """Refine the coarsest grid, shape (columns, 13, 4), to the finest, shape (columns, 385, 97).

    The nodes along LM_ratio and along n are doubled in turn. ``correct`` gets the values that cubic
    interpolation predicts halfway between known nodes, and their places on the finest grid; it
    returns the true values there.
    """
    values = coarse
    for doubling in reversed(range(_DOUBLINGS)):
        fine, twice = 2**doubling, 2 ** (doubling + 1)
        for axis in (1, 2):
            along = slice(fine, None, twice)
            across = slice(None, None, twice if axis == 1 else fine)
            where = (slice(None), along, across) if axis == 1 else (slice(None), across, along)
            between = correct(_halfway(values, axis), where)
            values = _interleaved(values, between, axis)
    return values


def _halfway(values: FloatArray, axis: int) -> FloatArray:
    """Interpolate halfway between neighbours along an axis, which gives one value less."""
    v = np.moveaxis(values, axis, 0)
    first = (5 * v[0] + 15 * v[1] - 5 * v[2] + v[3]) / 16
    inner = (9 * (v[1:-2] + v[2:-1]) - v[:-3] - v[3:]) / 16
    last = (5 * v[-1] + 15 * v[-2] - 5 * v[-3] + v[-4]) / 16
    return np.moveaxis(np.concatenate([first[None], inner, last[None]]), 0, axis)


def _interleaved(neighbours: FloatArray, between: FloatArray, axis: int) -> FloatArray:
    """Merge neighbours along an axis with the values halfway between them."""
    shape = list(neighbours.shape)
    shape[axis] += between.shape[axis]
    finer = np.empty(shape)
    along = np.moveaxis(finer, axis, 0)
    along[::2], along[1::2] = np.moveaxis(neighbours, axis, 0), np.moveaxis(between, axis, 0)
    return finer
