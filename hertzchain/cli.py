"""The commands. Results go to standard output, talk and progress to standard error."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from hertzchain.errors import HertzchainError

if TYPE_CHECKING:
    from rich.console import Console

    from hertzchain.lammps import Lammps
    from hertzchain.liggghts import Liggghts
    from hertzchain.native import Native
    from hertzchain.scene import Scene
    from hertzchain.yade import Yade

DONE, OUT_OF_TOLERANCE, UNUSABLE = 0, 1, 2

DEFAULT_RTOL = 1e-6
"""What both backends aim at where nothing is asked for."""

_ODD_RATIO = 1e4
"""LM_ratio from which on a scene is remarked on. Chosen: the pulse then lasts 33,000 natural time
units, in which a wave passes as many granules; a unit may have been forgotten."""

DEFAULT_FRAMES = 100
"""Of a trajectory: four seconds in a viewer."""

app = typer.Typer(
    name="hertzchain",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="How hard each contact of a shocked chain of spheres is pressed, and how sure that is.",
    epilog="Exit status: 0 done and within tolerance, 1 out of tolerance, 2 unusable input, a"
    " refusal or a missing backend, 130 interrupted, 143 terminated.",
)


class Backend(StrEnum):
    """The simulations."""

    NATIVE = "native"
    LAMMPS = "lammps"
    LIGGGHTS = "liggghts"
    YADE = "yade"


class Engine(StrEnum):
    """The programs that decks are for."""

    LAMMPS = "lammps"
    LIGGGHTS = "liggghts"
    YADE = "yade"


class MethodName(StrEnum):
    """The native methods."""

    VELOCITY_VERLET = "velocity-verlet"
    RK4 = "rk4"
    DPRKN_6 = "dprkn-6"
    SRKN_6B = "srkn-6b"
    SRKN_11B = "srkn-11b"
    REFERENCE = "reference"


class PairStyle(StrEnum):
    """The styles of LAMMPS that are Hertz's law."""

    GRANULAR = "granular"
    HERTZ_HISTORY = "gran/hertz/history"


class Atoms(StrEnum):
    """Where the granules of a deck come from."""

    CREATE = "create"
    DATA = "data"


SceneFile = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file (TOML).")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Isolate = Annotated[
    bool,
    typer.Option(
        "--isolate", help="Run LAMMPS in a process of its own: a crash of it is an error, no more."
    ),
]
LammpsBinary = Annotated[
    str | None,
    typer.Option(
        "--lmp",
        metavar="PATH",
        help="Run this LAMMPS binary, of any version, and not the lammps module."
        " [env var: HERTZCHAIN_LMP]",
    ),
]
Ranks = Annotated[
    int | None, typer.Option(help="MPI ranks of the binary, by the mpiexec beside it or on PATH.")
]
TimeLimit = Annotated[
    str, typer.Option(help='How long each simulation may take, seconds or with a unit ("10 min").')
]


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"hertzchain {version('hertzchain')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    pass


