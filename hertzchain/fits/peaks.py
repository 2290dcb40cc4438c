"""The comparison of a fit to peak forces of contacts, whose relative noise is unknown."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.backend import Native
from hertzchain.errors import SceneError, require
from hertzchain.fits.free import Free
from hertzchain.fits.model import Model
from hertzchain.limits import TOLERANCE, Deadline
from hertzchain.observables.result import Result
from hertzchain.pulses.recording import MOST_EXTENT
from hertzchain.scene.scene import Scene

_ACCURATE = 1e-8
"""Accuracy of runs of the search: a hundredth of the digits of files."""


class OfPeaks(Model):
    """Relative differences of peak forces.

    Parameters
    ----------
    peaks
        Forces of each file [N], shape (contacts,), NaN where none was measured; contacts without
        force, of which there is no relative difference, are left out.
    """

    noise_is_known = False
    given = "peaks"

    def __init__(
        self, base: Scene, free: Free, peaks: Sequence[FloatArray], deadline: Deadline
    ) -> None:
        super().__init__(base, free, deadline)
        self._places = np.concatenate([np.flatnonzero(one > 0) for one in peaks])
        self._force = np.concatenate([one[one > 0] for one in peaks])
        possible = bool(np.all((self._force > 1 / MOST_EXTENT) & (self._force < MOST_EXTENT)))
        allowed = f"must be from {1 / MOST_EXTENT:g} to {MOST_EXTENT:g} N: check their unit"
        require(possible, "peak forces", None, allowed)
        self._measured = np.ones(self._force.size)
        need = len(free.keys) + 1
        allowed = f"must be at least {need} for {len(free.keys)} free keys: measure more contacts"
        require(self.size >= need, "number of peaks", self.size, allowed)

    def _read(self, x: FloatArray, rtol: float | None) -> FloatArray:
        rtol, scene = rtol or _ACCURATE, self.scene(x)
        run: Result = self._deadline.spend(
            lambda left: Native(rtol=rtol, time_limit=left, wanted="all").run(scene)
        )
        late = self._places[run.is_cut_off[self._places]]
        if late.size:
            contact = run.scene.contact_name(run.scene.contacts[late[0]])
            allowed = f"is before the peak of {contact}: give a later end_time in [run]"
            raise SceneError("end_time", run.scene.end_time, allowed)
        return np.asarray(run.peak_force[self._places] / self._force)

    def chance(self, differences: FloatArray) -> float:
        """Probability that noise changes its sign as rarely along the contacts, by the runs test.

        It is 1 if all differences are within the tolerance of ``judge``: another code may cause
        them.
        """
        own = differences - differences.mean()
        if np.sqrt(np.mean(differences**2)) < TOLERANCE:
            return 1.0
        above = int(np.sum(own > 0))
        mean = 1 + 2 * above * (own.size - above) / own.size
        variance = (mean - 1) * (mean - 2) / max(own.size - 1, 1)
        runs = 1 + int(np.sum((own[1:] > 0) != (own[:-1] > 0)))
        # A normal distribution; half a run is the step of a whole number.
        return 0.5 * math.erfc((mean - runs - 0.5) / math.sqrt(2 * max(variance, 1e-12)))
