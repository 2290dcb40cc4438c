"""The duration of a run."""

from __future__ import annotations

from dataclasses import dataclass

from hertzchain.errors import POSITIVE, is_positive, require
from hertzchain.scene.chain import to_plain_numbers


@dataclass(frozen=True)
class Run:
    """Duration of a run.

    Parameters
    ----------
    end_time
        End of the run [s]; None for the default, long enough for every contact to peak, or, with a
        striker, a wall or unlike granules, twice the time at which the first pulses are over.

    Raises
    ------
    SceneError
        If the end time is not a finite number above 0.
    """

    end_time: float | None = None

    def __post_init__(self) -> None:
        if self.end_time is not None:
            require(is_positive(self.end_time), "end_time", self.end_time, f"{POSITIVE} [s]")
            to_plain_numbers(self)
