"""The duration of a run."""

from __future__ import annotations

from dataclasses import dataclass, field

from hertzchain.scene.keys import check, key


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

    end_time: float | None = field(default=None, metadata=key("s", "end of the run", above=0))

    def __post_init__(self) -> None:
        check(self)
