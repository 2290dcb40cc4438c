"""The examination of a user's deck: LAMMPS reads it, every number is compared with the scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from hertzchain.engines.lammps.reading.deck import UNITS, FoundDeck
from hertzchain.engines.lammps.reading.reading import DEPTH, Reader
from hertzchain.engines.lammps.reading.text import Edits
from hertzchain.engines.native.backend import Native, with_end
from hertzchain.errors import RunFailed, SceneError, require
from hertzchain.examiner.correct import Prover, with_findings, with_trials
from hertzchain.examiner.examined import (
    EXAMINED,
    Case,
    DeckCheck,
    DeckExamination,
    Finding,
    by_command,
    in_order,
    place,
)
from hertzchain.examiner.measured import (
    TwinRun,
    constant_force,
    in_si,
    laws,
    run_twin,
    start_of_shock,
    stretches_of,
    twin_of,
    with_held,
    with_loads,
)
from hertzchain.examiner.probes import all_checks, peaks_check
from hertzchain.limits import TIME_LIMIT, TOLERANCE, Deadline, check_time_limit, check_tolerance
from hertzchain.observables.result import Result
from hertzchain.progress import ShowProgress, telling
from hertzchain.scene.scene import Scene, SceneLike, to_scene
from hertzchain.scene.schedule import Run


def examine(
    scene: SceneLike,
    deck: Path | str,
    variables: Mapping[str, object] | None = None,
    *,
    tolerance: float = TOLERANCE,
    lmp: str | None = None,
    time_limit: float = TIME_LIMIT,
    strict: bool = False,
    progress: ShowProgress = None,
) -> DeckExamination:
    """Compare a user's LAMMPS deck with a scene, number by number, then its peaks.

    LAMMPS itself reads the deck, in a separate process and folder; no file of the deck's own is
    written.

    Parameters
    ----------
    scene
        What the deck should compute, or the path of its file.
    deck
        The input script, with any axis and units of LAMMPS.
    variables
        As ``-var NAME VALUE`` of LAMMPS, by name.
    tolerance
        Largest relative difference of the peaks that passes; a number may differ if that changes no
        peak by more.
    lmp
        A LAMMPS binary to use instead of its Python module.
    time_limit
        Time limit of LAMMPS and the reference together [s].
    strict
        Whether differences fail that change no peak by more than a tenth of the tolerance.
    progress
        True for a line in the terminal on what is being done, or a function that is
        called with it.

    Raises
    ------
    BackendMissing
        If LAMMPS is not there, or stops on a command that the examination adds to the deck.
    SceneError
        For an impossible scene, tolerance or deck.
    RunFailed
        If LAMMPS stops with an error, or the deck cannot be examined.
    """
    scene = with_end(to_scene(scene))
    allowed = (
        "cannot be in the scene of a deck that is examined: judge its peaks, with"
        " hertzchain judge SCENE peaks.csv"
    )
    require(scene.near_wall is None, "near_wall", None, allowed)
    check_tolerance(tolerance)
    if Path(deck).suffix.lower() == ".py":
        allowed = "is a Python program, must be a LAMMPS input script, as lmp -in reads it"
        raise SceneError("", None, allowed, file=deck)
    check_time_limit(time_limit)
    deadline = Deadline(time_limit)
    truths: dict[float, Result] = {}
    with (
        telling(progress) as say,
        Reader(Path(deck), scene, variables or {}, deadline, lmp, say) as reader,
    ):

        def examined(edits: Edits, limit: float = math.inf) -> DeckExamination:
            contents = reader.read(edits, limit)
            before = _settles(contents, scene)
            if before > 0:
                contents = reader.read(edits, limit, before)
            say("native: the reference method")
            return compared(scene, str(deck), contents, float(tolerance), deadline, truths, strict)

        done, seconds = examined({}), deadline.limit - deadline.left
        if done.to_correct and done.contents.is_chain:
            say("trying corrections")
            done = with_findings(Prover(done, examined, seconds))
    return replace(done, texts=_texts(Path(deck), done.contents))


def _settles(deck: FoundDeck, scene: Scene) -> float:
    """Time that a deck runs before the run in which its shock begins, in its own unit."""
    if deck.stopped or not deck.is_chain or not deck.runs:
        return 0.0
    deck, units = in_si(deck, scene)
    start = start_of_shock(with_loads(deck, scene), scene)
    return max(run.start for run in deck.runs if run.start <= start * (1 + 1e-9)) / units.time


def _texts(deck: Path, contents: FoundDeck) -> tuple[tuple[str, str], ...]:
    """The texts of the files of commands, without files that cannot be read any more."""
    texts = []
    for name in dict.fromkeys(command.file for command in contents.commands):
        paths = (deck, deck.parent / name, Path(name))
        path = next((p for p in paths if p.is_file() and Path(name).name == p.name), None)
        if path is not None:
            texts.append((name, path.read_text(encoding="utf-8-sig", errors="replace")))
    return tuple(texts)


def compared(
    scene: Scene,
    deck: str,
    contents: FoundDeck,
    tolerance: float,
    deadline: Deadline,
    truths: dict[float, Result] | None = None,
    strict: bool = False,
) -> DeckExamination:
    """The examination of a deck that LAMMPS has read; ``truths`` keeps references by their ends."""
    if not contents.is_chain:
        return _no_chain(scene, deck, contents, tolerance, deadline)
    case, truth = case_of(scene, contents, tolerance, deadline, {} if truths is None else truths)
    case = replace(case, strict=strict)
    checks = in_order([with_trials(case, check) for check in all_checks(case)])
    peaks_of_deck = peaks_check(case)
    if not peaks_of_deck.passed and checks:
        # Digits alone may add up: then the number with the largest effect is to be corrected.
        first = checks[0]
        peaks_of_deck = replace(peaks_of_deck, place=first.place)
    return DeckExamination(
        scene, deck, case.deck, (*checks, peaks_of_deck), truth, case.judged, tolerance,
        _remarks(case), findings=tuple(Finding(tuple(group)) for group in by_command(checks)),
    )  # fmt: skip


def case_of(
    scene: Scene,
    deck: FoundDeck,
    tolerance: float,
    deadline: Deadline,
    truths: dict[float, Result],
) -> tuple[Case, Result]:
    """Return data in SI units for the checks of a deck, and the reference up to the deck's end."""
    deck, units = in_si(deck, scene)
    deck = with_loads(deck, scene)
    start = start_of_shock(deck, scene)
    end = deck.end_time - start
    if deck.stopped:  # no peak is judged
        end = min(end, scene.end_time)
    truth = truths[end] = truths.get(end) or _truth(scene, end, deadline)
    error = truth.error_estimate
    allowed = f"must be at least 10 times the error of the reference, {error:.1e}"
    require(tolerance >= 10 * error, "tolerance", tolerance, allowed)
    peaks, passed = truth.peak_force, truth.peak_passed
    if end < scene.end_time * (1 - 1e-9) and not deck.stopped:
        # A reflected wave may press a contact harder after the deck's end.
        last = truths[scene.end_time] = truths.get(scene.end_time) or _truth(
            scene, scene.end_time, deadline
        )
        passed = passed & (last.peak_force <= (1 + tolerance) * peaks)
    near = (np.maximum(peaks, 1e-3 * np.max(peaks)) / scene.granules.stiffness) ** (2 / 3)
    twin, stretches = twin_of(scene), stretches_of(deck, scene, start)
    case = Case(
        scene, deck, units, start, peaks, passed, near, laws(deck, scene, near), twin,
        stretches, run_twin(twin, stretches, deadline), tolerance, deadline,
    )  # fmt: skip
    if not scene.holds:
        case = replace(case, deck=with_held(deck, case.laws, case.expected.forwards))
    return case, truth


