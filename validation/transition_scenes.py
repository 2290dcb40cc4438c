"""The scenes of Figures 3, 4 and 5, and their peaks in one table.

The paper's steel, F0 = 100 N and n = 4, as under Figures 3 and 4. The LM_ratio of its figures are
not in the text that we have: these seven are chosen, three below and three above 1, over the range
of its tables.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator

import numpy as np
import pandas

import hertzchain as hc
from hertzchain.errors import RunFailed
from hertzchain.scene.shocks import PROFILES, profile_named
from validation.shipped import STEEL

MOMENTUM_RATIOS = (0.3, 0.5, 0.7, 1.0, 1.4, 2.0, 2.5)
"""Chosen."""

CHOSEN = "n = 4, F0 = 100 N; the LM_ratio are chosen"
"""Text in every figure on these scenes."""

FORCE = 100.0
"""F0 [N]."""

DURATION_RATIO = 4.0
"""n."""

GRANULES = 40
"""The transition takes 10 at most; with 60 no peak up to contact 20 differs by 1e-11."""

CONTACTS = 20
"""The last contact in the table: twice as far as the longest transition."""

_NAMES = {
    "shock.profile": "profile",
    "shock.momentum_ratio": "momentum_ratio",
    "transition_granules": "p",
    "solitary_wave_force_N": "wave_force_N",
}
"""Names of the sweep's columns in the table."""

_COLUMNS = (
    *("profile", "momentum_ratio", "backend", "contact", "peak_force_N", "error_estimate"),
    *("p", "wave_force_N"),
)

_QUICK = (1.4,)
"""LM_ratio of what LAMMPS simulates in the quick form."""


def scene_of(profile: str, momentum_ratio: float) -> hc.Scene:
    """One of the scenes."""
    pulse = hc.Pulse(profile_named(profile), FORCE, DURATION_RATIO, momentum_ratio=momentum_ratio)
    return hc.Scene(hc.Chain(granules=GRANULES, **STEEL), pulse)


def transitions(quick: bool, with_lammps: bool) -> pandas.DataFrame:
    """Peaks and p of all scenes, from a sweep of each backend.

    In the quick form LAMMPS simulates three of them; native, which takes a second for all, all.
    LAMMPS is extrapolated from two runs, right to 1e-6 all the same. Columns profile,
    momentum_ratio, backend, contact (2 to 20), peak_force_N, error_estimate (of the peaks,
    relative), p, wave_force_N (F_SW, of contact p + 1).
    """
    tables = [_swept(hc.Native("reference"), MOMENTUM_RATIOS)]
    if with_lammps:
        ratios = _QUICK if quick else MOMENTUM_RATIOS
        tables.append(_swept(hc.Lammps(extrapolated=True), ratios))
    return pandas.concat(tables, ignore_index=True)


def in_transition(
    quick: bool, with_lammps: bool, beyond: int, add: Callable[[pandas.DataFrame], pandas.DataFrame]
) -> pandas.DataFrame:
    """``transitions`` without LM_ratio 1, up to contact p and some beyond.

    Columns are added to each scene of each backend that ran.
    """
    table = transitions(quick, with_lammps)
    table = table[table["momentum_ratio"] != 1]
    inside = table["contact"] <= table["p"] + beyond
    groups = table[inside].groupby(["profile", "momentum_ratio", "backend"], sort=False)
    return pandas.concat([add(frame) for _, frame in groups], ignore_index=True)


@functools.cache
def _swept(backend: hc.Native | hc.Lammps, ratios: tuple[float, ...]) -> pandas.DataFrame:
    """Return a backend's results for all profiles with some LM_ratio, once for all figures.

    RunFailed where a scene did not run, or its transition does not end.
    """
    vary: dict[str, Iterable[str | float]] = {
        "shock.profile": list(PROFILES),
        "shock.momentum_ratio": ratios,
    }
    swept = hc.sweep(scene_of("cosine", 1.0), vary, backends=[backend], peaks=True)
    scenes = swept.to_frame().rename(columns=_NAMES)
    failed = scenes[scenes["wave_force_N"].isna()]
    if len(failed):
        first = failed.fillna({"failure": "the transition does not end"}).iloc[0]
        scene = name(first["profile"], first["momentum_ratio"])
        raise RunFailed(f"{scene}: {first['backend']}: {first['failure']}")
    peaks = swept.peaks_to_frame()
    seen = peaks[peaks["contact"] <= CONTACTS]
    return scenes.merge(seen, how="left", on=["scene", "backend"])[[*_COLUMNS]]


def by_scene(table: pandas.DataFrame, backend: str) -> dict[str, pandas.DataFrame]:
    """Return a backend's results for each scene, by the scene's name in rows."""
    frame = table[table["backend"] == backend]
    names = [name(*key) for key in zip(frame["profile"], frame["momentum_ratio"], strict=True)]
    return {str(scene): some for scene, some in frame.groupby(np.array(names, object), sort=False)}


def found_by_both(
    table: pandas.DataFrame,
) -> Iterator[tuple[str, pandas.DataFrame, pandas.DataFrame]]:
    """Yield the name of each scene run by both backends, with native's and LAMMPS's results."""
    native = by_scene(table, "native")
    for scene, frame in by_scene(table, "lammps").items():
        if scene in native:
            yield scene, native[scene], frame


def name(profile: str, momentum_ratio: float) -> str:
    """Return the name of a scene in rows."""
    return f"{profile}, LM_ratio {momentum_ratio:g}"
