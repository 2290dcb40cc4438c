"""hertzchain compare: a verdict on the backends, on given peaks or on a user's deck."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from hertzchain.cli import options, output
from hertzchain.engines.registry import ENGINES
from hertzchain.errors import HertzchainError
from hertzchain.limits import RTOL


def compare(  # noqa: PLR0915 - three kinds of documents, one after the other
    scene: options.SceneFile,
    backend: Annotated[
        list[options.Backend] | None,
        typer.Option(
            help="Backend to compare with the reference; repeatable. Default: native, lammps.",
        ),
    ] = None,
    isolate: options.Isolate = False,
    lmp: options.LammpsBinary = None,
    ranks: options.Ranks = None,
    rtol: Annotated[
        float | None,
        typer.Option(
            help="Wanted relative accuracy of the codes that are compared. Default: 1e-6."
        ),
    ] = None,
    time_limit: options.TimeLimit = "1 h",
    as_json: options.AsJson = False,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw peaks and differences (png, pdf, svg)."),
    ] = None,
    report_file: Annotated[
        Path | None,
        typer.Option(
            "--report",
            metavar="FILE",
            help="Write a page (html): verdict, plots, tables, all numbers.",
        ),
    ] = None,
    results: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Judge results of any code instead: CSV with the columns contact, peak_force_N, or"
            " samples of forces or positions: tables, LAMMPS logs and dumps, trajectories of ASE.",
        ),
    ] = None,
    column: options.Columns = None,
    units: options.UnitsOfResults = None,
    deck: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Examine a LAMMPS deck instead: every number, then its peaks, with the lines to"
            " mend.",
        ),
    ] = None,
    variables: Annotated[
        list[str] | None,
        typer.Option(
            "--var",
            metavar="NAME VALUE",
            help="With --deck: a variable, as LAMMPS's -var gives it; repeatable.",
        ),
    ] = None,
    fix: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="With --deck: write the deck with all proven corrections."
        ),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(
            help="With --results or --deck: the largest relative difference. Default: 1e-3."
        ),
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
    from hertzchain.files import check_outputs, write_text
    from hertzchain.report import figures, page
    from hertzchain.report.comparison import of_comparison
    from hertzchain.report.console import print_document
    from hertzchain.report.judgement import of_judgement
    from hertzchain.report.junit import to_xml
    from hertzchain.report.user_deck import of_examination
    from hertzchain.report.waterfall import record_times
    from hertzchain.verdict import comparison, judgement, user_deck
    from hertzchain.verdict.check import NOT_RUN
    from hertzchain.verdict.results.judging import judge_peaks

    begun, begin = datetime.now(UTC), time.perf_counter()
    check_outputs([scene, results, deck], [plot, report_file, junit, fix])
    if plot is not None:
        figures.check_plot_format(plot)
    if report_file is not None:
        page.check_page_format(report_file)
    _refuse_together(results, deck, backend, isolate, ranks, rtol)
    is_judged = results is not None or deck is not None
    options.refuse_without_need(is_judged, tolerance=tolerance is not None)
    options.refuse_without_need(
        results is not None, dt=dt is not None, column=bool(column), units=units is not None
    )
    options.refuse_without_need(deck is not None, var=bool(variables), fix=fix is not None)
    loaded, missing = options.load_scene(scene), False
    wanted = judgement.TOLERANCE if tolerance is None else tolerance
    if deck is not None:
        limit = options.to_time_limit(time_limit)
        with output.progress() as report_progress, output.compiling(report_progress):
            examined = user_deck.examine(
                loaded,
                deck,
                options.by_name("--var", variables or [], "F0=100"),
                tolerance=wanted,
                lmp=options.named_binary(lmp),
                time_limit=limit,
                progress=report_progress,
            )
        document = of_examination(examined)
        output.write_file("Deck", fix, lambda path: write_text(path, examined.fix))
    elif results is not None:
        step, limit = options.to_step(dt), options.to_time_limit(time_limit)
        with output.progress() as report_progress, output.compiling(report_progress):
            document = of_judgement(
                judge_peaks(
                    loaded,
                    results,
                    columns=options.by_name("--column", column or [], "peak_force=F"),
                    units="si" if units is None else units.value,
                    tolerance=wanted,
                    dt=step,
                    time_limit=limit,
                    progress=report_progress,
                )
            )
    else:
        with_lammps = not backend or "lammps" in backend
        options.refuse_without_need(with_lammps, isolate=isolate, lmp=lmp, ranks=ranks)
        how = {"rtol": RTOL if rtol is None else rtol}
        how["time_limit"] = options.to_time_limit(time_limit)
        named = [str(name) for name in backend or () if name not in ("native", "lammps")]
        engines = {name: ENGINES[name].make(**how) for name in named}
        engines["lammps"] = ENGINES["lammps"].make(
            **how, **options.lammps_options(isolate, lmp, ranks)
        )
        with output.progress() as report_progress, output.compiling(report_progress):
            record = None if report_file is None else record_times(loaded)
            compared = comparison.compare(
                loaded,
                backend or None,
                progress=report_progress,
                record=record,
                engines=engines,
            )
        document, missing = of_comparison(compared), compared.missing
    suite = document.suite(scene.stem, begun, time.perf_counter() - begin)
    if as_json:
        output.print_json(document.numbers())
    else:
        print_document(output.console(), document)
    output.write_file("Plot", plot, lambda path: figures.plot_document(document, path))
    given = results or deck
    names = scene.name, "" if given is None else given.name
    output.write_file("Report", report_file, lambda path: page.write_page(document, path, *names))
    output.write_file("JUnit XML", junit, lambda path: write_text(path, to_xml([suite])))
    if missing:
        for check in document.checks:
            if check.kind == NOT_RUN:
                output.say(f"{check.name}: {check.reason}")
        raise typer.Exit(output.UNUSABLE)
    raise typer.Exit(output.DONE if document.verdict.passed else output.OUT_OF_TOLERANCE)


def _refuse_together(
    results: Path | None,
    deck: Path | None,
    backend: list[options.Backend] | None,
    isolate: bool,
    ranks: int | None,
    rtol: float | None,
) -> None:
    """Refuse options that cannot be combined with given peaks or a user's deck."""
    if results is not None and deck is not None:
        raise HertzchainError("--deck does not go with --results: leave one of them out")
    given = {"--backend": backend, "--isolate": isolate, "--rtol": rtol}
    whose = {"--results": results, "--deck": deck}
    why = {
        "--results": "compares with native alone",
        "--deck": "runs the deck in LAMMPS, in a process of its own, and compares with native",
    }
    for name, file in whose.items():
        for option, is_given in given.items():
            if file is not None and is_given:
                raise HertzchainError(
                    f"{option} does not go with {name}, which {why[name]}; leave one of them out"
                )
    if deck is not None and ranks is not None:
        raise HertzchainError("--ranks does not go with --deck, which runs on one process")