@app.command()
def run(
    scene: SceneFile,
    backend: Annotated[Backend, typer.Option(help="Who simulates.")] = Backend.NATIVE,
    rtol: Annotated[
        float | None,
        typer.Option(
            help="Wanted relative accuracy of the peaks; chooses method and step. Default: 1e-6."
        ),
    ] = None,
    method: Annotated[
        MethodName | None,
        typer.Option(help="Instead of --rtol: a native method. The others have velocity-verlet."),
    ] = None,
    dt: Annotated[
        str | None,
        typer.Option(help='Instead of --rtol: the largest step, seconds or with a unit ("20 ns").'),
    ] = None,
    extrapolated: Annotated[
        bool,
        typer.Option(
            "--extrapolated",
            help="Not with native: extrapolate from two steps, an eighth of the cost.",
        ),
    ] = False,
    isolate: Isolate = False,
    lmp: LammpsBinary = None,
    ranks: Ranks = None,
    time_limit: TimeLimit = "1 h",
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Write the peaks of all contacts (.csv, .parquet) or all that is known (.json).",
        ),
    ] = None,
    trajectory: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Write the motion for viewers (.xyz or .extxyz: extended XYZ)."
        ),
    ] = None,
    frames: Annotated[
        int | None,
        typer.Option(
            min=2, help="With --trajectory: how many times, equally spaced. Default: 100."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Simulate a scene with one backend: peaks, p, F_SW, speed, error, cost."""
    from hertzchain.files import check_outputs
    from hertzchain.report import print_run
    from hertzchain.tables import check_result_format, write_result
    from hertzchain.trajectory import check_trajectory_format, frame_times, write_trajectory
    from hertzchain.units import to_si

    loaded = _load(scene)
    step = None if dt is None else to_si("--dt", dt, "s")
    limit = _time_limit(time_limit)
    if frames is not None and trajectory is None:
        raise HertzchainError("--frames goes with --trajectory FILE; leave the option out")
    check_outputs([scene], [output, trajectory])
    if output is not None:
        check_result_format(output)
    if trajectory is not None:
        check_trajectory_format(trajectory)
    with _progress() as tell:
        tell(
            f"{backend.value}: running (the first native run on a machine compiles, half a minute)"
        )
        simulation = _simulation(
            backend,
            method,
            step,
            rtol,
            extrapolated,
            isolate,
            lmp,
            ranks,
            limit,
            trajectory is None,
        )
        record = None if trajectory is None else frame_times(loaded, frames or DEFAULT_FRAMES)
        result = simulation.run(loaded, record)
    if output is not None:
        write_result(result, output)
    if trajectory is not None:
        write_trajectory(result, trajectory)
    if as_json:
        _print_json(result.to_dict())
    else:
        print_run(_console(), result)
    wanted = (DEFAULT_RTOL if method is None and step is None else None) if rtol is None else rtol
    if wanted is not None and result.error_estimate > wanted:
        from hertzchain.comparison import CODES

        why = (
            f"{CODES[backend]} gets no closer with steps that can be waited for;"
            " --backend native does"
            if backend is not Backend.NATIVE
            else "granules knock against one another for long, which multiplies rounding errors"
        )
        reached = f"wanted {wanted:g}, reached {result.error_estimate:.1g}"
        typer.echo(f"hertzchain: {reached}: {why}", err=True)
        raise typer.Exit(OUT_OF_TOLERANCE)


def _simulation(
    backend: Backend,
    method: MethodName | None,
    dt: float | None,
    rtol: float | None,
    extrapolated: bool,
    isolate: bool,
    lmp: str | None,
    ranks: int | None,
    time_limit: float,
    peaks_only: bool,
) -> Native | Lammps | Liggghts | Yade:
    from hertzchain.liggghts import Liggghts
    from hertzchain.native import Native
    from hertzchain.yade import Yade

    _refuse_options_of_lammps([backend], isolate, lmp, ranks)
    if backend is Backend.NATIVE:
        if extrapolated:
            raise HertzchainError("--extrapolated is not for --backend native; leave it out")
        name = None if method is None else method.value
        return Native(name, dt, rtol, peaks_only, time_limit)
    if method not in (None, MethodName.VELOCITY_VERLET):
        from hertzchain.comparison import CODES

        raise HertzchainError(
            f"--method {method}: {CODES[backend]} has only velocity-verlet; leave the option out"
        )
    if rtol is not None and dt is not None:
        raise HertzchainError("--rtol chooses the step: leave --dt out, or --rtol")
    wanted = DEFAULT_RTOL if rtol is None else rtol
    if backend is Backend.LIGGGHTS:
        return Liggghts(dt, rtol=wanted, extrapolated=extrapolated, time_limit=time_limit)
    if backend is Backend.YADE:
        return Yade(dt, rtol=wanted, extrapolated=extrapolated, time_limit=time_limit)
    lammps = _lammps(isolate, lmp, ranks, time_limit)
    return replace(lammps, dt=dt, rtol=wanted, extrapolated=extrapolated)


def _refuse_options_of_lammps(
    backends: list[Backend], isolate: bool, lmp: str | None, ranks: int | None
) -> None:
    for option, given in {"isolate": isolate, "lmp": lmp, "ranks": ranks}.items():
        if given and Backend.LAMMPS not in backends:
            raise HertzchainError(f"--{option} is for --backend lammps; leave the option out")


def _lammps(isolate: bool, lmp: str | None, ranks: int | None, time_limit: float) -> Lammps:
    """LAMMPS as a module or, where one is named, as a binary."""
    from hertzchain.errors import require
    from hertzchain.lammps import Lammps

    named = lmp or os.environ.get("HERTZCHAIN_LMP") or None
    if ranks is not None:
        require(ranks >= 1, "--ranks", ranks, "must be at least 1")
        if named is None:
            raise HertzchainError(
                "--ranks needs a LAMMPS binary, as the lammps module runs on one process: name one"
                " with --lmp or HERTZCHAIN_LMP"
            )
    if isolate and named is not None:
        raise HertzchainError(
            "--isolate is for the lammps module; what --lmp or HERTZCHAIN_LMP names is a process of"
            " its own anyway: leave the option out"
        )
    return Lammps(isolated=isolate, time_limit=time_limit, lmp=named, ranks=ranks or 1)


def _time_limit(given: str) -> float:
    """The time limit [s]."""
    from hertzchain.chain import POSITIVE, is_positive
    from hertzchain.errors import require
    from hertzchain.units import to_si

    limit = to_si("--time-limit", given, "s")
    require(is_positive(limit), "--time-limit", given, f"{POSITIVE} [s]")
    return limit


@app.command()
def compare(
    scene: SceneFile,
    backend: Annotated[
        list[Backend] | None,
        typer.Option(
            help="What to compare with the native reference; repeatable. Default: native, lammps."
        ),
    ] = None,
    isolate: Isolate = False,
    lmp: LammpsBinary = None,
    ranks: Ranks = None,
    time_limit: TimeLimit = "1 h",
    as_json: AsJson = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the comparison (png, pdf, svg).")
    ] = None,
    report_file: Annotated[
        Path | None,
        typer.Option(
            "--report",
            metavar="FILE",
            help="Write a page to read and to send (html): verdict, plots, tables, all numbers.",
        ),
    ] = None,
    results: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Judge peaks from any code instead: CSV with the columns contact, peak_force_N.",
        ),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(help="With --results: the largest relative difference. Default: 1e-3."),
    ] = None,
    dt: Annotated[
        str | None,
        typer.Option(help='With --results: the step they took, seconds or with a unit ("20 ns").'),
    ] = None,
    junit: Annotated[
        Path | None,
        typer.Option(
            "--junit", metavar="FILE", help="Write each check as a test case that CI systems read."
        ),
    ] = None,
) -> None:
    """Cross-validate a scene: native, LAMMPS and the formulas side by side, with a verdict."""
    from hertzchain import comparison, page, page_plots, report
    from hertzchain.files import write_text
    from hertzchain.junit import of_comparison, to_xml

    begun, begin = datetime.now(UTC), time.perf_counter()
    _check_outputs([scene, results], plot, report_file, junit)
    if results is not None:
        for option, given in (("--backend", backend), ("--isolate", isolate), ("--plot", plot)):
            if given:
                raise HertzchainError(
                    f"{option} does not go with --results, which compares with native alone; leave"
                    " one of them out"
                )
        _judge(scene, results, tolerance, dt, time_limit, as_json, report_file, junit)
    for option, value in (("--tolerance", tolerance), ("--dt", dt)):
        if value is not None:
            raise HertzchainError(f"{option} goes with --results FILE; leave the option out")
    loaded = _load(scene)
    _refuse_options_of_lammps(backend or [Backend.LAMMPS], isolate, lmp, ranks)
    lammps = _lammps(isolate, lmp, ranks, _time_limit(time_limit))
    names = comparison.DEFAULT_BACKENDS if not backend else [name.value for name in backend]
    with _progress() as tell:
        record = None if report_file is None else page_plots.record_times(loaded)
        compared = comparison.compare(loaded, names, lammps, progress=tell, record=record)
    suite = of_comparison(compared, scene.stem, begun, time.perf_counter() - begin)
    if as_json:
        _print_json(compared.to_dict())
    else:
        report.print_comparison(_console(), compared)
    _write("Plot", plot, lambda path: report.plot_comparison(compared, path))
    _write("Report", report_file, lambda path: page.write_comparison(compared, path, scene.name))
    _write("JUnit XML", junit, lambda path: write_text(path, to_xml([suite])))
    if compared.missing:
        raise typer.Exit(UNUSABLE)
    raise typer.Exit(DONE if compared.verdict == "pass" else OUT_OF_TOLERANCE)


def _check_outputs(
    inputs: list[Path | None], plot: Path | None, report_file: Path | None, junit: Path | None
) -> None:
    """Refuse, before any work is done, what could not be written."""
    from hertzchain import page, report
    from hertzchain.files import check_outputs

    check_outputs(inputs, [plot, report_file, junit])
    if plot is not None:
        report.check_plot_format(plot)
    if report_file is not None:
        page.check_page_format(report_file)


def _write(what: str, path: Path | None, write: Callable[[Path], object]) -> None:
    """Write a file where one is wanted.

    After the results are printed: a disk that is full takes no number with it.
    """
    if path is None:
        return
    with _progress() as tell:
        tell(f"writing {path}")
        write(path)
    typer.echo(f"{what} written to {path}", err=True)


def _judge(
    scene: Path,
    results: Path,
    tolerance: float | None,
    dt: str | None,
    time_limit: str,
    as_json: bool,
    report_file: Path | None,
    junit: Path | None,
) -> NoReturn:
    """Judge peaks from a file; the status says whether they pass."""
    from hertzchain import judgement, page, report
    from hertzchain.files import write_text
    from hertzchain.junit import of_judgement, to_xml
    from hertzchain.units import to_si

    begun, begin = datetime.now(UTC), time.perf_counter()
    loaded = _load(scene)
    step = None if dt is None else to_si("--dt", dt, "s")
    limit = _time_limit(time_limit)
    with _progress() as tell:
        judged = judgement.judge(
            loaded,
            results,
            tolerance=judgement.TOLERANCE if tolerance is None else tolerance,
            dt=step,
            time_limit=limit,
            progress=tell,
        )
    suite = of_judgement(judged, scene.stem, begun, time.perf_counter() - begin)
    if as_json:
        _print_json(judged.to_dict())
    else:
        report.print_judgement(_console(), judged)
    names = scene.name, results.name
    _write("Report", report_file, lambda path: page.write_judgement(judged, path, *names))
    _write("JUnit XML", junit, lambda path: write_text(path, to_xml([suite])))
    raise typer.Exit(DONE if judged.verdict == "pass" else OUT_OF_TOLERANCE)


@app.command()
def tradeoff(
    scene: SceneFile,
    as_json: AsJson = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw error against time (png, pdf, svg).")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write all that was measured (CSV).")
    ] = None,
) -> None:
    """Measure error against cost of every method on a scene; half a minute for 60 granules."""
    from hertzchain import report
    from hertzchain.files import check_outputs, write_text
    from hertzchain.tradeoff import tradeoff as measure

    loaded = _load(scene)
    check_outputs([scene], [plot, output])
    if plot is not None:
        report.check_plot_format(plot)
    with _progress() as tell:
        measured = measure(loaded, progress=tell)
    if as_json:
        _print_json(measured.to_dict())
    else:
        report.print_tradeoff(_console(), [measured])
    for remark in measured.remarks:
        typer.echo(f"hertzchain: {remark}", err=True)
    _write("Plot", plot, lambda path: report.plot_tradeoff([measured], path))
    _write("Table", output, lambda path: write_text(path, measured.to_frame().to_csv(index=False)))
    if measured.missing:
        raise typer.Exit(UNUSABLE)


@app.command()
def predict(scene: SceneFile, as_json: AsJson = False) -> None:
    """Predict without simulating: a map of peaks, p, F_SW, Eqs. 3, 6 and 9, the exact wave."""
    from hertzchain import theory
    from hertzchain.report import print_prediction

    prediction = theory.predict(_load(scene))
    if as_json:
        _print_json(prediction.to_dict())
    else:
        print_prediction(_console(), prediction)


@app.command()
def deck(
    scene: SceneFile,
    engine: Annotated[Engine, typer.Option(help="Whose deck.")] = Engine.LAMMPS,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Where to; standard output by default.")
    ] = None,
    rtol: Annotated[
        float | None,
        typer.Option(help="What the step may cost the peaks, as a fraction. Default: 1e-6."),
    ] = None,
    dt: Annotated[
        str | None,
        typer.Option(help='Instead of --rtol: the largest step, seconds or with a unit ("20 ns").'),
    ] = None,
    watch_every: Annotated[
        int | None,
        typer.Option(
            metavar="STEPS",
            help="Steps between two looks at the overlaps; 0: none, and no verdict. Default: 0.005"
            " natural time units.",
        ),
    ] = None,
    pair_style: Annotated[
        PairStyle, typer.Option(help="How LAMMPS is told Hertz's law.")
    ] = PairStyle.GRANULAR,
    atoms: Annotated[
        Atoms,
        typer.Option(help="Whether the deck makes the granules or reads FILE.data beside it."),
    ] = Atoms.CREATE,
    dump_every: Annotated[
        int, typer.Option(metavar="STEPS", help="Steps between two states for OVITO; 0: none.")
    ] = 0,
) -> None:
    """Write a deck of a scene for LAMMPS, LIGGGHTS or Yade that says whether its answer is right.

    For LAMMPS and Yade it finds the peak forces by itself and compares them with the true ones; for
    LIGGGHTS it compares the motion at the end.
    """
    from hertzchain import known_answer
    from hertzchain.files import check_outputs, write_texts
    from hertzchain.lammps.standalone import data_file, standalone
    from hertzchain.units import to_si

    loaded = _load(scene)
    if rtol is not None and dt is not None:
        raise HertzchainError("--rtol chooses the step: leave --dt out, or --rtol")
    options = {
        "--watch-every": watch_every is not None,
        "--pair-style": pair_style is not PairStyle.GRANULAR,
        "--atoms": atoms is not Atoms.CREATE,
        "--dump-every": dump_every != 0,
    }
    for option, is_given in options.items():
        if is_given and engine is not Engine.LAMMPS:
            raise HertzchainError(f"{option} is for --engine lammps; leave the option out")
    if output is None and atoms is Atoms.DATA:
        raise HertzchainError("--atoms data writes two files: name the deck with -o")
    data = None
    if output is not None and atoms is Atoms.DATA:
        data = output.with_name(output.name + ".data")
    check_outputs([scene], [output, data])
    longest = None if dt is None else to_si("--dt", dt, "s")
    wanted = known_answer.RTOL if rtol is None else rtol
    with _progress() as tell:
        tell("native: the step, and what the deck has to find")
        if engine is not Engine.LAMMPS:
            make = known_answer.yade_deck if engine is Engine.YADE else known_answer.liggghts_deck
            text = make(loaded, longest, wanted, scene.stem)
        else:
            layout = known_answer.lay_out(
                loaded,
                longest,
                wanted,
                watch_every,
                pair_style=pair_style.value,
                atoms=atoms.value,
                data_file="" if data is None else data.name,
                dump_every=dump_every,
                title=scene.stem,
                name="THIS_FILE" if output is None else output.name,
            )
            text = standalone(loaded, layout, known_answer.known_answer(loaded, layout))
    if output is None:
        typer.echo(text, nl=False)
    elif data is None:
        write_texts({output: text})
    else:
        write_texts({output: text, data: data_file(loaded, scene.stem)})


@app.command()
def lint(
    decks: Annotated[list[Path], typer.Argument(metavar="DECK...", help="LAMMPS input files.")],
    as_json: AsJson = False,
) -> None:
    """Look for known traps in anybody's LAMMPS deck of a chain; status 1 where there is one.

    Notes, which cost time only or may be meant, leave the status at 0.
    """
    from dataclasses import asdict

    from hertzchain.lammps.lint import lint_file

    found = {str(path): lint_file(path) for path in decks}
    if as_json:
        files = [
            {"file": file, "findings": [asdict(finding) for finding in findings]}
            for file, findings in found.items()
        ]
        _print_json({"decks": files})
    for file, findings in found.items():
        for finding in () if as_json else findings:
            where = f"{file}:{finding.line}: {finding.severity}"
            typer.echo(f"{where}: {finding.text} [{finding.rule}]")
    severities = [finding.severity for findings in found.values() for finding in findings]
    numbers = {kind: severities.count(kind) for kind in ("error", "warning", "note")}
    counts = [f"{count} {kind}{'s' * (count != 1)}" for kind, count in numbers.items()]
    typer.echo(", ".join(counts), err=as_json)
    raise typer.Exit(OUT_OF_TOLERANCE if {"error", "warning"} & set(severities) else DONE)


@app.command("unit-test")
def unit_test(
    scene: SceneFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Where to; standard output by default.")
    ] = None,
) -> None:
    """Write a test for LAMMPS's own suite: a scene's wave, with the motion that Eq. 1 gives it.

    The file is of the form of unittest/granular/tests/dem02-*.yaml in the sources of LAMMPS.
    """
    import time

    from hertzchain.files import check_outputs, write_text
    from hertzchain.lammps.unit_test import unit_test as test_text
    from hertzchain.unit_test import known_motion

    loaded = _load(scene)
    check_outputs([scene], [output])
    with _progress() as tell:
        tell("native: looking for the wave")
        motion = known_motion(loaded)
    text = test_text(motion, f"A wave in a chain of spheres, scene {scene.stem!r}", time.ctime())
    if output is None:
        typer.echo(text, nl=False)
    else:
        write_text(output, text)


@app.command()
def doctor() -> None:
    """Say what is installed, what works, and what to do about the rest."""
    from hertzchain.diagnosis import diagnose

    findings = diagnose()
    for finding in findings:
        mark = "ok  " if finding.works else "FAIL" if finding.needed else "--  "
        typer.echo(f"{mark}  {finding.name}: {finding.text}")
    usable = all(finding.works for finding in findings if finding.needed)
    raise typer.Exit(DONE if usable else UNUSABLE)


def _load(path: Path) -> Scene:
    """Read a scene; say so where it looks as if a unit had been forgotten."""
    from hertzchain.scene import Scene

    scene = Scene.from_toml(path)
    if scene.momentum_ratio > _ODD_RATIO:
        typer.echo(
            f"hertzchain: LM_ratio is {scene.momentum_ratio:.3g}, so this may take long: the pulse"
            f" lasts {scene.ramps[-1].end:.3g} s, is that meant?",
            err=True,
        )
    return scene


def _print_json(document: object) -> None:
    typer.echo(json.dumps(document, indent=2, allow_nan=False))


def _console() -> Console:
    from rich.console import Console

    console = Console(highlight=False, markup=False)
    if not console.is_terminal:  # a pipe has no width to fit a table into
        console.width = max(console.width, 120)
    return console


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Show what is being done on standard error, with the time it takes; gone when it is done."""
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("")

        def tell(text: str) -> None:
            bar.update(task, description=text)

        yield tell


class _Stopped(BaseException):
    """By Ctrl-C or SIGTERM; no Exception, as KeyboardInterrupt is none, which Typer keeps."""


@contextmanager
def _stoppable() -> Iterator[None]:
    """Let both raise, so that what is begun is cleaned up: at SIGTERM Python would end at once."""

    def stop(number: int, _: object) -> None:
        raise _Stopped(number)

    before = {}
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def main() -> None:
    """Run the command line; a user's mistake is one sentence and status 2."""
    try:
        with _stoppable():
            app(prog_name="hertzchain")
    except _Stopped as stop:
        number = stop.args[0]
        how = "interrupted" if number == signal.SIGINT else "terminated"
        typer.echo(f"hertzchain: {how}", err=True)
        sys.exit(128 + number)  # as shells have it
    except HertzchainError as problem:
        typer.echo(f"hertzchain: {problem}", err=True)
        sys.exit(UNUSABLE)
    except MemoryError:
        typer.echo("hertzchain: there is not enough memory for this scene", err=True)
        sys.exit(UNUSABLE)
    except OSError as problem:  # standard output is full or gone
        # What is left in its buffer must not fail again when Python ends.
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        typer.echo(f"hertzchain: {problem}", err=True)
        sys.exit(UNUSABLE)
