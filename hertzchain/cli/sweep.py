"""hertzchain sweep and plot: many scenes."""

from __future__ import annotations

import io
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from hertzchain.cli import options
from hertzchain.cli.output import DONE, OUT_OF_TOLERANCE, Answer, Written, working
from hertzchain.engines.registry import ENGINES
from hertzchain.errors import HertzchainError
from hertzchain.limits import RTOL
from hertzchain.progress import say

if TYPE_CHECKING:
    from hertzchain.sweeps.sweeping import Counts


_LINE_INTERVAL_SECONDS = 30.0  # time between two lines of progress without a terminal [s]

_SWEEP_ENGINES = [name for name, engine in ENGINES.items() if engine.swept]
Source = StrEnum("Source", {name.upper(): name for name in _SWEEP_ENGINES})  # type: ignore[misc]
"""Backends that measure the scenes of a sweep."""


@dataclass(frozen=True)
class ScenesOptions:
    """Which scenes a sweep has.

    Options
    -------
    vary NAME=VALUES: A parameter, as the scene file names it (segments by their numbers:
        chain.segments.1.radius), and its values; repeatable. A,B,C: a list; LOW:HIGH:COUNT: a grid;
        LOW:HIGH: drawn, see --samples; :log behind a range: by logarithms. With units:
        chain.radius='1 mm:10 mm:5'. All are crossed.
    samples: How many points to draw (scrambled Sobol sequence) from all ranges without a count
        together.
    seed: Seed of the points that are drawn.
    table FILE: Instead of --vary: a table (.csv, .parquet) with one row for each scene, whose
        columns are keys, also with a unit: chain.radius [mm]. Empty cells have the value of the
        scene. A .csv may have semicolons and decimal commas.
    """

    vary: list[str] | None = None
    samples: int | None = None
    seed: int = 0
    table: Path | None = None

    @property
    def varied(self) -> Any:
        """Varied parameters: values by names, or a table."""
        if (self.table is None) == (not self.vary):
            raise HertzchainError("--vary or --table: name what varies by one of the two")
        if self.table is not None:
            return _read_table(self.table)
        return options.by_name("--vary", self.vary, "shock.momentum_ratio=0.1:10:50:log")


@dataclass(frozen=True)
class MeasuringOptions:
    """How the scenes of a sweep are measured.

    Options
    -------
    backend: Backend that measures each scene; repeatable. Default: native.
    rtol: Wanted relative accuracy of the peaks.
    peaks: Keep the peaks of all contacts, too.
    scheduler ADDRESS: Measure on the workers of this Dask scheduler, not on this machine.
    """

    backend: list[Source] | None = None
    rtol: float = RTOL
    peaks: bool = False
    scheduler: str | None = None
    time_limit: str = "1 h"

    @property
    def backends(self) -> list[Any]:
        """The backends that are named."""
        from hertzchain.engines.lammps.backend import Lammps
        from hertzchain.engines.native.backend import Native

        common: Any = {"rtol": self.rtol, "time_limit": options.to_time_limit(self.time_limit)}
        # An accuracy that no simulation has is refused, whichever backend is named.
        lammps = Lammps(lmp=options.named_binary(None), **common)
        named = self.backend or [Source("native")]
        return [lammps if name == "lammps" else Native(**common) for name in named]


def sweep(
    scene: Path, *, scenes: ScenesOptions, measuring: MeasuringOptions, folder: Path
) -> Answer:
    """Measure many scenes: a table with a row for each.

    A row has the parameters, p, F_SW, speed, the largest peak and the error. With a wall the row
    also has the force on it; p, F_SW and speed exist only for uniform free chains.

    A sweep that was stopped or killed continues when it is started again. A scene that fails is a
    row with the reason.

    Options
    -------
    folder OUT: Folder for the tables; an existing folder of the same sweep is resumed.
    """
    from hertzchain.sweeps.sweeping import sweep as measure

    if folder.suffix.lower() in (".csv", ".parquet"):
        raise HertzchainError(
            f"-o {folder}: must be a folder; pandas.read_parquet reads the tables in it"
        )
    backends, loaded = measuring.backends, options.load_scene(scene)
    varied, begin = scenes.varied, time.perf_counter()
    options.remark_on_units_of(varied, loaded)
    is_native = any(backend.name == "native" for backend in backends)
    with _counting(folder, is_native) as report_progress:
        swept = measure(
            loaded, varied, samples=scenes.samples, seed=scenes.seed, backends=backends,
            peaks=measuring.peaks, output=folder, scheduler=measuring.scheduler,
            progress=report_progress,
        )  # fmt: skip
    counts, wall_time = swept.count(), time.perf_counter() - begin
    numbers = {
        "folder": str(folder),
        "rows": counts.done,
        "failed": counts.failed,
        "missed_accuracy": counts.missed,
        "first_failure": counts.reason,
        **({"cut_off": counts.cut_off} if counts.cut_off else {}),
        **({"doubtful_overlap": counts.doubtful} if counts.doubtful else {}),
        "wall_time_s": wall_time,
    }
    said = f'{counts.done:,} rows in {folder}, for pandas: read_parquet("{folder / "scenes"}")'
    status = OUT_OF_TOLERANCE if counts.failed or counts.missed else DONE
    remarks = _remarks(counts, measuring.rtol)
    return Answer(lambda: numbers, lambda _: typer.echo(said), remarks=remarks, status=status)


