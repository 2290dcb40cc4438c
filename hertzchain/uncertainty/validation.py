"""Measured traces against a scene with uncertain values: a verdict with three uncertainties."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from hertzchain.limits import TIME_LIMIT
from hertzchain.observables.result import context_of
from hertzchain.scene.scene import SceneLike, to_scene
from hertzchain.showing import ShownVerdict, ShowProgress
from hertzchain.uncertainty.spread import REALISATIONS, Spread, name_of, spread
from hertzchain.verdict.traces.judging import PEAK, WIDTH, Number, TraceJudgement, judge_traces

if TYPE_CHECKING:
    import pandas

    from hertzchain.report.document import Document

COVERED = 2.0
"""Allowed differences in validation uncertainties: one normal value of 22 is beyond."""

_SURE = 1.645
"""Deviations of a normal distribution with 95 % on one side."""

SEEN = 0.1
"""Default of the relative difference that should be detected (chosen)."""


@dataclass(frozen=True)
class Compared:
    """A measured number against that of the scene, as in ASME V&V 20.

    Parameters
    ----------
    number
        The two numbers, with the bound on the error of the run and the deviation by noise.
    input
        Standard uncertainty by those of the scene's values.
    """

    number: Number
    input: float

    @property
    def parts(self) -> dict[str, float]:
        """Standard uncertainties; the bound of the run counts as half a uniform width."""
        numerical = self.number.error / math.sqrt(3)
        return {"numerical": numerical, "input": self.input, "measured": self.number.deviation}

    @property
    def uncertainty(self) -> float:
        """The validation uncertainty u_val, of all three together, if independent."""
        return math.hypot(*self.parts.values())

    @property
    def error(self) -> float:
        """The comparison error, simulated less measured."""
        return self.number.simulated - self.number.measured

    @property
    def ratio(self) -> float:
        """Comparison error over u_val, without sign."""
        return abs(self.error) / self.uncertainty

    @property
    def allowed(self) -> float:
        """The largest difference that the uncertainties explain, in the unit of the number."""
        return COVERED * self.uncertainty

    @property
    def seen_from(self) -> float:
        """Least relative difference that would be detected in 95 of 100 experiments."""
        return (COVERED + _SURE) * self.uncertainty / abs(self.number.simulated)

    @property
    def largest(self) -> str:
        """The largest of the uncertainties, the first to reduce."""
        return max(self.parts, key=lambda name: self.parts[name])

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as a JSON object."""
        return {
            "name": self.number.name,
            "simulated": self.number.simulated,
            "measured": self.number.measured,
            "error": self.error,
            **{f"u_{name}": part for name, part in self.parts.items()},
            "u_validation": self.uncertainty,
            "error_over_u": self.ratio,
            "seen_from": self.seen_from,
            "largest": self.largest,
        }


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
        Each number with its uncertainties.
    left_out
        Names of numbers that some realisations do not have: they end too early.
    """

    judgement: TraceJudgement
    spread: Spread
    tolerance: float
    compared: tuple[Compared, ...]
    left_out: tuple[str, ...] = ()

    @property
    def _document(self) -> Document:
        from hertzchain.uncertainty.document import of_validation

        return of_validation(self)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on what could not be compared, and other remarks; usually empty."""
        said = f"not compared, as some realisations end too early: {', '.join(self.left_out)}"
        return (*self.judgement.remarks, *self.spread.remarks, *[said] * bool(self.left_out))

    @property
    def differing(self) -> tuple[Compared, ...]:
        """Numbers whose comparison error is more than the uncertainties explain."""
        return tuple(row for row in self.compared if row.ratio > COVERED)

    @property
    def tested(self) -> tuple[Compared, ...]:
        """Numbers for which a difference as large as the tolerance would be detected."""
        return tuple(row for row in self.compared if row.seen_from <= self.tolerance)

    @property
    def verdict(self) -> str:
        """``fail`` if a number differs; ``undecided`` if none could; otherwise ``pass``."""
        if self.differing:
            return "fail"
        return "pass" if self.tested else "undecided"

    def to_dict(self) -> dict[str, Any]:
        """Return the validation as a JSON object."""
        return {
            "verdict": self.verdict,
            "tolerance": self.tolerance,
            "compared": [row.to_dict() for row in self.compared],
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
    compared, left_out = [], []
    of_kinds = {PEAK: "first_peak_force_N", WIDTH: "first_width_s"}
    for number in judgement.numbers:
        result = of_kinds.get(number.kind, "arrival_time_s")
        values = [uncertainty.values_of(result, name_of(gauge)) for gauge in number.gauges]
        drawn = values[0] - values[1] if len(values) == 2 else values[0]
        of_input = float(np.std(drawn, ddof=1))  # NaN if any realisation has none
        if math.isnan(of_input):
            left_out.append(number.name)
        else:
            compared.append(Compared(number, of_input))
    return Validation(judgement, uncertainty, float(tolerance), tuple(compared), tuple(left_out))
