"""The files that hertzchain run writes, and the times at which it records for them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hertzchain.cli.output import check_files, write_file
from hertzchain.errors import require
from hertzchain.scene.gauge import NO_GAUGE

if TYPE_CHECKING:
    from hertzchain.arrays import FloatArray
    from hertzchain.observables.result import Result
    from hertzchain.scene.scene import Scene

TRACE_TIMES = 500  # of traces alone without --record, as force over time is usually drawn


@dataclass(frozen=True)
class RunFiles:
    """Which files are wanted, None for those that are not.

    Parameters
    ----------
    output, plot, traces
        Paths, as the options have them.
    record
        How many times are recorded for ``output``, which then has the motion, and all others.
    report
        Path of a page.
    size
        Width and height of ``plot`` [inches].
    """

    output: Path | None
    plot: Path | None
    traces: Path | None
    record: int | None
    report: Path | None = None
    size: tuple[float, float] | None = None

    def check(self, file: Path, scene: Scene) -> None:
        """Raise an OutputError, before any work is done, for what cannot be written."""
        require(self.traces is None or bool(scene.gauges), "gauge", None, NO_GAUGE)
        own = {"result" if self.record is None else "motion": self.output, "plot": self.plot}
        others = {"traces": self.traces, "page": self.report}
        check_files([file], (), **own, **others)

    @property
    def others(self) -> str:
        """Where the contacts are that the terminal does not show."""
        has_peaks = self.output is not None and self.record is None
        return f"in {self.output}" if has_peaks else "shown by --all"

    def times(self, scene: Scene) -> FloatArray | None:
        """Return the times at which the run is recorded for all files [s]; None for none."""
        from hertzchain.report.waterfall import frame_times, plot_times

        if self.record is not None:
            return frame_times(scene, self.record)
        if self.plot is not None or self.report is not None:
            return plot_times(scene)
        return None if self.traces is None else frame_times(scene, TRACE_TIMES)

    def write(self, result: Result, scene: str) -> None:
        """Write all files; ``scene`` is the name of that of the scene."""
        from hertzchain.report.tables import write_frame, write_result

        if self.output is not None and self.record is None:
            what = "Result" if self.output.suffix.lower() == ".json" else "Peaks"
            write_file(what, self.output, lambda path: write_result(result, path))
        if result.history is None:
            return
        from hertzchain.report.figures import figure_of
        from hertzchain.report.motion import motion_frame
        from hertzchain.report.page import write_page
        from hertzchain.report.run import of_result

        shown = of_result(result)
        motion = None if self.record is None else self.output
        write_file("Motion", motion, lambda path: write_frame(motion_frame(result), path))
        write_file("Plot", self.plot, lambda path: figure_of(shown, self.size).write(path))
        write_file("Report", self.report, lambda path: write_page(shown, path, scene))
        write_file("Traces", self.traces, lambda path: write_frame(result.to_traces(), path))