def _read_table(path: Path) -> Any:
    """Return the table in a file."""
    import pandas

    allowed = f"{path}: must be a table of scenes that ends in .csv or .parquet"
    try:
        if path.suffix.lower() == ".parquet":
            return pandas.read_parquet(path)
        if path.suffix.lower() == ".csv":
            text = path.read_text(encoding="utf-8-sig").rstrip()
            header = text.partition("\n")[0]  # no key has one of these marks
            separator = next((mark for mark in ";\t" if mark in header), ",")
            with warnings.catch_warnings(action="error"):  # a row with more cells than the header
                table = pandas.read_csv(
                    io.StringIO(text), skipinitialspace=True, index_col=False, na_values=[""],
                    skip_blank_lines=False, keep_default_na=False, sep=separator,
                )  # fmt: skip
            commas = {r"^(\s*[-+]?\d*),(\d+)(?![\d,])": r"\1.\2"} if separator != "," else {}
            return table.replace(regex=commas)
    except pandas.errors.ParserWarning:
        raise HertzchainError(f"{allowed}; a row has more cells than the header") from None
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or str(problem).partition("\n")[0]
        raise HertzchainError(f"{allowed} and can be read ({reason})") from None
    raise HertzchainError(allowed)


def _remarks(counts: Counts, rtol: float) -> list[str]:
    """Return sentences on rows without numbers, less accurate ones, and those to be doubted."""
    from hertzchain.scene.scene import DOUBTFUL_OVERLAP

    rows = f"of {counts.done:,} rows"
    remarks = {
        f"{counts.failed:,} {rows} have no numbers, the column failure says why; the first:"
        f" {counts.reason}": counts.failed,
        f"wanted {rtol:g}, and {counts.missed:,} {rows} are less accurate: see the column"
        f" {counts.error}": counts.missed,
        f"in {counts.cut_off:,} {rows} the run may have ended before the last peaks: see the column"
        " contacts_cut_off, and set end_time in [run]": counts.cut_off,
        f"in {counts.doubtful:,} {rows} the largest overlap is above {DOUBTFUL_OVERLAP:g} radii,"
        " where Hertz's law is an extrapolation: see the column overlap_ratio": counts.doubtful,
    }
    return [remark for remark, count in remarks.items() if count]


@contextmanager
def _counting(folder: Path, is_native: bool) -> Iterator[Callable[[int, int], None]]:
    """Show how many rows of a sweep are done: continuously on a terminal, else now and then.

    When the sweep is stopped, say that the same command resumes it.
    """
    from hertzchain.sweeps.sweeping import Sweep

    is_terminal = sys.stderr is not None and sys.stderr.isatty()
    next_line = 0.0  # at the first call
    with working(is_native) as report_progress:

        def count(done: int, total: int) -> None:
            nonlocal next_line
            rows, now = f"{done:,} of {total:,} rows", time.monotonic()
            report_progress(rows)
            if next_line == 0 and 0 < done < total:
                say(f"{rows} are there, resuming")
            elif 0 < next_line < now and not is_terminal:
                say(rows)
            if now > next_line:
                next_line = now + _LINE_INTERVAL_SECONDS

        try:
            yield count
        except HertzchainError:
            raise
        except BaseException:
            with suppress(HertzchainError):  # stopped before the sweep began
                rows = f"{Sweep.load(folder).count().done:,} rows"
                say(f"what is done is in {folder}, {rows}; the same command resumes the sweep")
            raise


def plot(
    sweep: Path,
    *,
    x: str,
    y: str,
    colour: str | None = None,
    where: list[str] | None = None,
    output: Path | None = None,
    size: str | None = None,
) -> list[Written]:
    """Draw a sweep: a result over a parameter, or a map.

    Other parameters are a line for each value. Text below the picture names values that are not
    shown, without numbers or with further variations. An axis is logarithmic if its parameter was
    swept with :log, or if the drawn values span more than two decades.

    Options
    -------
    sweep OUT: Folder that hertzchain sweep -o wrote, complete or not.
    x NAME: A column of numbers, such as shock.momentum_ratio; the section may be left out. contact:
        along the chain, of a sweep with --peaks.
    y NAME: Another column: a result, for lines or points; a parameter that varies, for a map.
    colour NAME: Column that colours show; in a map the result. Default: the backend, if several.
    where NAME=VALUE: Draw only rows in which a parameter, or the backend, has this value;
        repeatable.
    output FILE: Picture (png, pdf, svg). Default: OUT/plot.png.
    """
    from hertzchain.report.files import check_format
    from hertzchain.sweeps.drawing import SIZE, draw
    from hertzchain.sweeps.sweeping import Sweep

    check_format(output, "plot")
    swept = Sweep.load(sweep)
    fixed = options.by_name("--where", where, "shock.profile=cosine")
    with working(is_native=False) as report_progress:
        report_progress(f"drawing {sweep}")
        drawn = draw(swept, x, y, colour, fixed, options.to_inches(size) or SIZE)
    for remark in drawn.remarks:
        say(remark)
    return [Written("Plot", output or sweep / "plot.png", drawn.figure.write)]
