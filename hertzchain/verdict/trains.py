"""The judgement of measured trains: several pulses of a contact or a granule, matched in order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.backend import Native
from hertzchain.errors import SceneError, is_positive, require
from hertzchain.limits import TIME_LIMIT, TOLERANCE
from hertzchain.observables.result import Result, context_of
from hertzchain.observables.trains import COLUMNS, Train
from hertzchain.scene.scene import Scene, SceneLike, to_scene
from hertzchain.scene.terms import Gauge
from hertzchain.showing import ShownVerdict, ShowProgress, telling
from hertzchain.verdict.check import Check, Kind, unmeasured, within
from hertzchain.verdict.results.reading import table_of

if TYPE_CHECKING:
    import pandas

_ADVICE = "the scene is not what was measured, or the calibration is not what was given"
FORCE = Kind("force of pulse {} [N]", _ADVICE)
WIDTH = Kind("width of pulse {} [s]", _ADVICE)
LATER = Kind(
    "pulse {} after the one before [s]",
    "the scene has another speed: try E, density, damping, loads",
)

_PLACES, _FORCE = ("contact", "granule"), "force_N"
_TIMES = {"time_s": LATER, "width_s": WIDTH}


@dataclass(frozen=True, eq=False, repr=False)
class TrainJudgement(ShownVerdict):
    """Measured trains against the reference; true if the verdict is ``pass``.

    Parameters
    ----------
    reference
        Result of the native reference method.
    tolerance
        Largest relative difference that passes.
    checks
        Force of each measured pulse, and widths and times between pulses where they were given.
    """

    reference: Result
    tolerance: float
    checks: tuple[Check, ...]

    @property
    def verdict(self) -> str:
        """``pass`` if all measured pulses passed, otherwise ``fail``."""
        return "pass" if all(check.passed for check in self.checks) else "fail"

    def to_dict(self) -> dict[str, Any]:
        """Return the judgement as a JSON object."""
        return {
            "verdict": self.verdict,
            "tolerance": self.tolerance,
            "checks": [check.to_dict() for check in self.checks],
            "reference": self.reference.numbers(),
            **context_of(self.reference.scene),
        }


def is_train(names: Sequence[str]) -> bool:
    """Return whether a table with these columns has pulses."""
    return _FORCE in names and "peak_force_N" not in names and not {*_PLACES}.isdisjoint(names)


def judge_trains(
    scene: SceneLike,
    pulses: Path | str | pandas.DataFrame,
    *,
    tolerance: float = TOLERANCE,
    time_limit: float = TIME_LIMIT,
    progress: ShowProgress = None,
) -> TrainJudgement:
    """Judge trains of measured pulses by the reference, pulse by pulse in the order of the rows.

    Parameters
    ----------
    scene
        The scene that was measured, or the path of its file.
    pulses
        A pandas table, or a CSV file, with the columns contact or granule (its number; empty in
        rows of the other) and force_N, the dynamic force of a pulse; perhaps time_s and width_s, as
        ``Result.pulses`` has them. Of times only those between pulses matter. Weak pulses may be
        left out, but not stronger ones before them: the measured forces are matched with those that
        fit best, in order. [uncertainty] of the scene is not used.
    tolerance
        Largest relative difference that passes; between 0 and 1.
    time_limit
        Time limit of each run of the reference [s].
    progress
        True for a line in the terminal on what is being done, or a function that is called with
        each such line.

    Raises
    ------
    SceneError
        For anything but a scene, contacts and granules that it does not have, or numbers that are
        no pulses.
    RunFailed
        If the reference cannot be computed.
    """
    allowed = "must be a number above 0 and below 1"
    require(is_positive(tolerance) and tolerance < 1, "tolerance", tolerance, allowed)
    scene = to_scene(scene)
    measured = _measured(scene, pulses)
    gauges = (gauge for gauge in measured if gauge.granule is not None)
    with telling(progress) as report_progress:
        report_progress("native: the reference method")
        reference = Native("reference", time_limit=time_limit).run(
            replace(scene, gauges=tuple(dict.fromkeys((*scene.gauges, *gauges))))
        )
        report_progress("native: all pulses")
        trains = {train.gauge: train for train in reference.trains}
    checks = [
        check
        for gauge, columns in measured.items()
        for check in _checks(trains[gauge], columns, tolerance)
    ]
    return TrainJudgement(reference, float(tolerance), tuple(checks))


def _measured(scene: Scene, pulses: Any) -> dict[Gauge, dict[str, FloatArray]]:
    """Return the columns of the pulses of each contact or granule; SceneError if unusable."""
    import pandas

    table = pulses if hasattr(pulses, "columns") else table_of(Path(pulses))
    file = None if hasattr(pulses, "columns") else str(pulses)
    if not is_train(list(table.columns)):
        raise SceneError("pulses", None, "must have the columns contact or granule, and force_N",
                         file=file)  # fmt: skip
    for name in table.columns:
        if name not in (*_PLACES, _FORCE, *COLUMNS):
            allowed = f"must be {', '.join((*_PLACES, _FORCE, *_TIMES))}"
            raise SceneError("column", name, allowed, file=file)
    columns = [name for name in (*_PLACES, _FORCE, *_TIMES) if name in table]
    places = [name for name in columns if name in _PLACES]
    cells = table[columns].reset_index(drop=True).replace(r"^\s*$", np.nan, regex=True)
    table = cells.apply(pandas.to_numeric, errors="coerce").astype(float)
    for name in columns:
        is_needed = np.full(len(table), name in (_FORCE, "time_s")) | cells[name].notna()
        is_possible = np.isfinite(table[name]) & ((table[name] > 0) | (name == "time_s"))
        wrong = np.flatnonzero(is_needed & ~is_possible)
        if wrong.size:
            key, value = f"{name} in row {int(wrong[0]) + 1}", cells[name].iloc[wrong[0]]
            allowed = "must be a finite number" + (" above 0" if name != "time_s" else "")
            raise SceneError(key, value, allowed, file=file)
    wrong = np.flatnonzero(table[places].notna().sum(axis=1) != 1)
    if wrong.size:
        key = f"row {int(wrong[0]) + 1}"
        raise SceneError(key, None, "must have a contact or a granule, and not both", file=file)
    trains: dict[Gauge, dict[str, FloatArray]] = {}
    for key in _PLACES:
        if key not in places:
            continue
        for number, rows in table[table[key].notna()].groupby(key, sort=False):
            try:
                gauge = Gauge(**{key: int(number) if float(number).is_integer() else number})
                gauge.check(
                    scene.chain.granules, scene.wall is not None, scene.near_wall is not None
                )
            except SceneError as wrong_place:
                where = f"{key} in row {rows.index[0] + 1}"
                raise SceneError(where, number, wrong_place.allowed, file=file) from None
            train = {name: rows[name].to_numpy() for name in columns if name not in _PLACES}
            if "time_s" in train and np.any(np.diff(train["time_s"]) <= 0):
                allowed = f"must increase from pulse to pulse of {gauge.place}"
                raise SceneError("time_s", None, allowed, file=file)
            trains[gauge] = train
    require(bool(trains), "pulses", None, "has no row with the number of a contact or granule")
    return trains


def _checks(train: Train, measured: dict[str, FloatArray], tolerance: float) -> list[Check]:
    """Return the checks of the pulses of one contact or granule."""
    true, place, forces = train.columns, train.gauge.place, measured[_FORCE]
    match = _in_order(forces, true[_FORCE])
    reason = "what was asked for, and the error of the reference"
    checks = []
    for k, at in enumerate(match.tolist()):
        error = true["force_error"][at] * true[_FORCE][at]
        expected = [(FORCE, float(forces[k]), float(true[_FORCE][at]), float(error))]
        if "width_s" in measured and measured["width_s"][k] > 0 and true["width_s"][at] > 0:
            off = float(true["width_error_s"][at])
            expected.append((WIDTH, float(measured["width_s"][k]), float(true["width_s"][at]), off))
        if "time_s" in measured and k:
            before = match[k - 1]
            off = float(true["time_error_s"][at] + true["time_error_s"][before])
            later = float(true["time_s"][at] - true["time_s"][before])
            expected.append((LATER, float(np.diff(measured["time_s"])[k - 1]), later, off))
        for kind, value, right, off in expected:
            named = Kind(kind.name.format(k + 1), kind.advice)
            if off < tolerance * abs(right) or (kind is LATER and np.isfinite(off)):
                checks.append(within(named, place, value, right, tolerance * right + off, reason))
            else:
                why = "the reference itself does not know this to the tolerance"
                checks.append(unmeasured(named, place, why))
    least, last = (1 + tolerance) * np.min(forces), match.max(initial=0)
    for at in set(np.flatnonzero(true[_FORCE][:last] > least).tolist()) - {*match.tolist()}:
        kind = Kind(f"pulse of {true[_FORCE][at]:.4g} N at {true['time_s'][at]:.4g} s", _ADVICE)
        why = "it was not measured, though a weaker one was"
        checks.append(unmeasured(kind, place, why))
    count = true[_FORCE].size
    why = f"the reference has {count} pulses there: leave out noise, or lengthen end_time"
    more = range(match.size + 1, forces.size + 1)
    return [*checks, *(unmeasured(Kind(FORCE.name.format(k), _ADVICE), place, why) for k in more)]


def _in_order(measured: FloatArray, true: FloatArray) -> NDArray[np.intp]:
    """Return the places of true forces that fit measured ones best, in the same order.

    If fewer forces are true than measured, the first ones are matched one by one.
    """
    measured = measured[: true.size]
    off = np.abs(np.log(measured[:, np.newaxis] / true))
    for k in range(1, measured.size):  # the least sum up to each place
        least = np.minimum.accumulate(off[k - 1])
        off[k, 1:] += least[:-1]
        off[k, :k] = np.inf
    match, end = np.zeros(measured.size, np.intp), true.size
    for k in reversed(range(measured.size)):
        end = match[k] = int(np.argmin(off[k, :end]))
    return match
