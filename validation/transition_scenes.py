"""The scenes of Figures 3, 4 and 5, and their peaks in one table.

The paper's steel, F0 = 100 N and n = 4, as under Figures 3 and 4. The LM_ratio of its figures are
not in the text that we have: these seven are chosen, three below and three above 1, over the range
of its tables.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas

import hertzchain as hc
from hertzchain.shock import PROFILES
from validation.rows import STEEL, Row, did_not_run, problems_as_text, simulate

MOMENTUM_RATIOS = (0.3, 0.5, 0.7, 1.0, 1.4, 2.0, 2.5)
"""Chosen."""

CHOSEN = "n = 4, F0 = 100 N; the LM_ratio are chosen"
"""What every figure says of them."""

FORCE = 100.0
"""F0 [N]."""

DURATION_RATIO = 4.0
"""n."""

GRANULES = 40
"""The transition takes 10 at most; with 60 no peak up to contact 20 differs by 1e-11."""

CONTACTS = 20
"""The last contact in the table: twice as far as the longest transition."""

_QUICK = (("triangular", 0.5), ("cosine", 1.4), ("cosine-triangular", 2.5))
"""What LAMMPS simulates in the quick form."""


def scene_of(profile: str, momentum_ratio: float) -> hc.Scene:
    """One of the scenes."""
    pulse = hc.Pulse(profile, FORCE, DURATION_RATIO, momentum_ratio=momentum_ratio)
    return hc.Scene(hc.Chain(granules=GRANULES, **STEEL), pulse)


def transitions(quick: bool, with_lammps: bool, label: str) -> pandas.DataFrame:
    """Peaks and p of all scenes.

    Parameters
    ----------
    quick
        LAMMPS simulates three of them; native, which takes a second for all, all.
    with_lammps
        Whether to run LAMMPS, too: extrapolated from two runs, right to 1e-6 all the same.
    label
        What the progress bar says.

    Returns
    -------
    Columns profile, momentum_ratio, backend, contact (2 to 20), peak_force_N, error_estimate (of
    the peaks, relative), p, wave_force_N (F_SW, of contact p + 1), problem: why there are no peaks,
    or no p, in the one line that stands there instead.
    """
    keys = [(profile, ratio) for profile in PROFILES for ratio in MOMENTUM_RATIOS]
    scenes = {f"{profile} {ratio}": scene_of(profile, ratio) for profile, ratio in keys}
    chosen = [f"{profile} {ratio}" for profile, ratio in (_QUICK if quick else keys)]
    lammps = hc.Lammps(extrapolated=True)
    found = simulate({name: scenes[name] for name in chosen}, label, with_lammps, lammps)
    rest = {name: scene for name, scene in scenes.items() if name not in chosen}
    found |= simulate(rest, label, False)
    tables = [
        _transition(profile, ratio, backend, found[f"{profile} {ratio}", backend])
        for backend in ("native", "lammps")
        for profile, ratio in keys
        if (f"{profile} {ratio}", backend) in found
    ]
    return pandas.concat(tables, ignore_index=True)


def _transition(
    profile: str, ratio: float, backend: str, result: hc.Result | hc.HertzchainError
) -> pandas.DataFrame:
    names = {"profile": profile, "momentum_ratio": ratio, "backend": backend}
    if isinstance(result, hc.HertzchainError):
        return pandas.DataFrame([names | {"problem": str(result)}])
    p, wave_force = result.transition_granules, result.solitary_wave.peak_force
    if p is None or wave_force is None:
        return pandas.DataFrame([names | {"problem": "the transition does not end"}])
    contact = np.arange(2, CONTACTS + 1)
    return pandas.DataFrame(
        names
        | {
            "contact": contact,
            "peak_force_N": result.peak_force[contact - 2],
            "error_estimate": result.error_estimate,
            "p": p,
            "wave_force_N": wave_force,
            "problem": "",
        }
    )


def separated(table: pandas.DataFrame) -> tuple[pandas.DataFrame, list[Row]]:
    """What has run, and a row that fails for each scene that has not.

    Parameters
    ----------
    table
        As ``transitions`` makes it, or as it was read from a file.
    """
    table = problems_as_text(table)
    failed = table["problem"] != ""
    rows = [
        did_not_run(name(entry["profile"], entry["momentum_ratio"]), entry["backend"], said)
        for (_, entry), said in zip(table[failed].iterrows(), table["problem"][failed], strict=True)
    ]
    return table[~failed], rows


def by_scene(table: pandas.DataFrame, backend: str) -> dict[str, pandas.DataFrame]:
    """What a backend has found of each scene, by the name that rows give it."""
    own = table[table["backend"] == backend]
    names = [name(*key) for key in zip(own["profile"], own["momentum_ratio"], strict=True)]
    return {str(scene): some for scene, some in own.groupby(np.array(names, object), sort=False)}


def found_by_both(
    table: pandas.DataFrame,
) -> Iterator[tuple[str, pandas.DataFrame, pandas.DataFrame]]:
    """Name of each scene that both backends have run, what native has found, what LAMMPS has."""
    native = by_scene(table, "native")
    for scene, own in by_scene(table, "lammps").items():
        if scene in native:
            yield scene, native[scene], own


def name(profile: str, momentum_ratio: float) -> str:
    """How rows call a scene."""
    return f"{profile}, LM_ratio {momentum_ratio:g}"
