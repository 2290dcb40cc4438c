"""The judgement of peaks from any code by the reference, contact by contact, with a cause."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hertzchain.arrays import FloatArray, or_none
from hertzchain.engines.native.backend import Native
from hertzchain.engines.native.plan import METHODS
from hertzchain.errors import SceneError, require
from hertzchain.limits import Deadline, check_tolerance
from hertzchain.observables.error_bound import refuse_unstable
from hertzchain.observables.peaks import judged_contacts, largest_difference
from hertzchain.observables.result import Result, context_of
from hertzchain.scene.scene import Scene
from hertzchain.shown import ShownVerdict
from hertzchain.slips import Case, families_for, likely_cause, velocity_verlet

if TYPE_CHECKING:
    import pandas

PATIENCE = 60.0  # time limit of the search for the cause [s]; 60 granules take about 1 s


@dataclass(frozen=True)
class Accuracy:
    """Error of velocity Verlet at a step.

    Parameters
    ----------
    dt
        The step [s].
    interpolated, sampled
        Largest relative difference of its peaks from the reference, for maxima found between the
        steps and for the highest samples.
    """

    dt: float
    interpolated: float
    sampled: float


@dataclass(frozen=True, eq=False, repr=False)
class Judgement(ShownVerdict):
    """Peaks from any code against the reference; true if the verdict is ``pass``.

    Parameters
    ----------
    reference
        Result of the native reference method.
    truth
        The true peaks [N], shape (contacts,): largest forces, or first pulses; NaN where the
        reference is not accurate enough.
    of_first_pulses
        Whether these are first pulses, because more of the given peaks agree with them than with
        the largest forces.
    given
        The given peaks [N], shape (contacts,); NaN where none was given.
    tolerance
        Largest relative difference that passes.
    cause
        Likely cause of failed contacts, a sentence; None where none failed, or no known mistake
        explains the differences.
    hint
        If contacts failed without a known cause, a sentence on the nearest known mistake and its
        residual, or on the size of the noise; None without a search.
    remarks
        Sentences on parts that could not be done; usually empty.
    expected
        Error of velocity Verlet at the given step; None without a step.
    sampling
        Relative error of the given peaks by the interval of the samples that they come from, shape
        (contacts,). It is added to the tolerance; contacts whose error is larger than the tolerance
        are not judged. None for peaks that are not from samples.
    """

    reference: Result
    truth: FloatArray
    of_first_pulses: bool
    given: FloatArray
    tolerance: float
    cause: str | None
    hint: str | None
    remarks: tuple[str, ...]
    expected: Accuracy | None
    sampling: FloatArray | None = None

    @property
    def difference(self) -> FloatArray:
        """Relative differences from the reference, shape (contacts,); NaN where there is none."""
        pressed = self.truth > 0
        ratio = self.given / np.where(pressed, self.truth, 1.0)
        return np.where(pressed, ratio - 1.0, np.nan)

    @property
    def judged(self) -> NDArray[np.bool_]:
        """Contacts that were given and are pressed enough to be judged, shape (contacts,)."""
        judged = judged_peaks(self.truth, self.given)
        return judged if self.sampling is None else judged & (self.sampling <= self.tolerance)

    @property
    def passed(self) -> NDArray[np.bool_]:
        """Judged contacts within the tolerance, shape (contacts,)."""
        allowed = self.tolerance + (0.0 if self.sampling is None else self.sampling)
        return self.judged & (np.abs(self.difference) <= allowed)

    @property
    def missing(self) -> int:
        """Number of contacts that were not given."""
        return int(np.count_nonzero(np.isnan(self.given)))

    @property
    def sampled_too_rarely(self) -> int:
        """Number of contacts that are not judged only because their samples are too far apart."""
        rare = judged_peaks(self.truth, self.given) & ~self.judged
        return int(np.count_nonzero(rare))

    @property
    def largest_difference(self) -> float | None:
        """Largest difference of the judged contacts; None where there are none."""
        judged = self.judged
        return float(np.max(np.abs(self.difference[judged]))) if judged.any() else None

    @property
    def sampling_error(self) -> float | None:
        """The largest ``sampling`` of the judged contacts; None where there is none."""
        judged = self.judged
        has_error = self.sampling is not None and judged.any()
        return float(np.max(self.sampling[judged])) if has_error else None  # type: ignore[index]

    @property
    def verdict(self) -> str:
        """``pass`` if there are judged contacts and all passed, otherwise ``fail``."""
        judged = self.judged
        return "pass" if judged.any() and bool(np.all(self.passed[judged])) else "fail"

    @property
    def compared_with(self) -> str:
        """Kind of expected peaks: ``largest forces`` or ``first pulses``."""
        return "first pulses" if self.of_first_pulses else "largest forces"

    @property
    def summary(self) -> str:
        """One line on the number of failed contacts and the largest difference."""
        judged, largest = int(np.count_nonzero(self.judged)), self.largest_difference
        if largest is None:
            rare = "" if self.sampling is None else " and sampled often enough"
            return f"no contact that was given is pressed enough{rare} to be judged"
        failed = judged - int(np.count_nonzero(self.passed))
        what = "first pulses of the reference" if self.of_first_pulses else "reference"
        return (
            f"{failed} of {judged} contacts differ by more than {self.tolerance:.1e} from the"
            f" {what}, the largest difference is {largest:.1e}"
        )

    @property
    def rows(self) -> list[dict[str, float | int | bool | None]]:
        """Return one row per contact, with contact, given_N, reference_N, difference and passed.

        Values are None where nothing was given, or where a contact is not judged.
        """
        given, difference, truth = map(or_none, (self.given, self.difference, self.truth))
        judged, passed = self.judged, self.passed
        return [
            {
                "contact": int(contact),
                "given_N": given[k],
                "reference_N": truth[k],
                "difference": difference[k],
                "passed": bool(passed[k]) if judged[k] else None,
            }
            for k, contact in enumerate(self.reference.contact)
        ]

    def to_frame(self) -> pandas.DataFrame:
        """Return the rows as a table."""
        import pandas

        return pandas.DataFrame(self.rows)

    def to_dict(self) -> dict[str, Any]:
        """Return the judgement as a JSON object; null stands for a missing value."""
        expected = self.expected
        return {
            "verdict": self.verdict,
            "tolerance": self.tolerance,
            "compared_with": self.compared_with,
            "largest_difference": self.largest_difference,
            "judged": int(np.count_nonzero(self.judged)),
            "not_given": self.missing,
            "cause": self.cause,
            "hint": self.hint,
            "remarks": list(self.remarks),
            "sampling_error": self.sampling_error,
            "velocity_verlet": expected
            and {
                "dt_s": expected.dt,
                "interpolated": expected.interpolated,
                "sampled": expected.sampled,
            },
            "rows": self.rows,
            "reference": self.reference.numbers(),
            **context_of(self.reference.scene),
        }


def judged(
    scene: Scene, peak_force: ArrayLike, tolerance: float, dt: float | None,
    sampling: FloatArray | None, time_limit: float, report_progress: Callable[[str], object],
) -> Judgement:  # fmt: skip
    """Judge peak forces of all contacts [N], shape (contacts,), as ``hertzchain.judge`` does.

    ``sampling`` is the relative error of each by the distance of its samples, shape (contacts,):
    see ``Judgement``.
    """
    check_tolerance(tolerance)
    given = _given(scene, peak_force)
    report_progress("native: the reference method")
    reference = Native("reference", time_limit=time_limit).run(scene)
    scene = reference.scene  # with its end
    truth, of_first = _truth(reference, given, tolerance)
    judged = judged_peaks(truth, given)
    if sampling is not None:
        judged = judged & (sampling <= tolerance)
    expected = None
    remarks = []
    if scene.contact is not None or of_first:
        if dt is not None:
            what = "first pulses" if of_first else "damped contacts"
            remarks.append(f"what velocity Verlet has at that step is not known of {what}")
    elif dt is not None:
        report_progress("native: velocity Verlet at that step")
        expected = _accuracy(reference, dt, time_limit)
    judgement = Judgement(
        reference, truth, of_first, given, float(tolerance), None, None, tuple(remarks), expected,
        sampling,
    )  # fmt: skip
    if np.array_equal(judgement.passed, judged):
        return judgement  # nothing is wrong within this tolerance
    if terms := ", ".join(scene.terms):
        tried = [family.name for family in families_for(scene)]
        remarks.append(f"causes that were tried in a scene with {terms}: {'; '.join(tried)}")
    deadline = Deadline(min(PATIENCE, time_limit))
    allowed_in_all = judgement.tolerance + (judgement.sampling_error or 0.0)
    seen = replace(reference, peak_force=np.nan_to_num(truth))
    case = Case(scene, seen, given, judged, dt, allowed_in_all, deadline, of_first)
    why = likely_cause(case, report_progress)
    remarks += [] if why.remark is None else [why.remark]
    return replace(judgement, cause=why.cause, hint=why.hint, remarks=tuple(remarks))


def judged_peaks(truth: FloatArray, given: FloatArray) -> NDArray[np.bool_]:
    """Return contacts that have a peak and are pressed enough to be judged, shape (contacts,)."""
    return np.logical_and(np.isfinite(given), judged_contacts(np.nan_to_num(truth)))


def _truth(reference: Result, given: FloatArray, tolerance: float) -> tuple[FloatArray, bool]:
    """Return the forces to judge against [N], and whether they are first pulses.

    They are the largest forces, or the first pulses if more of the given peaks agree with these, or
    if the ratios to these vary ten times less (the unit may be wrong). NaN stands where the error
    is more than a tenth of the tolerance; if it is everywhere, a SceneError.
    """
    candidates = [(reference.peak_force, reference.peak_errors)]
    first, errors = reference.first_pulses, reference.errors
    if first is not None and errors is not None and errors.first is not None:
        candidates.append((first.force, errors.first))
    sure = [np.where(10 * error <= tolerance, force, np.nan) for force, error in candidates]
    least = min(float(np.nanmin(error, initial=np.inf)) for _, error in candidates)
    allowed = f"must be at least 10 times the error of the reference, {least:.1e}"
    require(tolerance >= 10 * least, "tolerance", tolerance, allowed)

    judged = [judged_peaks(truth, given) for truth in sure]
    if not judged[0].any() or not judged[-1].any():
        is_first = bool(judged[-1].any() and not judged[0].any())
        return sure[is_first], is_first
    both = judged[0] & judged[-1]

    def agreement(truth: FloatArray, judged: NDArray[np.bool_]) -> tuple[int, float]:
        agree = np.abs(given[judged] / truth[judged] - 1) <= tolerance
        # Least ratio of given to true peaks, in place of smaller ones
        ratio = np.maximum(given[both] / truth[both], 1e-9)
        return int(np.count_nonzero(agree)), float(np.std(np.log(ratio))) if both.any() else 0.0

    (most, vary), (agree, less) = map(agreement, (sure[0], sure[-1]), (judged[0], judged[-1]))
    # Fewest contacts whose spread decides what was given, and ratio of the spreads for that
    is_nearer = bool(np.count_nonzero(both) >= 3 and less < 0.1 * vary)
    is_first = agree > most or (agree == most and is_nearer)
    return sure[is_first], is_first


def _given(scene: Scene, given: ArrayLike) -> FloatArray:
    """Return checked peaks of all contacts [N], NaN for missing ones."""
    contacts = len(scene.contacts)
    allowed = f"must be a file, a mapping from contacts, or an array of {contacts} forces"
    try:
        values = np.asarray(given, np.float64)
    except (TypeError, ValueError, OverflowError):
        raise SceneError("peak_force", given, allowed) from None
    require(values.shape == (contacts,), "number of peak_force", values.size, allowed)
    allowed = "must be given for at least one contact"
    require(not np.all(np.isnan(values)), "peak_force", None, allowed)
    possible = bool(np.all(np.isnan(values) | (np.isfinite(values) & (values >= 0))))
    allowed = "must be finite and at least 0 [N], which presses, or NaN where there is none"
    require(possible, "peak_force", None, allowed)
    return values.copy()


def _accuracy(reference: Result, dt: float, time_limit: float) -> Accuracy:
    """Measure the error of velocity Verlet at a step; steps end at the corners of the pulse."""
    scene = reference.scene
    legs = scene.schedule(dt)
    refuse_unstable(scene, legs, METHODS["velocity-verlet"].interval, "velocity-verlet")
    interpolated, sampled = (
        largest_difference(peaks, reference.peak_force)
        for peaks in velocity_verlet(scene, legs, Deadline(time_limit))
    )
    return Accuracy(dt, interpolated, sampled)