def case_of_generated(scene: Scene, deck: FoundDeck, deadline: Deadline) -> Case:
    """Data that the checks of a generated deck share before it runs: no peak is judged."""
    pushed, twin = scene.pushed, twin_of(scene)
    if scene.piston is None and pushed < deck.mass.size and constant_force(scene)[pushed] == 0:
        # A constant force on that granule belongs to the shock.
        constant, applied = deck.constant_force.copy(), deck.applied_force.copy()
        applied[:, pushed] += constant[pushed, 0]
        constant[pushed, 0] = 0.0
        deck = replace(deck, constant_force=constant, applied_force=applied)
    size = twin.stiffness.size
    # Ratio to the probed depth: the law follows from the two tries next to it (chosen)
    near = np.full(size, 1.01 * DEPTH * float(np.min(scene.granules.radius)))
    return Case(
        scene, deck, UNITS["si"], 0.0, np.zeros(size), np.zeros(size, bool), near,
        laws(deck, scene, near), twin, stretches_of(deck, scene, 0.0),
        TwinRun(np.zeros(size), np.inf, np.inf, 0.0 * twin.velocity), EXAMINED, deadline,
        exact=True,
    )  # fmt: skip


def _no_chain(
    scene: Scene, deck: str, contents: FoundDeck, tolerance: float, deadline: Deadline
) -> DeckExamination:
    """The examination if granules do not lie in one row: nothing else is compared."""
    size = contents.radius.size
    across = np.round(contents.sideways / np.min(contents.radius)).astype(np.int64)
    rows, each = np.unique(across, axis=0, return_counts=True)
    kind = "do not lie in one row along x, y or z"
    if 1 < len(rows) <= size // 2 and np.ptp(each) == 0:
        kind = f"lie in {len(rows)} rows of {each[0]}, not in one"
    check = DeckCheck(
        "chain", "", None, None, None, False, True,
        f"the deck is not a chain: its {size} granules {kind}",
        "its other numbers and its run are not examined", place(contents, "granules"),
    )  # fmt: skip
    peaks = DeckCheck("peaks", "N", None, None, None, False, True, "the deck was not run",
                      "it is not a chain", check.place)  # fmt: skip
    truth = deadline.spend(lambda left: Native("reference", time_limit=left).run(scene))
    judged = np.zeros(truth.peak_force.size, bool)
    return DeckExamination(
        scene, deck, contents, (check, peaks), truth, judged, tolerance, (),
        findings=(Finding((check,)),),
    )  # fmt: skip


