"""The motion that a run recorded as files: CSV or Parquet, as the name says."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hertzchain.errors import SceneError
from hertzchain.observables.history import History
from hertzchain.observables.result import Result

if TYPE_CHECKING:
    import pandas


def recorded(result: Result) -> History:
    """What a run recorded; a SceneError where that is nothing."""
    if result.history is None:
        raise SceneError("history", None, "there is none: run with record = the times to keep")
    return result.history


def motion_frame(result: Result) -> pandas.DataFrame:
    """Recorded motion as a table with a row for each time and granule, time by time.

    Its columns are ``time_s``, ``granule``, ``displacement_m``, ``velocity_m_s`` and
    ``contact_force_N``. The contact of granule i is contact i, between granules i - 1 and i;
    granule 1 has the applied force, or that of a near wall. A wall is one more granule, which does
    not move. ``frame.pivot(index="time_s", columns="granule", values="contact_force_N")`` makes a
    column for each granule.
    """
    import pandas

    history = recorded(result)
    applied = result.scene.applied_force(history.time)
    displacement, velocity = history.displacement, history.velocity
    behind = [] if result.scene.near_wall is not None else [applied]
    force = np.column_stack([*behind, history.contact_force])
    if result.scene.wall is not None:
        still = np.zeros(history.time.size)
        displacement = np.column_stack([displacement, still])
        velocity = np.column_stack([velocity, still])
    times, granules = force.shape
    return pandas.DataFrame(
        {
            "time_s": np.repeat(history.time, granules),
            "granule": np.tile(np.arange(1, granules + 1), times),
            "displacement_m": displacement.ravel(),
            "velocity_m_s": velocity.ravel(),
            "contact_force_N": force.ravel(),
        }
    )
