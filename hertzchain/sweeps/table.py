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
from hertzchain.scene.scene import IMPOSSIBLE_OVERLAP
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
        names = peak_columns(columns)[2:] if peaks else ()
        self._peaks = {name: np.full(numbers.size, None, object) for name in names}
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
        if self._peaks:
            columns = {**found.first_columns, "contact": found.contact}
            columns |= {"peak_force_N": found.peak_force, "peak_time_s": found.peak_time}
            for name, cells in self._peaks.items():
                values = columns.get(name, np.full(found.contact.size, np.nan))
                is_lost = found.is_cut_off & (name != "contact")
                cells[row] = np.where(is_lost, np.nan, values) if is_lost.any() else values

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
        if self._peaks:
            contacts = 2 + np.arange(peak_force.shape[1])
            for k in np.flatnonzero(~lost).tolist():
                self._peaks["contact"][rows[k]] = contacts
                self._peaks["peak_force_N"][rows[k]] = peak_force[k]
                self._peaks["peak_time_s"][rows[k]] = peak_time[k]
        return lost

    def table(self) -> pandas.DataFrame:
        """Return one row per scene, with the columns of the sweep; NaN for failed scenes.

        Where peaks are wanted, further columns have a list of all contacts in each cell.
        """
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
        table = {column.name: columns[column.name] for column in self._columns}
        return pandas.DataFrame({**table, **self._peaks})


def long_table(frame: pandas.DataFrame) -> pandas.DataFrame:
    """Return one row per contact of rows whose cells have lists of all contacts."""
    import pandas

    frame = frame[frame["contact"].notna()]
    counts = frame["contact"].map(len)
    return pandas.DataFrame(
        {
            name: np.repeat(frame[name].to_numpy(), counts)
            if name in ("scene", "backend")
            else np.concatenate(
                [np.zeros(0, np.int64 if name == "contact" else float), *frame[name]]
            )
            for name in frame
        }
    )


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
