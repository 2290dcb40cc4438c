"""Figure 3: peaks over the contacts, and p, for some LM_ratio and the three profiles.

(a) peak forces F_i,max, (b) the number p of granules in the transition, simulated and by Eq. 3,
with n = 4 and F0 = 100 N. The LM_ratio are chosen: those of the paper's figure are not in the text
that we have. docs/validation.md has two commands that draw (b) without Eq. 3.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure

from hertzchain.scene.shocks import PROFILES
from validation.script import BACKENDS, RATIO_COLOURS, Row, Script, largest, new_figure, row
from validation.script import PROFILES as PROFILE_STYLES
from validation.shipped import eq3
from validation.transition_scenes import (
    CHOSEN,
    FORCE,
    MOMENTUM_RATIOS,
    by_scene,
    found_by_both,
    scene_of,
    transitions,
)

TITLE = "Figure 3: peaks and p over LM_ratio"
_APART = 0.03  # LM_ratio by which the marks of the profiles are drawn apart

ESTIMATES = "as fractions: both error estimates together"
WHOLE = "p is a whole number"
COUNTED = "a count; found, and native's peaks are right to 1e-10"
EQ3 = (
    "granules; two decimals, as found, and native's F_SW is right to 1e-10. Most is 1.27 (cosine,"
    " LM_ratio 1.4: the change after contact 5 is 0.945 %); in the paper's Table 2 it is 1.0"
)
UNITY = "found; a pulse does not leave all of its momentum in the first wave"
STEADY = "found; less than 1 % from one contact to the next is steady by definition"

_NOT_RAISED = {"cosine": 1, "triangular": 0, "cosine-triangular": 0}
"""Steps of LM_ratio from 1 on that do not raise p: of the cosine from 1.0 to 1.4."""

_EQ3 = {
    "cosine": (0.43, 0.34, 0.22, 0.00, 1.27, 0.27, -0.03),
    "triangular": (0.43, 0.34, 0.22, 0.00, 0.25, -0.78, -0.10),
    "cosine-triangular": (0.43, 0.34, 0.22, 0.00, 0.25, 0.23, -0.09),
}
"""p of Eq. 3 less that simulated, over MOMENTUM_RATIOS."""

_UNITY = {"cosine": 1.0070, "triangular": 0.9619, "cosine-triangular": 0.9665}
"""F_SW / F0 at LM_ratio 1."""


def measure(quick: bool, with_lammps: bool) -> pandas.DataFrame:
    """What ``transitions`` gives, and eq3: p by Eq. 3 with the simulated F_SW, not rounded."""
    table = transitions(quick, with_lammps)
    lengths = [
        eq3(scene_of(*key), force) if np.isfinite(force) else np.nan
        for *key, force in table[["profile", "momentum_ratio", "wave_force_N"]].itertuples(
            index=False
        )
    ]
    return table.assign(eq3=lengths)


def promises(table: pandas.DataFrame) -> list[Row]:
    """LAMMPS against native; Eq. 3 against p; p and F_SW over LM_ratio."""
    rows = []
    native = table[table["backend"] == "native"]
    for scene, exact, frame in found_by_both(table):
        off = np.max(np.abs(frame["peak_force_N"].array / exact["peak_force_N"].array - 1))
        bound = frame["error_estimate"].iloc[0] + exact["error_estimate"].iloc[0]
        rows.append(row(f"{scene}: peaks less native's", "lammps", off, 0, bound, ESTIMATES))
        p = exact["p"].iloc[0]
        rows.append(row(f"{scene}: p, native's", "lammps", frame["p"].iloc[0], p, 0, WHOLE))
    for scene, frame in by_scene(table, "native").items():
        profile, ratio, by_eq3, p = frame[["profile", "momentum_ratio", "eq3", "p"]].iloc[0]
        expected = _EQ3[profile][MOMENTUM_RATIOS.index(ratio)]
        what = f"{scene}: p by Eq. 3 less p simulated (paper: 0)"
        rows.append(row(what, "native", by_eq3 - p, expected, 0.006, EQ3))
    return [*rows, *_over_ratios(native[native["contact"] == 2]), *_far(native)]


def _over_ratios(native: pandas.DataFrame) -> Iterator[Row]:
    """Return checks of p and F_SW over LM_ratio."""
    for profile in PROFILES:
        frame = native[native["profile"] == profile].sort_values("momentum_ratio")
        reached, flat = frame["momentum_ratio"].to_numpy()[1:], np.diff(frame["p"]) <= 0
        what = f"{profile}: steps of LM_ratio that do not raise p"
        above, below = int(np.sum(flat[reached > 1])), int(np.sum(flat[reached <= 1]))
        expected = _NOT_RAISED[profile]
        yield row(f"{what}, above 1 (paper: 0)", "native", above, expected, 0, COUNTED)
        yield row(f"{what}, up to 1 (paper: 0; p is 5)", "native", below, 3, 0, COUNTED)
    for ratio in MOMENTUM_RATIOS:
        frame = native[native["momentum_ratio"] == ratio]
        high = frame["wave_force_N"] / FORCE
        if ratio != 1:
            what = f"LM_ratio {ratio}: profiles of 3 with F_SW above F0"
            expected = 3 if ratio > 1 else 0
            yield row(what, "native", int(np.sum(high > 1)), expected, 0, COUNTED)
            continue
        for profile, value in zip(frame["profile"], high, strict=True):
            what = f"LM_ratio 1: F_SW / F0, {profile} (paper: 1)"
            yield row(what, "native", value, _UNITY[profile], 1e-4, UNITY)


def _far(native: pandas.DataFrame) -> list[Row]:
    """Return checks that the peaks are constant after the transition."""
    if native.empty:
        return []
    last = native[native["contact"] == native["contact"].max()]
    change = largest(last["peak_force_N"] / last["wave_force_N"] - 1)
    what = f"peak {last['contact'].iloc[0]:.0f} over F_SW less 1, largest (paper: 0)"
    return [row(what, "native", change, 0.0208, 0.0001, STEADY)]


def draw(table: pandas.DataFrame) -> Figure:
    """(a) a panel for each profile; (b) p beside Eq. 3."""
    figure = new_figure(10, 8, f"Figure 3: {CHOSEN}")
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.2, 1))
    top, bottom = parts
    panels = top.subplots(1, 3, sharey=True)
    for axes, profile in zip(panels, PROFILES, strict=True):
        _draw_peaks(axes, table[table["profile"] == profile])
        axes.set_title(f"(a) {PROFILE_STYLES[profile]['label']}", fontsize="medium")
    panels[0].set_ylabel("peak force [N]")
    panels[0].legend(fontsize="small", loc="upper left")
    _draw_p(bottom.subplots(), table[table["contact"] == 2])
    return figure


def _draw_peaks(axes: Any, table: pandas.DataFrame) -> None:
    axes.axhline(FORCE, color="0.6", linewidth=0.8)
    for ratio, colour in RATIO_COLOURS.items():
        frame = table[table["momentum_ratio"] == ratio]
        if frame.empty:
            continue
        for backend, style in BACKENDS.items():
            seen = frame[frame["backend"] == backend]
            look = style | {"color": colour, "label": None, "markersize": 0.6 * style["markersize"]}
            if backend == "native":
                look["linestyle"] = "-"
            axes.plot(seen["contact"], seen["peak_force_N"], **look)
        end = (frame["contact"].max(), frame["peak_force_N"].iloc[-1])
        axes.annotate(
            f"{ratio:g}", end, (6, 0), textcoords="offset points", va="center", color=colour,
            fontsize="small",
        )  # fmt: skip
    for style in BACKENDS.values():
        axes.plot([], [], **style)
    axes.annotate(
        "LM_ratio", (0.99, 0.995), xycoords="axes fraction", ha="right", va="top", fontsize="small"
    )
    axes.set(xlabel="contact i", xlim=(1, 22.5), ylim=(0, 190), xticks=[2, 5, 10, 15, 20])
    axes.grid(alpha=0.3)


def _draw_p(axes: Any, table: pandas.DataFrame) -> None:
    for shift, (profile, style) in zip((-_APART, 0, _APART), PROFILE_STYLES.items(), strict=True):
        frame = table[table["profile"] == profile]
        native, lammps = (frame[frame["backend"] == backend] for backend in BACKENDS)
        look = {"color": style["color"], "linestyle": "none", "marker": style["marker"]}
        axes.plot(native["momentum_ratio"] + shift, native["p"], **look, label=style["label"])
        axes.plot(
            lammps["momentum_ratio"] + shift, lammps["p"], **look, markersize=11, fillstyle="none"
        )
        dashes = look | {"linestyle": "--", "marker": "", "linewidth": 1}
        axes.plot(native["momentum_ratio"], native["eq3"], **dashes)
    axes.plot([], [], "s", color="0.3", markersize=11, fillstyle="none", label="open: LAMMPS")
    axes.plot([], [], "--", color="0.3", label="Eq. 3, F_SW simulated")
    axes.set(xlabel="LM_ratio", ylabel="p, granules", title="(b) granules in the transition")
    note = f"profiles are drawn {_APART} apart"
    axes.annotate(note, (0.99, 0.01), xycoords="axes fraction", ha="right", fontsize="small")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")


SCRIPT = Script(
    TITLE,
    "Do both backends find the same peaks and p, and does p go with LM_ratio as the paper says?",
    "native, LAMMPS, Eq. 3",
    measure, promises, draw,
)  # fmt: skip

if __name__ == "__main__":
    SCRIPT.main()
