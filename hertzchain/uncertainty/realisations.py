"""Realisations of a scene whose values are uncertain: quasi-random, and the same for one seed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from statistics import NormalDist
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.scene.chain import Chain
from hertzchain.scene.scene import Scene
from hertzchain.scene.uncertain import Uncertain
from hertzchain.sweeps.columns import is_whole
from hertzchain.sweeps.keys import base_values, changed, full_name
from hertzchain.sweeps.points import sobol_points

MOST_DRAWN = 21_201
"""Most independent values of a realisation: dimensions of SciPy's Sobol sequences."""


class Realisations:
    """Scenes with drawn values.

    Parameters
    ----------
    scene
        The scene, with its uncertain values.
    count
        Number of realisations, a power of 2.
    seed
        Seed of the scrambled Sobol sequence.

    Raises
    ------
    SceneError
        If nothing is uncertain, for keys that cannot vary, and for a share of a value that is 0.
    """

    def __init__(self, scene: Scene, count: int, seed: int) -> None:
        allowed = "nothing is uncertain: add [uncertainty] or [scatter] to the scene"
        require(len(scene.uncertain) > 0, "scene", None, allowed)
        self._base = replace(scene, uncertain=())
        self.inputs = [one for one in scene.uncertain if not one.each]
        self._scatter = [one for one in scene.uncertain if one.each]
        keys = [full_name(one.key, self._base) for one in self.inputs]
        for key in keys:
            allowed = "is no quantity of the experiment, and cannot be uncertain"
            require(not (is_whole(key) or key.startswith("run.")), key, None, allowed)
        known = base_values(self._base, keys)
        self._middle = {
            key: _middle(one, known[key]) for one, key in zip(self.inputs, keys, strict=True)
        }
        granules, size = scene.chain.granules, len(keys)
        drawn = size + granules * len(self._scatter)
        allowed = f"must be at most {MOST_DRAWN}, those of all granules counted"
        require(drawn <= MOST_DRAWN, "uncertain values", drawn, allowed)
        unit = sobol_points(drawn, seed, np.arange(count))
        unit = np.clip(unit, 1e-12, 1 - 1e-12)  # a normal value at 0 is infinite
        self.drawn = unit[:, :size]
        """Places in the distributions of the inputs, 0 to 1, shape (count, inputs)."""
        self._of_granules = unit[:, size:].reshape(count, len(self._scatter), granules)

    def __iter__(self) -> Iterator[Scene]:
        """Yield the scene of each realisation; a SceneError says which values it cannot have."""
        for places, of_granules in zip(self.drawn, self._of_granules, strict=True):
            drawn = zip(self._middle.items(), self.inputs, places, strict=True)
            values = {key: _drawn(one, key, middle, at) for (key, middle), one, at in drawn}
            try:
                yield changed(
                    self._base,
                    {key: float(value) for key, value in values.items()},
                    partial(self._scattered, places=of_granules),
                )
            except SceneError as problem:
                allowed = f"{problem.allowed}; what is drawn is not: lower its uncertainty"
                raise SceneError(problem.key, problem.value, allowed) from None

    def _scattered(self, chain: Chain, places: FloatArray) -> Chain:
        """Return a chain whose granules differ; fixed ones rest."""
        columns: dict[str, Any] = {}
        for one, place in zip(self._scatter, places, strict=True):
            key = one.key.partition(".")[2]
            middle = np.broadcast_to(getattr(chain, key), chain.granules)
            values = _drawn(one, key, middle, place)
            if key == "velocity":
                values = np.where(chain.fixed, 0.0, values)
            columns[key] = tuple(values)
        return replace(chain, **columns) if columns else chain


def _middle(one: Uncertain, value: Any) -> float:
    is_number = isinstance(value, float) and np.isfinite(value)
    require(is_number, one.key, value, "has no value of its own in this scene: write it there")
    allowed = "is 0, of which there is no share: give its uncertainty in its unit"
    require(not one.relative or value != 0, one.key, None, allowed)
    return float(value)


def standard(one: Uncertain, place: FloatArray) -> FloatArray:
    """Deviations from the middle, over ``size``, at quantiles from 0 to 1."""
    if one.uniform:
        return np.asarray(2 * place - 1)
    normal = np.vectorize(NormalDist().inv_cdf, otypes=[float])  # SciPy takes long to load
    return np.asarray(normal(place))


def _drawn(one: Uncertain, key: str, middle: FloatArray | float, place: FloatArray) -> FloatArray:
    """Return values at places in the distribution; a gap below 0 becomes 0."""
    size = one.size * np.abs(middle) if one.relative else one.size
    values = np.asarray(middle + size * standard(one, place))
    return np.maximum(values, 0.0) if key.endswith("gap") else values
