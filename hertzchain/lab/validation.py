"""Measured traces against a scene with uncertain values: a verdict with three uncertainties."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.lab.spread import REALISATIONS, Spread, name_of, spread
from hertzchain.limits import TIME_LIMIT
from hertzchain.observables.result import context_of
from hertzchain.progress import ShowProgress
from hertzchain.report.contents import of_traces
from hertzchain.report.document import Document, Failure, Table, Verdict, number
from hertzchain.scene.scene import SceneLike, to_scene
from hertzchain.shown import ShownVerdict
from hertzchain.verdict.traces import PEAK, WIDTH, Number, TraceJudgement, judge_traces

if TYPE_CHECKING:
    import pandas


COVERED = 2.0
"""Allowed differences in validation uncertainties: one normal value of 22 is beyond."""

_SURE = 1.645
"""Deviations of a normal distribution with 95 % on one side."""

SEEN = 0.1
"""Default of the relative difference that should be detected (chosen)."""


def compared_numbers(numbers: Sequence[Number], of_input: Sequence[float]) -> pandas.DataFrame:
    """Return measured numbers against those of the scene, as in ASME V&V 20: a row for each.

    ``of_input`` has standard uncertainties by those of the scene's values. Columns are name;
    simulated, measured and their difference error; standard uncertainties u_numerical (the bound
    of the run counts as half a uniform width), u_input, u_measured, and u_validation, of all three
    if independent; error_over_u, without sign; seen_from, the least relative difference that would
    be detected in 95 of 100 experiments; largest, the uncertainty to reduce first.
    """
    import pandas

    rows = [(each.name, each.simulated, each.measured, each.error, each.deviation)
            for each in numbers]  # fmt: skip
    names = ["name", "simulated", "measured", "bound", "deviation"]
    table = pandas.DataFrame(rows, columns=names).astype(dict.fromkeys(names[1:], float))
    parts = pandas.DataFrame(
        {
            "numerical": table["bound"] / math.sqrt(3),
            "input": np.asarray(of_input, float),
            "measured": table["deviation"],
        }
    )
    together, error = np.sqrt((parts**2).sum(axis=1)), table["simulated"] - table["measured"]
    return table[names[:3]].assign(
        error=error,
        **parts.add_prefix("u_"),
        u_validation=together,
        error_over_u=error.abs() / together,
        seen_from=(COVERED + _SURE) * together / table["simulated"].abs(),
        largest=parts.columns.to_numpy()[np.argmax(parts.to_numpy(), axis=1)],
    )


@dataclass(frozen=True, eq=False, repr=False)
class Validation(ShownVerdict):
    """Measured traces against an uncertain scene; true if the verdict is ``pass``.

    Parameters
    ----------
    judgement
        The traces against the scene as it stands, with the overlay and all remarks.
    spread
        Spread of the scene's results by the uncertain values.
    tolerance
        A number is tested if a relative difference as large as this would be detected.
    compared
        Each number with its uncertainties: see ``compared_numbers``.
    left_out
        Names of numbers that some realisations do not have: they end too early.
    """

    judgement: TraceJudgement
    spread: Spread
    tolerance: float
    compared: pandas.DataFrame
    left_out: tuple[str, ...] = ()

    @property
    def _document(self) -> Document:
        return of_validation(self)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on what could not be compared, and other remarks; usually empty."""
        said = f"not compared, as some realisations end too early: {', '.join(self.left_out)}"
        return (*self.judgement.remarks, *self.spread.remarks, *[said] * bool(self.left_out))

    def band(self, gauge: int, time: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return the range of a gauge's force at times [N] in 90 % of the realisations.

        The reference is as high, wide and late as the first pulse of each. The clock is shifted to
        the mean of the gauges, as that of the recording is. None if a realisation has no whole
        pulse.
        """
        expected = self.judgement.expected
        readings = expected.readings
        names = "first_peak_force_N", "first_width_s", "arrival_time_s"
        force, width, arrival = (
            np.array([self.spread.values_of(name, name_of(read.gauge)) for read in readings])
            for name in names
        )
        if not np.isfinite([force, width, arrival]).all():
            return None
        read = readings[gauge]
        late = arrival - np.array([[each.arrival] for each in readings])
        begins = read.arrival + late[gauge] - late.mean(axis=0)
        drawn = [
            high
            / read.force
            * expected.at(gauge, read.arrival + (time - begin) * read.width / wide)
            for high, wide, begin in zip(force[gauge], width[gauge], begins, strict=True)
        ]
        low, high = np.percentile(drawn, (5, 95), axis=0)
        return low, high

    @property
    def differing(self) -> pandas.DataFrame:
        """Numbers whose comparison error is more than the uncertainties explain."""
        return self.compared[self.compared["error_over_u"] > COVERED]

    @property
    def tested(self) -> pandas.DataFrame:
        """Numbers for which a difference as large as the tolerance would be detected."""
        return self.compared[self.compared["seen_from"] <= self.tolerance]

    @property
    def verdict(self) -> str:
        """``fail`` if a number differs; ``undecided`` if no number could; otherwise ``pass``."""
        if len(self.differing):
            return "fail"
        return "pass" if len(self.tested) else "undecided"

    def to_dict(self) -> dict[str, Any]:
        """Return the validation as a JSON object."""
        return {
            "verdict": self.verdict,
            "tolerance": self.tolerance,
            "compared": self.compared.to_dict("records"),
            "realisations": len(self.spread.values),
            "remarks": list(self.remarks),
            **context_of(self.spread.scene),
        }


def validate(
    scene: SceneLike,
    traces: Path | str | pandas.DataFrame | Sequence[Path | str | pandas.DataFrame],
    *,
    columns: Mapping[str, str] | None = None,
    tolerance: float = SEEN,
    shift: bool = True,
    realisations: Annotated[int, spread] = REALISATIONS,
    time_limit: float = TIME_LIMIT,
    progress: ShowProgress = None,
) -> Validation:
    """Compare measured forces over time with a scene that has uncertain values.

    First pulses are compared: their heights, widths, and times between gauges. Differences are
    compared with the uncertainties of run, input and noise together.

    Parameters
    ----------
    scene
        The scene that was measured, with something ``uncertain``, or the path of its file.
    traces, columns, shift, progress
        As for ``judge_traces``.
    time_limit
        Time limit of each run of the reference, and of all realisations together [s].
    tolerance
        A relative difference that should be detected.
    realisations
        As for ``spread``.

    Raises
    ------
    SceneError
        As ``judge_traces`` and ``spread``.
    """
    scene = to_scene(scene)
    judgement = judge_traces(
        replace(scene, uncertain=()), traces, columns=columns, tolerance=tolerance, shift=shift,
        time_limit=time_limit, progress=progress,
    )  # fmt: skip
    measured = replace(judgement.reference.scene, uncertain=scene.uncertain)
    uncertainty = spread(measured, realisations, time_limit=time_limit, progress=progress)
    compared, of_input, left_out = [], [], []
    of_kinds = {PEAK: "first_peak_force_N", WIDTH: "first_width_s"}
    for each in judgement.numbers:
        result = of_kinds.get(each.kind, "arrival_time_s")
        values = [uncertainty.values_of(result, name_of(gauge)) for gauge in each.gauges]
        drawn = values[0] - values[1] if len(values) == 2 else values[0]
        deviation = float(np.std(drawn, ddof=1))
        if math.isnan(deviation):  # a realisation has none
            left_out.append(each.name)
        else:
            compared.append(each)
            of_input.append(deviation)
    table = compared_numbers(compared, of_input)
    return Validation(judgement, uncertainty, float(tolerance), table, tuple(left_out))


_UNCERTAINTIES = (
    "number", "simulated", "measured", "u run", "u input", "u noise", "error / u_val", "seen from",
    "lower first",
)  # fmt: skip


def of_validation(validation: Validation) -> Document:
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
                Failure(str(row.name), f"differs by {row.error_over_u:.2g} u_val", "")
                for row in differing.itertuples(index=False)
            ],
            [*validation.remarks, *validation.judgement.reference.warnings],
        ),
        tables=[
            Table(
                "Comparison errors and uncertainties", "Comparison errors and uncertainties",
                _UNCERTAINTIES, [*map(_row_of_number, compared.itertuples())],
            )
        ],
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