def _truth(scene: Scene, end: float, deadline: Deadline) -> Result:
    """The scene by the reference method, up to the end of the deck."""
    if end <= 0:
        raise RunFailed("this deck takes no step after its shock begins: it needs a run command")
    same = abs(end / scene.end_time - 1) < 1e-9
    # Longest run over the scene's: a deck that runs longer is judged up to there (chosen)
    watched = scene if same else replace(scene, run=Run(min(end, 100.0 * scene.end_time)))
    return deadline.spend(lambda left: Native("reference", time_limit=left).run(watched))  # type: ignore[no-any-return]


def _remarks(case: Case) -> tuple[str, ...]:
    """Sentences on parts that were not examined, and on assumptions."""
    deck, remarks = case.deck, list(case.deck.remarks)
    if deck.units == "lj":
        unit = case.units
        remarks.append(
            f"in its lj units one length is {unit.length:.6g} m, one mass {unit.mass:.6g} kg and"
            f" one time {unit.time:.6g} s, by median radius, mass and stiffness: ratios are judged"
        )
    if deck.before + case.start > 0:
        remarks.append(
            f"the shock begins {deck.before + case.start:.6g} s after the start of the deck; its"
            " numbers are those at the start of that run, and peaks count from there on"
        )
    late = int(np.count_nonzero(~case.judged))
    if late:
        remarks.append(
            f"{late} contacts are not judged: pressed too little, or not past their peaks when the"
            " deck ended"
        )
    return tuple(remarks)
