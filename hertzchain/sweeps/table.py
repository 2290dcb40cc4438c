"""The table of a sweep: one row per scene and backend, filled as scenes are done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError
from hertzchain.scene.validity import IMPOSSIBLE_OVERLAP
from hertzchain.sweeps.columns import (
    ALL,
    COUNTS,
    FIRST,
    Column,
    is_result,
    numbers_of,
    peak_columns,
)
from hertzchain.sweeps.numbers import of_batch

if TYPE_CHECKING:
    import pandas

    from hertzchain.engines.native import Batch
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
        # 0 marks a missing count: a chain has at least 2 granules, a run at least 1 step.
        self._found: dict[str, NDArray[Any]] = {
            column.name: np.zeros(numbers.size, np.int64)
            if column.kind == "int"
            else np.full(numbers.size, np.nan)
            for column in columns
            if is_result(column.name)
        }
        self._failure: NDArray[Any] = np.full(numbers.size, None, object)
        self._peaks: list[tuple[FloatArray, ...] | None] | None = (
            [None] * numbers.size if peaks else None
        )
        self.versions: Mapping[str, str] = {}
        self._first_contact = 2

    def fail(self, row: int, problem: HertzchainError) -> None:
        """Store the reason why a scene has no numbers."""
        self._failure[row] = str(problem)

    def fill(self, row: int, found: Result) -> None:
        """Fill in a simulation of a scene."""
        numbers, first = numbers_of(found), found.first_columns
        self.versions, self._first_contact = found.versions, found.scene.contacts[0]
        for name in self._found.keys() & numbers.keys():
            if (value := numbers[name]) is not None:
                self._found[name][row] = value
        if self._peaks is not None:
            never = np.full(found.peak_force.size, np.nan)
            of_first = (first.get(name, never) for name in FIRST)
            self._peaks[row] = found.peak_force, found.peak_time, *of_first

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
            for k in np.nonzero(~lost)[0]:
                self._peaks[rows[k]] = peak_force[k], peak_time[k]
        return lost

    def table(self) -> pandas.DataFrame:
        """Return one row per scene, with the columns of the sweep; NaN for failed scenes."""
        import pandas

        scene_columns = {"scene": self.numbers, "backend": np.full(self.numbers.size, self.backend)}
        found = {
            name: pandas.arrays.IntegerArray(values, values == 0) if name in COUNTS else values
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

        there = [k for k, found in enumerate(self._peaks) if found is not None]
        found = [found for found in self._peaks if found is not None]
        sizes = np.array([force.size for force, *_ in found], np.int64)
        first = self._first_contact
        numbers = [first + np.arange(size) for size in sizes]
        contact = np.concatenate(numbers or [np.zeros(0, int)])
        names = peak_columns(self._columns)
        values = [
            np.concatenate([one[k] for one in found] or [np.zeros(0)])
            for k in range(len(names) - 3)
        ]
        backend = np.full(contact.size, self.backend)
        columns = (np.repeat(self.numbers[there], sizes), backend, contact, *values)
        return pandas.DataFrame(dict(zip(names, columns, strict=True)))
