"""The table of a sweep: one row per scene and backend, filled in as scenes are done."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError
from hertzchain.observables.peaks import times_of_peaks
from hertzchain.observables.result import Result
from hertzchain.observables.transition import solitary_waves, transitions
from hertzchain.scene.validity import IMPOSSIBLE_OVERLAP, overlap_ratio
from hertzchain.sweeps.design import PARAMETERS

if TYPE_CHECKING:
    import pandas

    from hertzchain.engines.native import Batch
    from hertzchain.scene.scene import Scene
    from hertzchain.theory import Prediction

NUMBERS = (
    "solitary_wave_force_N",
    "far_field_force_N",
    "speed_m_s",
    "largest_peak_force_N",
    "overlap_ratio",
    "error_estimate",
    "eq3_transition_granules",
)
COUNTS = ("transition_granules", "largest_peak_contact", "force_evaluations")

FOUND = (
    "transition_granules",
    "solitary_wave_force_N",
    "far_field_force_N",
    "speed_m_s",
    "largest_peak_force_N",
    "largest_peak_contact",
    "overlap_ratio",
    "eq3_transition_granules",
    "error_estimate",
    "force_evaluations",
    "failure",
)
"""What is found, in the order of the table, behind the parameters."""

COLUMNS = ("scene", "backend", *PARAMETERS, *FOUND)
"""Of the table."""

PEAK_COLUMNS = ("scene", "backend", "contact", "peak_force_N", "peak_time_s")
"""Of the table of peaks."""


class Rows:
    """Rows that are being filled in.

    Parameters
    ----------
    numbers
        Of the scenes, shape (rows,).
    backend
        Who measures them.
    parameters
        Of the scenes, by name, shape (rows,); rise time and LM_ratio are filled in.
    peaks
        Whether the peaks of all contacts are kept.
    """

    def __init__(
        self,
        numbers: NDArray[np.int64],
        backend: str,
        parameters: Mapping[str, NDArray[Any]],
        peaks: bool,
    ) -> None:
        self.numbers, self.backend = numbers, backend
        self._parameters = dict(parameters)
        self._found: dict[str, FloatArray] = {
            name: np.full(numbers.size, np.nan) for name in NUMBERS
        }
        self._counts = {name: np.zeros(numbers.size, np.int64) for name in COUNTS}
        self._failure: NDArray[Any] = np.full(numbers.size, None, object)
        self._peaks: list[tuple[FloatArray, FloatArray] | None] | None = (
            [None] * numbers.size if peaks else None
        )
        self.versions: Mapping[str, str] = {}

    def fail(self, row: int, problem: HertzchainError) -> None:
        """Keep the reason why a scene has no numbers."""
        self._failure[row] = str(problem)

    def set_momentum_ratio(self, row: int, momentum_ratio: float) -> None:
        """Fill in LM_ratio where similarity does not give it."""
        self._parameters["shock.momentum_ratio"][row] = momentum_ratio

    def add_result(self, row: int, result: Result) -> None:
        """Fill in what a simulation found."""
        wave = result.solitary_wave
        self._counts["transition_granules"][row] = result.transition_granules or 0
        self._counts["force_evaluations"][row] = result.force_evaluations
        self._fill(row, result.peak_force, result.peak_time, result.scene)
        for name, value in (
            ("solitary_wave_force_N", wave.peak_force),
            ("far_field_force_N", wave.far_field_force),
            ("speed_m_s", wave.speed),
            ("error_estimate", result.error_estimate),
        ):
            self._found[name][row] = np.nan if value is None else value
        self.versions = result.versions

    def add_prediction(self, row: int, prediction: Prediction, error: float) -> None:
        """Fill in what the formulas say."""
        if np.isnan(prediction.peak_force).any():
            self._failure[row] = prediction.missing
            return
        self._counts["transition_granules"][row] = prediction.transition_granules or 0
        nothing = np.full(prediction.peak_force.size, np.nan)
        self._fill(row, prediction.peak_force, nothing, prediction.scene)
        speed = None if prediction.speed is None else prediction.speed.exact
        for name, value in (
            ("solitary_wave_force_N", prediction.wave_force),
            ("far_field_force_N", prediction.far_field_force),
            ("speed_m_s", speed),
            ("eq3_transition_granules", prediction.eq3),
            ("error_estimate", error),
        ):
            self._found[name][row] = np.nan if value is None else value

    def add_batch(
        self,
        rows: NDArray[np.intp],
        batch: Batch,
        force: FloatArray,
        length: FloatArray,
        time: FloatArray,
    ) -> NDArray[np.bool_]:
        """Fill in what a batch of similar scenes found, in one go.

        Parameters
        ----------
        rows
            Which these are, shape (some,).
        batch
            In natural units.
        force, length, time
            These units [N], [m], [s], shape (some,).

        Returns
        -------
        NDArray
            Which of them are not filled in, as no digit of their peaks is sure or granules would
            be pressed into one another by more than a radius, shape (some,).
        """
        radius = self._parameters["chain.radius"][rows]
        peak_force, passed = batch.peak_force * force[:, None], batch.peak_passed
        peak_time = times_of_peaks(peak_force, batch.peak_time * time[:, None])
        p = transitions(batch.peak_force, passed)
        near, far, speed = solitary_waves(peak_force, peak_time, passed, p, 2 * radius)
        at = np.argmax(peak_force, axis=1)
        largest = peak_force[np.arange(rows.size), at]
        ratio = np.power(largest / force, 2 / 3) * length / radius
        lost: NDArray[np.bool_] = ~(batch.error_estimate < 1) | ~(ratio <= IMPOSSIBLE_OVERLAP)
        for name, values in (
            ("solitary_wave_force_N", near),
            ("far_field_force_N", far),
            ("speed_m_s", speed),
            ("largest_peak_force_N", largest),
            ("overlap_ratio", ratio),
            ("error_estimate", batch.error_estimate),
        ):
            self._found[name][rows] = np.where(lost, np.nan, values)
        for name, counts in (
            ("transition_granules", p),
            ("largest_peak_contact", at + 2),
            ("force_evaluations", batch.force_evaluations),
        ):
            self._counts[name][rows] = np.where(lost, 0, counts)
        if self._peaks is not None:
            for k in np.nonzero(~lost)[0]:
                self._peaks[rows[k]] = peak_force[k], peak_time[k]
        return lost

    def _fill(self, row: int, force: FloatArray, time: FloatArray, scene: Scene) -> None:
        at = int(np.argmax(force))
        self._counts["largest_peak_contact"][row] = at + 2
        self._found["largest_peak_force_N"][row] = force[at]
        self._found["overlap_ratio"][row] = overlap_ratio(scene.chain, float(force[at]))
        if self._peaks is not None:
            self._peaks[row] = force, time

    def table(self) -> pandas.DataFrame:
        """One row per scene, with the columns ``COLUMNS``; nothing where nothing was found."""
        import pandas

        scene_columns = {"scene": self.numbers, "backend": np.full(self.numbers.size, self.backend)}
        # No count is 0: a chain has two granules, and a run takes steps.
        counts = {
            name: pandas.arrays.IntegerArray(values, values == 0)
            for name, values in self._counts.items()
        }
        failure = pandas.array(self._failure, dtype="string")
        columns = {**scene_columns, **self._parameters, **self._found, **counts, "failure": failure}
        return pandas.DataFrame({name: columns[name] for name in COLUMNS})

    def peaks(self) -> pandas.DataFrame | None:
        """One row per scene and contact: scene, backend, contact, peak_force_N, peak_time_s."""
        if self._peaks is None:
            return None
        import pandas

        there = [k for k, found in enumerate(self._peaks) if found is not None]
        found = [found for found in self._peaks if found is not None]
        sizes = np.array([force.size for force, _ in found], np.int64)
        contact = np.concatenate([np.arange(2, size + 2) for size in sizes] or [np.zeros(0, int)])
        none = [np.zeros(0)]
        return pandas.DataFrame(
            {
                "scene": np.repeat(self.numbers[there], sizes),
                "backend": np.full(contact.size, self.backend),
                "contact": contact,
                "peak_force_N": np.concatenate([force for force, _ in found] or none),
                "peak_time_s": np.concatenate([time for _, time in found] or none),
            }
        )
