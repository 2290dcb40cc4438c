"""The sweeps that the paper's figures share: a scene that fails in one is a row."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import pandas as pd
import pytest

import hertzchain as hc
from validation import figure3, figure4, figure5, transition_scenes


def test_a_scene_that_fails_in_its_sweep_is_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    swept = functools.cache(transition_scenes._swept)  # figures have scenes in common

    def hasty(backend: hc.Native | hc.Lammps, ratios: Sequence[float]) -> pd.DataFrame:
        if isinstance(backend, hc.Native):
            return swept(backend, ratios)
        # Two LM_ratio of which one cannot be done in time, as if LAMMPS had measured both.
        late = swept(hc.Native("reference", time_limit=1e-9), ratios[:1])
        return pd.concat([late, swept(hc.Native("reference"), (2.0,))]).assign(backend="lammps")

    monkeypatch.setattr(transition_scenes, "_swept", hasty)
    for module in (figure3, figure4, figure5):
        table = module.SCRIPT.measure(True, True)
        failed = [entry for entry in module.SCRIPT.promises(table) if not entry.passed]
        assert len(failed) == 3
        assert all("time limit" in entry.what for entry in failed)
        assert len(module.SCRIPT.draw(table).axes) >= 2
