"""Scenes, grids and helpers that tests of sweeps share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

import hertzchain as hc
from hertzchain.sweeps.columns import COUNTS, is_result
from hertzchain.sweeps.design import Design
from tests.conftest import paper_scene

SHORT = paper_scene("cosine", 1.0, 2.0, granules=12)
GRID: dict[str, Any] = {
    "shock.momentum_ratio": "0.5:2:4:log",
    "shock.profile": ["cosine", "triangular"],
}


def all_scenes(found: Design) -> list[hc.Scene]:
    numbers = np.arange(found.scenes)
    parameters = found.parameters(numbers)
    return [found.scene(parameters, k) for k in numbers.tolist()]


def rows_of(sweep: hc.Sweep) -> tuple[list[dict[str, Any]]]:
    """The rows of a table, in the form that ``zip(*...)`` takes."""
    return (sweep.to_frame().to_dict("records"),)  # type: ignore[return-value]


def has_numbers(row: Mapping[Any, Any], numbers: Mapping[str, Any]) -> None:
    """Assert that a row has all these numbers, as far as it has their columns, and no others."""
    for name in filter(is_result, row):
        found, wanted = None if pd.isna(row[name]) else row[name], numbers.get(name)
        assert found == (wanted or None if name in COUNTS else wanted), name
