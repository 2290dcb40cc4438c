"""hertzchain compare: a verdict on the backends or, with --results, on peaks from elsewhere."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from hertzchain.cli.options import (
    AsJson,
    Backend,
    Isolate,
    LammpsBinary,
    Ranks,
    SceneFile,
    TimeLimit,
    lammps_options,
    load_scene,
    refuse_without_need,
    to_step,
    to_time_limit,
)
from hertzchain.cli.output import (
    DONE,
    OUT_OF_TOLERANCE,
    UNUSABLE,
    console,
    print_json,
    progress,
    write_file,
)
from hertzchain.engines.registry import ENGINES
from hertzchain.errors import HertzchainError


def compare(
    scene: SceneFile,
    backend: Annotated[
        list[Backend] | None,
        typer.Option(
            help="What to compare with the native reference; repeatable. Default: native, lammps.",
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
    from hertzchain.files import write_text
    from hertzchain.report import console as report
    from hertzchain.report import figures, page
    from hertzchain.report.junit import of_comparison, to_xml
    from hertzchain.report.waterfall import record_times
    from hertzchain.verdict import comparison

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
    refuse_without_need(False, tolerance=tolerance is not None, dt=dt is not None)
    loaded = load_scene(scene)
    with_lammps = not backend or "lammps" in backend
    refuse_without_need(with_lammps, isolate=isolate, lmp=lmp, ranks=ranks)
    lammps = ENGINES["lammps"].make(
        time_limit=to_time_limit(time_limit), **lammps_options(isolate, lmp, ranks)
    )
    with progress() as tell:
        record = None if report_file is None else record_times(loaded)
        compared = comparison.compare(
            loaded, backend or None, progress=tell, record=record, engines={"lammps": lammps}
        )
    suite = of_comparison(compared, scene.stem, begun, time.perf_counter() - begin)
    if as_json:
        print_json(compared.to_dict())
    else:
        report.print_comparison(console(), compared)
    write_file("Plot", plot, lambda path: figures.plot_comparison(compared, path))
    write_file(
        "Report", report_file, lambda path: page.write_comparison(compared, path, scene.name)
    )
    write_file("JUnit XML", junit, lambda path: write_text(path, to_xml([suite])))
    if compared.missing:
        raise typer.Exit(UNUSABLE)
    raise typer.Exit(DONE if compared.verdict == "pass" else OUT_OF_TOLERANCE)


def _check_outputs(
    inputs: list[Path | None], plot: Path | None, report_file: Path | None, junit: Path | None
) -> None:
    """Refuse, before any work is done, what could not be written."""
    from hertzchain.files import check_outputs
    from hertzchain.report import figures, page

    check_outputs(inputs, [plot, report_file, junit])
    if plot is not None:
        figures.check_plot_format(plot)
    if report_file is not None:
        page.check_page_format(report_file)


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
    from hertzchain.files import write_text
    from hertzchain.report import console as report
    from hertzchain.report import page
    from hertzchain.report.junit import of_judgement, to_xml
    from hertzchain.verdict import judgement

    begun, begin = datetime.now(UTC), time.perf_counter()
    loaded = load_scene(scene)
    step = to_step(dt)
    limit = to_time_limit(time_limit)
    with progress() as tell:
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
        print_json(judged.to_dict())
    else:
        report.print_judgement(console(), judged)
    names = scene.name, results.name
    write_file("Report", report_file, lambda path: page.write_judgement(judged, path, *names))
    write_file("JUnit XML", junit, lambda path: write_text(path, to_xml([suite])))
    raise typer.Exit(DONE if judged.verdict == "pass" else OUT_OF_TOLERANCE)
