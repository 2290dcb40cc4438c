"""The commands. Results go to standard output, talk and progress to standard error."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hertzchain.errors import HertzchainError

if TYPE_CHECKING:
    from rich.console import Console

    from hertzchain.arrays import FloatArray
    from hertzchain.lammps import Lammps
    from hertzchain.liggghts import Liggghts
    from hertzchain.native import Native
    from hertzchain.scene import Scene
    from hertzchain.yade import Yade

DONE, OUT_OF_TOLERANCE, UNUSABLE = 0, 1, 2

DEFAULT_RTOL = 1e-6
"""What both backends aim at where nothing is asked for."""

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


SceneFile = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file (TOML).")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Isolate = Annotated[
    bool,
    typer.Option(
        "--isolate", help="Run LAMMPS in a process of its own: a crash of it is an error, no more."
    ),
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
    time_limit: TimeLimit = "1 h",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write the peaks of all contacts (CSV).")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Simulate a scene with one backend: peaks, p, F_SW, speed, error, cost."""
    from hertzchain.files import check_writable, write_text
    from hertzchain.report import print_run
    from hertzchain.units import to_si

    loaded = _load(scene)
    step = None if dt is None else to_si("--dt", dt, "s")
    limit = _time_limit(time_limit)
    if output is not None:
        check_writable(output)
    with _progress() as tell:
        tell(
            f"{backend.value}: running (the first native run on a machine compiles, half a minute)"
        )
        simulation = _simulation(backend, method, step, rtol, extrapolated, isolate, limit)
        result = simulation.run(loaded)
    if output is not None:
        write_text(output, result.to_frame().to_csv(index=False))
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
    time_limit: float,
) -> Native | Lammps | Liggghts | Yade:
    from hertzchain.lammps import Lammps
    from hertzchain.liggghts import Liggghts
    from hertzchain.native import Native
    from hertzchain.yade import Yade

    if isolate and backend is not Backend.LAMMPS:
        raise HertzchainError("--isolate is for --backend lammps; leave the option out")
    if backend is Backend.NATIVE:
        if extrapolated:
            raise HertzchainError("--extrapolated is not for --backend native; leave it out")
        name = None if method is None else method.value
        return Native(name, dt, rtol, peaks_only=True, time_limit=time_limit)
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
    return Lammps(
        dt, rtol=wanted, extrapolated=extrapolated, isolated=isolate, time_limit=time_limit
    )


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
    time_limit: TimeLimit = "1 h",
    as_json: AsJson = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the comparison (png, pdf, svg).")
    ] = None,
) -> None:
    """Cross-validate a scene: native, LAMMPS and the formulas side by side, with a verdict."""
    from hertzchain import comparison, report
    from hertzchain.files import check_writable
    from hertzchain.lammps import Lammps

    loaded = _load(scene)
    lammps = Lammps(isolated=isolate, time_limit=_time_limit(time_limit))
    if plot is not None:
        check_writable(plot)
        report.check_plot_format(plot)
    names = comparison.DEFAULT_BACKENDS if not backend else [name.value for name in backend]
    with _progress() as tell:
        compared = comparison.compare(loaded, names, lammps, progress=tell)
        if plot is not None:
            tell("drawing")
            report.plot_comparison(compared, plot)
    if as_json:
        _print_json(compared.to_dict())
    else:
        report.print_comparison(_console(), compared)
    if plot is not None:
        typer.echo(f"Plot written to {plot}", err=True)
    if compared.missing:
        raise typer.Exit(UNUSABLE)
    raise typer.Exit(DONE if compared.verdict == "pass" else OUT_OF_TOLERANCE)


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
    from hertzchain.files import check_writable, write_text
    from hertzchain.tradeoff import tradeoff as measure

    loaded = _load(scene)
    for path in (plot, output):
        if path is not None:
            check_writable(path)
    if plot is not None:
        report.check_plot_format(plot)
    with _progress() as tell:
        measured = measure(loaded, progress=tell)
        if plot is not None:
            tell("drawing")
            report.plot_tradeoff([measured], plot)
    if output is not None:
        write_text(output, measured.to_frame().to_csv(index=False))
    if as_json:
        _print_json(measured.to_dict())
    else:
        report.print_tradeoff(_console(), [measured])
    for remark in measured.remarks:
        typer.echo(f"hertzchain: {remark}", err=True)
    if plot is not None:
        typer.echo(f"Plot written to {plot}", err=True)
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
) -> None:
    """Write a deck of a scene for LAMMPS, LIGGGHTS or Yade; its peaks are right to 1e-6."""
    from hertzchain.files import check_writable, write_text

    loaded = _load(scene)
    if output is not None:
        check_writable(output)
    with _progress() as tell:
        tell("native velocity Verlet: looking for the step")
        text = _deck(engine, loaded, deck_step(loaded), scene.stem)
    if output is None:
        typer.echo(text, nl=False)
    else:
        write_text(output, text)


def _deck(engine: Engine, scene: Scene, dt: float, title: str) -> str:
    from hertzchain.lammps.deck import deck as for_lammps
    from hertzchain.liggghts.deck import deck as for_liggghts
    from hertzchain.native import Native
    from hertzchain.yade.deck import deck as for_yade

    if engine is Engine.LIGGGHTS:
        same_steps = Native("velocity-verlet", dt).run(scene)
        return for_liggghts(scene, dt, same_steps.velocity, title)
    if engine is Engine.YADE:
        peak_force = Native("reference").run(scene).peak_force
        # The step is for 1e-6, by an estimate from two runs; twice that is beyond it.
        return for_yade(scene, dt, peak_force, 2e-6, title)
    return for_lammps(scene, dt, title=title)


def deck_step(scene: Scene) -> float:
    """The step of a deck [s]: peaks to 1e-6, by native velocity Verlet, the scheme of LAMMPS.

    Cut to two digits in natural units, so that it is the same on every machine.
    """
    from hertzchain.accuracy import second_order_step
    from hertzchain.native import Native

    def peaks_at(dt: float) -> FloatArray:
        return Native("velocity-verlet", dt, peaks_only=True).run(scene).peak_force

    unit = scene.units.time
    natural = second_order_step(peaks_at, 0.04 * unit, 1e-6) / unit
    digit = 10.0 ** (math.floor(math.log10(natural)) - 1)
    return math.floor(natural / digit) * digit * unit


@app.command()
def doctor() -> None:
    """Say what is installed, what works, and what to do about the rest."""
    from hertzchain.diagnosis import diagnose

    findings = diagnose()
    for finding in findings:
        typer.echo(f"{'ok  ' if finding.works else 'FAIL'}  {finding.name}: {finding.text}")
    raise typer.Exit(DONE if all(finding.works for finding in findings) else UNUSABLE)


def _load(path: Path) -> Scene:
    from hertzchain.scene import Scene

    return Scene.from_toml(path)


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
            app()
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
