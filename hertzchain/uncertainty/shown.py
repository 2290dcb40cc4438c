"""The spread of results on a terminal, and as a picture along the chain.

``Spread`` shows itself by these functions, which therefore do not import it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.report.facts import describe, in_prefixed
from hertzchain.report.picture import Picture, fit_letters

if TYPE_CHECKING:
    from rich.console import Console

_WORDS = {
    "peak_force_N": ("largest force", "N"),
    "first_peak_force_N": ("first peak", "N"),
    "arrival_time_s": ("arrival", "s"),
    "first_width_s": ("width", "s"),
    "speed_m_s": ("speed", "m/s"),
    "height_N": ("height", "N"),
}
"""What results are called, and their units."""

_SHOWN = 0.005  # least share of a variance that is named
_BAND = "#56B4E9"  # Okabe and Ito's sky blue
_HEADER = ("result", "", "nominal", "5 %", "95 %", "deviation", "made by")


def printed(spread: Any) -> str:
    """What ``run --uncertainty`` prints of a spread, without colours."""
    from hertzchain.report.console import plain_text

    return plain_text(lambda console: print_spread(console, spread, every=False))


def print_spread(console: Console, spread: Any, every: bool) -> None:
    """Print the spread of a few results, or of all."""
    from hertzchain.report.console import print_prose, table

    console.print(describe(spread.scene), end="\n\n")
    for label, text in _head(spread):
        print_prose(console, text, f"{label}: ")
    rows = [_row(spread, k) for k in _shown(spread, every)]
    console.print()
    console.print(table(_HEADER, rows, left=("result", "", "made by")))
    if not every:
        console.print(f"({len(spread.names) - len(rows)} more results are shown by --all)")


def _shown(spread: Any, every: bool) -> list[int]:
    """Places of the results that are shown: of the contacts, first peaks of three."""
    if every:
        return list(range(len(spread.names)))
    scene = spread.scene
    chosen = {2, scene.chain.granules // 2 + 1, scene.last_contact}
    contacts = {scene.contact_name(number) for number in chosen}
    others = {scene.contact_name(number) for number in scene.contacts}
    return [
        k
        for k, (name, at) in enumerate(spread.names)
        if at not in others or (at in contacts and name == "first_peak_force_N")
    ]


def _head(spread: Any) -> list[tuple[str, str]]:
    count = f"{len(spread.values):,}, deviations are known to {spread.deviation_error:.1%}"
    return [
        ("uncertain", ", ".join(one.name for one in spread.scene.uncertain)),
        ("realisations", count),
        *(("remark", one) for one in spread.remarks),
    ]


def _row(spread: Any, k: int) -> list[str]:
    name, at = spread.names[k]
    words, unit = _WORDS[name]
    middle, deviation = float(spread.nominal[k]), float(spread.deviation[k])
    if np.isnan(middle) or middle == 0:
        return [words, at, "no whole pulse", "", "", "", ""]
    if np.isnan(deviation):
        return [words, at, in_prefixed(middle, unit), "", "", "cut off", ""]
    if deviation < spread.rtol * abs(middle):
        return [words, at, in_prefixed(middle, unit), "", "", "none", ""]
    known = [in_prefixed(x, unit) for x in (middle, *spread.range_90[:, k].tolist())]
    shares = list(zip(spread.inputs, spread.shares[:, k].tolist(), strict=True))
    rest = 1 - sum(share for _, share in shares)
    has_scatter = any(one.each for one in spread.scene.uncertain)
    shares.append(("scatter" if has_scatter else "several together", rest - _SHOWN))
    shares.sort(key=lambda one: -one[1])
    parts = ", ".join(f"{key} {share:.0%}" for key, share in shares if share >= _SHOWN)
    return [words, at, *known, f"{deviation / abs(middle):.2%}", parts]


def plot_spread(spread: Any, size: tuple[float, float] | None = None) -> Picture:
    """Draw first peaks along the chain with the range of 5 to 95 %, and shares of the variance."""
    figure = Picture(size or (7.0, 6.0))
    above, below = figure.subplots(2, 1, sharex=True)
    at = [k for k, (name, _) in enumerate(spread.names) if name == "first_peak_force_N"]
    at = at[: len(spread.scene.contacts)]  # those of gauges follow
    contact = np.array(spread.scene.contacts[: len(at)])
    low, high = spread.range_90[:, at]
    above.fill_between(contact, low, high, color=_BAND, alpha=0.6, label="5 to 95 %")
    above.plot(contact, spread.nominal[at], color="black", marker=".", label="the scene itself")
    above.set_ylabel("first peak [N]")
    above.legend()
    shares = np.nan_to_num(spread.shares[:, at])
    rest = np.clip(1 - shares.sum(axis=0), 0, 1)
    below_it = np.zeros(len(at))
    for name, share in zip([*spread.inputs, "scatter, and together"], [*shares, rest], strict=True):
        below.bar(contact, share, width=1.0, bottom=below_it, label=name)
        below_it = below_it + share
    below.set(xlabel="contact", ylabel="share of the variance", ylim=(0, 1))
    below.legend()
    fit_letters(figure)
    return figure
