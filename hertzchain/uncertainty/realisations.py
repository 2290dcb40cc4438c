"""Realisations of a scene whose values are uncertain: quasi-random, and the same for one seed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.scene.chain import Chain
from hertzchain.scene.scene import Scene
from hertzchain.scene.uncertain import Uncertain
from hertzchain.sweeps.columns import is_whole
from hertzchain.sweeps.keys import base_values, changed, full_name

MOST_DRAWN = 21_201
"""Most independent values of a realisation: dimensions of SciPy's Sobol sequences."""


class Realisations:
    """Scenes with drawn values.

    Parameters
    ----------
    scene
        The scene, with what is uncertain of it.
    count
        How many are drawn, a power of 2.
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
        self.scatter = [one for one in scene.uncertain if one.each]
        self._keys = [full_name(one.key, self._base) for one in self.inputs]
        for key in self._keys:
            allowed = "is no quantity of the experiment, and cannot be uncertain"
            require(not (is_whole(key) or key.startswith("run.")), key, None, allowed)
        known = base_values(self._base, self._keys)
        self._middle = np.array([_middle(one, known[key]) for one, key in self._pairs])
        granules = scene.chain.granules
        drawn = len(self.inputs) + granules * len(self.scatter)
        allowed = f"must be at most {MOST_DRAWN}, those of all granules counted"
        require(drawn <= MOST_DRAWN, "uncertain values", drawn, allowed)
        unit = _unit_cube(drawn, count, seed)
        size = len(self.inputs)
        self.drawn = unit[:, :size]
        """Places in the distributions of the inputs, 0 to 1, shape (count, inputs)."""
        self._scatter = unit[:, size:].reshape(count, len(self.scatter), granules)

    @property
    def _pairs(self) -> Iterator[tuple[Uncertain, str]]:
        return zip(self.inputs, self._keys, strict=True)

    def __iter__(self) -> Iterator[Scene]:
        """Yield the scene of each realisation; a SceneError says which values it cannot have."""
        for place, scatter in zip(self.drawn, self._scatter, strict=True):
            values = {
                key: float(_at(one, middle, at))
                for (one, key), middle, at in zip(self._pairs, self._middle, place, strict=True)
            }
            values = {key: max(x, 0.0) if key.endswith("gap") else x for key, x in values.items()}
            try:
                scene = changed(self._base, values)
                yield replace(scene, chain=self._scattered(scene.chain, scatter))
            except SceneError as problem:
                allowed = f"{problem.allowed}; what is drawn is not: lower its uncertainty"
                raise SceneError(problem.key, problem.value, allowed) from None

    def _scattered(self, chain: Chain, places: FloatArray) -> Chain:
        """Return a chain whose granules differ; a gap below 0 is none, and fixed ones rest."""
        columns: dict[str, Any] = {}
        for one, place in zip(self.scatter, places, strict=True):
            key = one.key.partition(".")[2]
            middle = np.broadcast_to(getattr(chain, key), chain.granules)
            values = _at(one, middle, place)
            if key == "velocity":
                values = np.where(chain.fixed, 0.0, values)
            columns[key] = tuple(np.maximum(values, 0.0) if key == "gap" else values)
        return replace(chain, **columns) if columns else chain


def _middle(one: Uncertain, value: Any) -> float:
    is_number = isinstance(value, float) and np.isfinite(value)
    require(is_number, one.key, value, "has no value of its own in this scene: write it there")
    allowed = "is 0, of which there is no share: give its uncertainty in its unit"
    require(not one.relative or value != 0, one.key, None, allowed)
    return float(value)


def _unit_cube(dimensions: int, count: int, seed: int) -> FloatArray:
    from scipy.stats import qmc

    sobol = qmc.Sobol(dimensions, scramble=True, seed=seed)
    unit = sobol.random_base2(count.bit_length() - 1)
    return np.asarray(np.clip(unit, 1e-12, 1 - 1e-12))  # a normal value at 0 is infinite


def standard(one: Uncertain, place: Array) -> FloatArray:
    """Deviations from the middle, over ``size``, at places in the distribution from 0 to 1."""
    from scipy.special import ndtri

    return np.asarray(2 * place - 1 if one.uniform else ndtri(place))


def _at(one: Uncertain, middle: Array | float, place: Array) -> FloatArray:
    size = one.size * np.abs(middle) if one.relative else one.size
    return np.asarray(middle + size * standard(one, place))
