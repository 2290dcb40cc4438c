"""The table of a sweep: one row per scene and backend, filled as scenes are done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError
from hertzchain.observables.peaks import times_of_peaks
from hertzchain.observables.transition import solitary_waves, transitions
from hertzchain.scene.validity import IMPOSSIBLE_OVERLAP
from hertzchain.sweeps.columns import ALL, COUNTS, Column, is_result, numbers_of, peak_columns

if TYPE_CHECKING:
    import pandas

    from hertzchain.engines.native.batch import Batch
    from hertzchain.observables.result import Result


class Rows:
    """Rows of scenes while they are filled: numbers and parameters have the shape (rows,)."""

    def __init__(
        self,
        numbers: NDArray[np.int64],
        backend: str,
        parameters: Mapping[str, NDArray[Any]],
        peaks: bool,
        columns: Sequence[Column] = ALL,
    ) -> None:
        self.numbers, self.backend = numbers, backend
        self._columns = columns
        self._parameters = parameters
        self._found: dict[str, FloatArray] = {
            column.name: np.full(numbers.size, np.nan)
            for column in columns
            if is_result(column.name)
        }
        self._failure: NDArray[Any] = np.full(numbers.size, None, object)
        self._peaks: list[pandas.DataFrame] | None = [] if peaks else None
        self.versions: Mapping[str, str] = {}

    def fail(self, row: int, problem: HertzchainError) -> None:
        """Store the reason why a scene has no numbers."""
        self._failure[row] = str(problem)

    def fill(self, row: int, found: Result) -> None:
        """Fill in a simulation of a scene."""
        numbers, self.versions = numbers_of(found), found.versions
        for name in self._found.keys() & numbers.keys():
            if (value := numbers[name]) is not None:
                self._found[name][row] = value
        if self._peaks is not None:
            frame = found.to_frame().assign(scene=self.numbers[row])
            measured = frame.columns.intersection([*peak_columns(self._columns)[3:]])
            frame.loc[found.is_cut_off, measured] = np.nan
            self._peaks.append(frame)

    def add_batch(self, rows: NDArray[np.intp], batch: Batch, *units: FloatArray) -> Any:
        """Fill in results of a batch of similar scenes, in natural units of [N], [m], [s].

        Returns the scenes not filled, shape (some,): their peaks are unsure or an overlap is
        impossible.
        """
        radius = self._parameters["chain.radius"][rows]
        numbers, peak_force, peak_time = of_batch(batch, radius, *units)
        lost: NDArray[np.bool_] = ~(batch.error_estimate < 1)
        lost |= ~(numbers["overlap_ratio"] <= IMPOSSIBLE_OVERLAP)
        for name, found in numbers.items():
            values = self._found[name]
            values[rows] = np.where(lost, values[rows], found)
        if self._peaks is not None:
            import pandas

            there, contacts = self.numbers[rows[~lost]], 2 + np.arange(peak_force.shape[1])
            columns = {
                "scene": np.repeat(there, contacts.size),
                "contact": np.tile(contacts, there.size),
                "peak_force_N": peak_force[~lost].ravel(),
                "peak_time_s": peak_time[~lost].ravel(),
            }
            self._peaks.append(pandas.DataFrame(columns))
        return lost

    def table(self) -> pandas.DataFrame:
        """Return one row per scene, with the columns of the sweep; NaN for failed scenes."""
        import pandas

        scene_columns = {"scene": self.numbers, "backend": np.full(self.numbers.size, self.backend)}
        found = {
            name: pandas.array(np.where(values == 0, np.nan, values), "Int64")
            if name in COUNTS
            else values
            for name, values in self._found.items()
        }
        failure = pandas.array(self._failure, dtype="string")
        columns = {**scene_columns, **self._parameters, **found, "failure": failure}
        return pandas.DataFrame({column.name: columns[column.name] for column in self._columns})

    def peaks(self) -> pandas.DataFrame | None:
        """Return one row per scene and contact, with the columns of ``peak_columns``."""
        if self._peaks is None:
            return None
        import pandas

        kinds = {"scene": np.int64, "backend": object, "contact": np.int64}
        names = peak_columns(self._columns)
        if not self._peaks:
            return pandas.DataFrame({name: np.zeros(0, kinds.get(name, float)) for name in names})
        each = pandas.concat(self._peaks).sort_values(["scene", "contact"], ignore_index=True)
        return each.assign(backend=self.backend).reindex(columns=names)


def of_batch(
    batch: Batch, radius: FloatArray, force: FloatArray, length: FloatArray, time: FloatArray
) -> tuple[Mapping[str, Any], FloatArray, FloatArray]:
    """Return the numbers of similar scenes, shape (scenes,), and all peaks and their times.

    ``force``, ``length`` and ``time`` are the natural units of each scene, ``radius`` is that of
    its granules. p is 0 where there is none. Peaks and times have the shape (scenes, contacts).
    """
    peak_force, passed = batch.peak_force * force[:, None], batch.peak_passed
    peak_time = times_of_peaks(peak_force, batch.peak_time * time[:, None])
    p = transitions(batch.peak_force, passed)
    slowness = time * np.power(force, 1 / 6)
    near, far, speed, far_off, speed_off = solitary_waves(
        peak_force, peak_time, passed, p, 2 * radius, slowness
    )
    at = np.argmax(peak_force, axis=1)
    largest = peak_force[np.arange(at.size), at]
    numbers = {
        "transition_granules": p,
        "solitary_wave_force_N": near,
        "far_field_force_N": far,
        "far_field_error": far_off,
        "speed_m_s": speed,
        "speed_error": speed_off,
        "largest_peak_force_N": largest,
        "largest_peak_contact": at + 2,
        "overlap_ratio": np.power(largest / force, 2 / 3) * length / radius,
        "error_estimate": batch.error_estimate,
        "force_evaluations": batch.force_evaluations,
    }
    return numbers, peak_force, peak_time
