"""The files that hertzchain run writes, and the times at which it records for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hertzchain.cli.output import say, write_file

if TYPE_CHECKING:
    from hertzchain.arrays import FloatArray
    from hertzchain.observables.result import Result
    from hertzchain.scene.scene import Scene

DEFAULT_FRAMES = 100  # of a trajectory: four seconds in a viewer


@dataclass(frozen=True)
class RunFiles:
    """Which files are wanted, None for those that are not.

    Parameters
    ----------
    output, plot, trajectory
        Paths, as the options have them.
    record
        How many times are recorded for ``output``, which then has the motion, and for ``plot``.
    frames
        How many times ``trajectory`` has.
    contacts
        Numbers of the contacts that are plotted over time, and kept of the motion.
    window
        From when until when ``record`` is [s]; None for the whole run.
    """

    output: Path | None
    plot: Path | None
    trajectory: Path | None
    record: int | None
    frames: int | None
    contacts: Sequence[int] | None
    window: tuple[float, float] | None = None

    def check(self, scene: Path) -> None:
        """Raise an OutputError, before any work is done, for what cannot be written."""
        from hertzchain.files import check_outputs

        check_outputs([scene], [self.output, self.plot, self.trajectory])
        if self.output is not None and self.record is None:
            from hertzchain.report.tables import check_result_format

            check_result_format(self.output)
        if self.output is not None and self.record is not None:
            from hertzchain.report.motion import check_motion_format

            check_motion_format(self.output)
        if self.plot is not None:
            from hertzchain.report.figures import check_plot_format

            check_plot_format(self.plot)
        if self.trajectory is not None:
            from hertzchain.report.trajectory import check_trajectory_format

            check_trajectory_format(self.trajectory)

    @property
    def others(self) -> str:
        """Where the contacts are that the terminal does not show."""
        has_peaks = self.output is not None and self.record is None
        return f"in {self.output}" if has_peaks else "shown by --all"

    def times(self, scene: Scene) -> FloatArray | None:
        """All times that any of the files needs [s], increasing; None where none does."""
        import numpy as np

        found = self._times(scene).values()
        return np.unique(np.concatenate(list(found))) if found else None

    def _times(self, scene: Scene) -> dict[str, FloatArray]:
        """The times of each kind of file that shows motion [s]."""
        found: dict[str, FloatArray] = {}
        if self.record is None and self.plot is self.trajectory is None:
            return found
        from hertzchain.report.run_figure import plot_times
        from hertzchain.report.trajectory import frame_times

        if self.record is not None:
            found["motion"] = found["plot"] = frame_times(scene, self.record, self.window)
        elif self.plot is not None:
            found["plot"] = plot_times(scene)
        if self.trajectory is not None:
            found["trajectory"] = frame_times(scene, self.frames or DEFAULT_FRAMES)
        return found

    def write(self, result: Result) -> None:
        """Write all files, each with its own times."""
        if self.output is not None and self.record is None:
            from hertzchain.report.tables import write_result

            what = "Result" if self.output.suffix.lower() == ".json" else "Peaks"
            write_file(what, self.output, lambda path: write_result(result, path))
        times = self._times(result.scene)
        if not times:
            return
        from hertzchain.report.motion import at_times, recorded_below, write_motion
        from hertzchain.report.run_figure import coarse_times, plot_run
        from hertzchain.report.trajectory import write_trajectory

        moving = {name: at_times(result, time) for name, time in times.items()}
        coarse = None if self.plot is None else coarse_times(moving["plot"])
        if self.record is not None:
            write_file(
                "Motion",
                self.output,
                lambda path: write_motion(moving["motion"], path, self.contacts),
            )
            remark = recorded_below(
                moving["motion"],
                self.contacts,
                says_how_many=coarse is None,
                writes_motion=self.output is not None,
            )
            if remark:
                say(remark)
        write_file("Plot", self.plot, lambda path: plot_run(moving["plot"], path, self.contacts))
        if coarse:
            say(coarse)
        write_file(
            "Trajectory", self.trajectory, lambda path: write_trajectory(moving["trajectory"], path)
        )
