"""Reports for people: one page of HTML that needs neither server nor network.

Plots are Plotly's, whose script is inlined; tables are there without scripts, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.errors import OutputError
from hertzchain.files import write_text
from hertzchain.observables.peaks import largest_difference
from hertzchain.observables.result import Result
from hertzchain.report.facts import (
    answers,
    difference,
    judgement_facts,
    number,
    similar_scene,
)
from hertzchain.report.figures import describe
from hertzchain.report.page_plots import (
    LONG,
    Series,
    difference_plot,
    peak_plot,
    plotted_contacts,
    relative_difference,
)
from hertzchain.report.page_tables import CheckRow, Table, cost_table, peak_tables, split_table
from hertzchain.report.style import COLOURS, DASHES, LABELS
from hertzchain.report.waterfall import waterfall
from hertzchain.scene.scene import Scene

if TYPE_CHECKING:
    from hertzchain.verdict.check import Check
    from hertzchain.verdict.comparison import Comparison
    from hertzchain.verdict.judgement import Judgement

TEMPLATES = Path(__file__).parent / "templates"


# The verdict


@dataclass(frozen=True)
class Failure:
    """A check that failed.

    Parameters
    ----------
    name
        Of the check.
    found
        What was measured.
    advice
        What to do.
    """

    name: str
    found: str
    advice: str


def _failure(check: Check) -> Failure:
    off, tolerance = difference(check)
    if not off:
        return Failure(check.name, "", check.reason)
    found = f"off by {off}, allowed is {tolerance} ({check.reason})"
    return Failure(check.name, found, check.kind.advice)


@dataclass(frozen=True)
class Verdict:
    """The head of a page.

    Parameters
    ----------
    passed
        Whether all is well; None where that could not be said.
    sentence
        What that means.
    failures
        What failed.
    remarks
        Warnings, and what could not be said.
    """

    passed: bool | None
    sentence: str
    failures: Sequence[Failure] = ()
    remarks: Sequence[str] = ()

    @property
    def word(self) -> str:
        """``PASS``, ``FAIL`` or ``UNDECIDED``."""
        return "UNDECIDED" if self.passed is None else "PASS" if self.passed else "FAIL"


def _verdict(comparison: Comparison, codes: Sequence[str]) -> Verdict:
    checks = comparison.checks
    failed = [check for check in checks if not check.passed]
    made = [check for check in checks if check.measured is not None or check.passed]
    only_absent = bool(failed) and all(check.measured is None for check in failed)
    ran = [name for name in codes if name in comparison.results]
    if not failed and ran:
        peaks = [comparison.results[name].peak_force for name in ran]
        off = max(largest_difference(found, comparison.native.peak_force) for found in peaks)
        who = " and ".join(LABELS[name] for name in ran)
        sentence = (
            f"All {len(checks)} checks passed. Peaks by {who} differ from those of native by"
            f" {off:.1e} at most, within the errors that both claim."
        )
    elif not failed:
        sentence = (
            f"All {len(checks)} checks of native passed; no other simulation was compared with it,"
            " so that nothing but its own balances and error estimate speaks for it."
        )
    elif only_absent:
        sentence = (
            f"Not everything that was asked for could be compared. The {len(made)}"
            " checks that could be made passed."
        )
    else:
        sentence = f"{len(failed)} of {len(checks)} checks failed."
    remarks = [
        f"{LABELS[name]}: {warning}"
        for name, result in comparison.results.items()
        for warning in result.warnings
    ]
    remarks += [
        f"Formulas: {remark}"
        for remark in (comparison.formulas.applicable, comparison.formulas.note)
        if remark
    ]
    remarks += [f"{check.name}: {check.remark}" for check in checks if check.remark]
    asked = {check.engine for check in checks}
    remarks += [
        f"{LABELS[name]} has not been asked"
        for name in comparison.wanted
        if name not in comparison.results and name not in asked
    ]
    passed = None if only_absent else not failed
    return Verdict(passed, sentence, [_failure(check) for check in failed], remarks)


# Pages


def check_page_format(path: Path | str) -> None:
    """Raise an OutputError, before any work is done, for a name that is no page's.

    Raises
    ------
    OutputError
        If the file name does not end in .html or .htm.
    """
    if Path(path).suffix.lower() not in (".html", ".htm"):
        raise OutputError(f"{path}: a report is a page, the name must end in .html or .htm")


def comparison_page(comparison: Comparison, file: str = "scene.toml") -> str:
    """A comparison as a page of HTML.

    Parameters
    ----------
    comparison
        What to show; contact force over time if its results have a history, see ``record_times``.
    file
        The name of the scene file.
    """
    native, formulas = comparison.native, comparison.formulas
    codes = [name for name in comparison.wanted if name != native.backend]
    nothing = np.full(native.contact.size, np.nan)
    series: Series = []
    for name in codes:
        result = comparison.results.get(name)
        series.append((name, LABELS[name], nothing if result is None else result.peak_force))
    ran = [entry for entry in series if entry[0] in comparison.results]
    equations: Series = [(name, LABELS[name], getattr(formulas, name)) for name in ("eq6", "eq9")]
    compared = ran + (equations if formulas.applicable is None else [])
    off = [relative_difference(values, native) for _, _, values in compared]
    plotted = plotted_contacts(native, off)
    limits = [
        (f"{LABELS[name]}, error estimate", COLOURS[name], DASHES[name], result.error_estimate)
        for name, result in comparison.results.items()
        if name != native.backend
    ]
    limits.append(("reference, error estimate", COLOURS["native"], "solid", native.error_estimate))
    absent = [LABELS[name] for name in codes if name not in comparison.results]
    missing = f" {' and '.join(absent)}: not run." if absent else ""
    plots = [
        peak_plot(native, compared, plotted, missing),
        waterfall(comparison.results),
        difference_plot(native, compared, plotted, limits),
    ]
    header = ["", *(LABELS[name] for name in comparison.wanted), "formulas"]
    return render(
        "comparison.html.jinja",
        {
            "kind": "Comparison",
            "title": describe(comparison.scene),
            "file": file,
            "verdict": _verdict(comparison, codes),
            "plots": {plot.name: plot for plot in plots if plot is not None},
            "peaks": peak_tables(comparison, series + equations, len(codes)),
            "long": LONG,
            "answers": Table(
                "The transition and the wave that leaves it",
                header,
                [[label, *cells] for label, cells in answers(comparison)],
            ),
            "rows": [CheckRow.of(check) for check in comparison.checks],
            "notes": [
                f"{LABELS[name]} computed {similar}"
                for name, result in comparison.results.items()
                if (similar := similar_scene(result)) is not None
            ],
            "cost": cost_table(comparison),
            "texts": _texts(comparison.scene),
            "versions": _versions(comparison.results),
            "numbers": comparison.to_dict(),
            "numbers_name": "comparison.json",
        },
    )


def judgement_page(judgement: Judgement, file: str = "scene.toml", peaks: str = "") -> str:
    """A judgement of given peaks as a page of HTML.

    Parameters
    ----------
    judgement
        What to show.
    file, peaks
        The names of the scene file and of the file of peaks.
    """
    native, tolerance = judgement.reference, judgement.tolerance
    series: Series = [("lammps", "given", judgement.given)]
    plotted = plotted_contacts(native, [np.abs(judgement.difference)])
    limits = [
        ("tolerance", COLOURS["eq6"], "dash", tolerance),
        ("reference, error estimate", COLOURS["native"], "solid", native.error_estimate),
    ]
    failed = int(np.count_nonzero(judgement.judged & ~judgement.passed))
    judged = int(np.count_nonzero(judgement.judged))
    if judged == 0:
        sentence = "No contact could be judged."
    elif failed == 0:
        sentence = f"All {judged} judged contacts are within {tolerance:.1e} of the reference."
    else:
        sentence = f"{failed} of {judged} judged contacts are off by more than {tolerance:.1e}."
    failures = []
    if failed:
        cause = judgement.cause or "no known pattern"
        failures = [Failure("Likely cause", "", cause)]
    header = ["contact", "given [N]", "native [N]", "difference", ""]
    words = {True: "pass", False: "FAIL", None: "not judged"}
    rows = [
        [
            str(row["contact"]),
            number(row["given_N"], 9),
            number(row["reference_N"], 9),
            "" if row["difference"] is None else f"{row['difference']:+.1e}",
            "not given" if row["given_N"] is None else words[row["passed"]],  # type: ignore[index]
        ]
        for row in judgement.rows
    ]
    plots = [
        peak_plot(native, series, plotted, ""),
        difference_plot(native, series, plotted, limits),
    ]
    return render(
        "judgement.html.jinja",
        {
            "kind": "Judgement of given peaks",
            "title": describe(native.scene),
            "file": file,
            "given": peaks,
            "verdict": Verdict(
                None if judged == 0 else judgement.verdict == "pass",
                sentence,
                failures,
                [*judgement.remarks, *native.warnings],
            ),
            "plots": {plot.name: plot for plot in plots},
            "facts_of_all": judgement_facts(judgement),
            "peaks": split_table(native, "Peak force of each contact", header, rows),
            "long": LONG,
            "texts": _texts(native.scene),
            "versions": _versions({"native": native}),
            "numbers": judgement.to_dict(),
            "numbers_name": "judgement.json",
        },
    )


def _texts(scene: Scene) -> list[tuple[str, str]]:
    """Names and contents of the files that make a scene, the TOML first."""
    texts = scene.to_texts(Path("scene.toml"))
    return [(path.name, text) for path, text in reversed(texts.items())]


def _versions(results: Mapping[str, Result]) -> list[tuple[str, str]]:
    """What has taken part, and on what it ran."""
    found: dict[str, str] = {}
    for result in results.values():
        found |= result.to_dict()["provenance"]
    return list(found.items())


def render(template: str, content: Mapping[str, Any], templates: Sequence[Path] = ()) -> str:
    """Fill a template; whatever is filled in is escaped.

    Parameters
    ----------
    template
        Its file name.
    content
        What it shows.
    templates
        Folders with templates beside those of this package.
    """
    from importlib.metadata import version

    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from plotly.offline import get_plotlyjs

    environment = Environment(
        loader=FileSystemLoader([*templates, TEMPLATES]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    compact = {"separators": (",", ":"), "allow_nan": False}
    environment.policies["json.dumps_kwargs"] = compact
    return environment.get_template(template).render(
        content,
        plotly=get_plotlyjs(),
        version=version("hertzchain"),
        date=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
    )


def write_comparison(comparison: Comparison, path: Path | str, file: str = "scene.toml") -> None:
    """Write ``comparison_page`` to a file, whole or not at all.

    Raises
    ------
    OutputError
        If the suffix is not .html or .htm, or the file cannot be written.
    """
    check_page_format(path)
    write_text(path, comparison_page(comparison, file))


def write_judgement(
    judgement: Judgement, path: Path | str, file: str = "scene.toml", peaks: str = ""
) -> None:
    """Write ``judgement_page`` to a file, whole or not at all.

    Raises
    ------
    OutputError
        If the suffix is not .html or .htm, or the file cannot be written.
    """
    check_page_format(path)
    write_text(path, judgement_page(judgement, file, peaks))
