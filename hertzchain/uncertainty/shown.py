"""A spread and a validation as text, picture and document."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.report.contents import of_traces
from hertzchain.report.document import (
    Document,
    Failure,
    Table,
    Verdict,
    describe,
    in_prefixed,
    number,
)

if TYPE_CHECKING:
    from rich.console import Console

    from hertzchain.report.picture import Picture


_UNCERTAINTIES = (
    "number", "simulated", "measured", "u run", "u input", "u noise", "error / u_val", "seen from",
    "lower first",
)  # fmt: skip


def of_validation(validation: Any) -> Document:
    """Return the document of a validation, for terminal, page, picture and JUnit."""
    compared, differing, tested = validation.compared, validation.differing, validation.tested
    if len(differing):
        sentence = f"{len(differing)} of {len(compared)} numbers differ by more than 2 u_val."
    elif len(tested):
        most = compared["error_over_u"].max()
        sentence = (
            f"All {len(compared)} numbers agree within {most:.2g} u_val; of {len(tested)} of them a"
            f" difference of {validation.tolerance:.2g} would have been seen."
        )
    else:
        least = compared["seen_from"].min() if len(compared) else float("inf")
        sentence = (
            f"Nothing could have failed: differences are seen from {least:.1%} on, the tolerance is"
            f" {validation.tolerance:.1%}."
        )
    traces = of_traces(validation.judgement)
    reference = validation.judgement.reference
    return replace(
        traces,
        results={"native": replace(reference, scene=validation.spread.scene)},
        overlays=[
            replace(overlay, band=validation.band(k, overlay.time))
            for k, overlay in enumerate(traces.overlays)
        ],
        kind="Validation by measured traces",
        numbers=validation.to_dict,
        checks=(),
        verdict=Verdict(
            None if validation.verdict == "undecided" else validation.verdict == "pass",
            sentence,
            [
                Failure(row.name, f"differs by {row.error_over_u:.2g} u_val", "")
                for row in differing.itertuples(index=False)
            ],
            [*validation.remarks, *validation.judgement.reference.warnings],
        ),
        answers=Table(
            "Comparison errors and uncertainties",
            _UNCERTAINTIES,
            [*map(_row_of_number, compared.itertuples())],
        ),
        remarks=(sentence.removesuffix("."), *validation.remarks),
        facts=[
            ("the run begins at", f"{validation.judgement.shift:.6g} s of the measured clock"),
            ("realisations", f"{len(validation.spread.values):,}"),
            ("uncertain", ", ".join(entry.name for entry in validation.spread.scene.uncertain)),
        ],
    )  # fmt: skip


def _row_of_number(row: Any) -> list[str]:
    parts = row.u_numerical, row.u_input, row.u_measured
    return [
        row.name, number(row.simulated, 5), number(row.measured, 5),
        *(f"{part / abs(row.simulated):.1e}" for part in parts),
        f"{row.error_over_u:.2g}", f"{row.seen_from:.1%}", row.largest,
    ]  # fmt: skip


_SHOWN = 0.005  # least share of a variance that is named
_HEADER = ("result", "", "nominal", "5 %", "95 %", "deviation", "made by")


def print_spread(console: Console, spread: Any, every: bool) -> None:
    """Print the spread of all results, or of contacts only first peaks of three."""
    from hertzchain.report.console import print_prose, table

    console.print(describe(spread.scene), end="\n\n")
    print_prose(console, ", ".join(entry.name for entry in spread.scene.uncertain), "uncertain: ")
    count = f"{len(spread.values):,}, deviations are known to {spread.deviation_error:.1%}"
    print_prose(console, count, "realisations: ")
    for remark in spread.remarks:
        print_prose(console, remark, "remark: ")
    scene = spread.scene
    contacts = {scene.contact_name(number) for number in scene.contacts}
    chosen = {scene.contacts[0], scene.chain.granules // 2 + 1, scene.last_contact}
    chosen = {scene.contact_name(number) for number in chosen}
    rows = [
        _row(spread, k)
        for k, (name, at) in enumerate(spread.names)
        if every or at not in contacts or (at in chosen and name == "first_peak_force_N")
    ]
    console.print()
    console.print(table(_HEADER, rows, left=("result", "", "made by")))
    if not every:
        console.print(f"({len(spread.names) - len(rows)} more results are shown by --all)")


def _row(spread: Any, k: int) -> list[str]:
    name, at = spread.names[k]
    what, _, unit = name.replace("m_s", "m/s").rpartition("_")
    words = what.replace("_", " ")
    middle, deviation = float(spread.nominal[k]), float(spread.deviation[k])
    if np.isnan(middle) or middle == 0:
        return [words, at, "no whole pulse", "", "", "", ""]
    if np.isnan(deviation) or deviation < spread.rtol * abs(middle):
        said = "cut off" if np.isnan(deviation) else "none"
        return [words, at, in_prefixed(middle, unit), "", "", said, ""]
    cells = [in_prefixed(x, unit) for x in (middle, *spread.range_90[:, k].tolist())]
    has_scatter = any(entry.each for entry in spread.scene.uncertain)
    rest = "scatter" if has_scatter else "several together"
    shares = dict(zip(spread.inputs, spread.shares[:, k].tolist(), strict=True))
    # A part of the rest is due to errors of the other shares.
    shares[rest] = 1 - sum(shares.values()) - _SHOWN
    largest = sorted(shares.items(), key=lambda pair: -pair[1])
    parts = ", ".join(f"{key} {share:.0%}" for key, share in largest if share >= _SHOWN)
    return [words, at, *cells, f"{deviation / abs(middle):.2%}", parts]


def plot_spread(spread: Any, size: tuple[float, float] | None = None) -> Picture:
    """Draw first peaks along the chain with their range of 5 to 95 %, and shares of variance."""
    from hertzchain.report.picture import Picture, legend_above

    figure = Picture(size or (7.0, 6.0))
    at = [k for k, (name, _) in enumerate(spread.names) if name == "first_peak_force_N"]
    at = at[: len(spread.scene.contacts)]  # those of gauges follow
    contact = np.array(spread.scene.contacts[: len(at)])
    low, high = spread.range_90[:, at]
    shares = spread.shares[:, at]
    rows = 2 if np.isfinite(shares).any() else 1  # too few realisations give no shares
    above, *below = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    above.fill_between(contact, low, high, color="#56B4E9", alpha=0.6, label="5 to 95 %")
    above.plot(contact, spread.nominal[at], color="black", marker=".", label="the scene itself")
    above.set_ylabel("first peak [N]")
    for axes in below:
        layers = np.nan_to_num(shares)
        rest = np.clip(1 - layers.sum(axis=0), 0, 1)
        axes.stackplot(contact, *layers, rest, labels=[*spread.inputs, "scatter, and together"])
        axes.set(ylabel="share of variance", ylim=(0, 1))
    for axes in figure.axes:
        legend_above(axes)
    figure.axes[-1].set_xlabel("contact")
    return figure
