"""Results of any code, as peaks of a scene's contacts, and their judgement."""

from __future__ import annotations

import errno
import gzip
import io
import itertools
import os
import warnings
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.contents import UNITS
from hertzchain.errors import POSITIVE, SceneError, is_positive, require
from hertzchain.files import read_bytes, text_in
from hertzchain.limits import TIME_LIMIT, TOLERANCE
from hertzchain.scene.scene import Scene, SceneLike, to_scene
from hertzchain.showing import ShowProgress, telling
from hertzchain.verdict.judgement import Judgement, judged
from hertzchain.verdict.results.motion import Sampled, is_dump, motion_of, peaks_of

if TYPE_CHECKING:
    import pandas


LARGEST_FILES_BYTES = 300_000_000  # of all files: a minute to read (chosen)

COLUMNS = ("contact", "peak_force_N")
"""Columns of a table of peaks."""

_MOST_CELL_CHARS = 40  # characters of a cell or a name in a message (chosen)


def read(scene: Scene, results: Any, units: str, dt: float | None) -> Sampled:
    """Return the peaks of files, of a table, or as they are; see ``hertzchain.judge``.

    A SceneError says what cannot be used, and why.
    """
    require(units in UNITS, "units", units, f"must be one of {', '.join(UNITS)}")
    if isinstance(results, str | os.PathLike):
        results = [results]
    is_list = isinstance(results, Sequence) and len(results) > 0
    if is_list and all(isinstance(path, str | os.PathLike) for path in results):
        return _of_files(scene, [Path(path) for path in results], units, dt)
    require(units == "si", "units", units, "is for dumps: leave it out, and give forces in N")
    if hasattr(results, "select_dtypes"):
        return _of_table(scene, results, "the table")
    peaks = of_mapping(results, scene) if isinstance(results, Mapping) else results
    return Sampled(peaks, np.zeros(0))


def _of_files(scene: Scene, paths: Sequence[Path], units: str, dt: float | None) -> Sampled:
    file = " ... ".join(dict.fromkeys((str(paths[0]), str(paths[-1]))))
    texts: list[str] = []
    left = LARGEST_FILES_BYTES
    for path in paths:
        content = _content_of(path, left)
        left -= len(content)
        text = None if content.startswith(b"PK\x03\x04") else text_in(content)
        if text is None:
            allowed = "is not a text file: a spreadsheet is saved as CSV first"
            raise SceneError("", None, allowed, file=path)
        if not is_dump(text) and len(paths) > 1:
            allowed = "is no dump of LAMMPS: several files must be the frames of one dump"
            raise SceneError("", None, allowed, file=path)
        texts.append(text)
    if is_dump(texts[0]):
        motion = motion_of(texts, scene.chain.granules, UNITS[units], dt, file)
        return peaks_of(scene, motion, file)
    begins = (line.split() for line in texts[0].splitlines() if line.strip()[:1] not in ("", "#"))
    if next(begins, [""])[0] in _OF_DECKS:
        allowed = "is a LAMMPS input: run it and judge its peaks, or try hertzchain examine"
        raise SceneError("", None, allowed, file=file)
    allowed = f"is for dumps: {COLUMNS[1]} of a table is in N"
    require(units == "si", "units", units, allowed)
    return _of_table(scene, _table_in(texts[0], file), file)


_OF_DECKS = ("units", "atom_style", "boundary", "newton", "dimension", "variable", "clear")
"""Commands with which LAMMPS inputs begin."""


def _content_of(path: Path, most: int) -> bytes:
    """Return the bytes of a file, unpacked; a SceneError says why there are none."""
    try:
        content = read_bytes(path, most)
        if content.startswith(b"\x1f\x8b"):
            with gzip.open(io.BytesIO(content)) as unpacked:
                content = unpacked.read(most + 1)
            if len(content) > most:
                raise OSError(errno.EFBIG, f"larger than {most / 1e6:g} MB when unpacked")  # noqa: TRY301
    except (gzip.BadGzipFile, EOFError, zlib.error):
        reason = "its compression is damaged"
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or "no name of a file"
    else:
        return content
    allowed = f"cannot be read ({reason}), must be a CSV file or a dump"
    raise SceneError("", None, allowed, file=path) from None


def table_of(path: Path) -> pandas.DataFrame:
    """Return the words of a CSV file, which may be gzipped; SceneError for any other."""
    text = text_in(_content_of(path, LARGEST_FILES_BYTES))
    if text is None:
        allowed = "is not a text file: a spreadsheet is saved as CSV first"
        raise SceneError("", None, allowed, file=path)
    return _table_in(text, str(path))


def _table_in(text: str, file: str) -> pandas.DataFrame:
    """Return the words of a CSV file, whose header may be a comment; decimal commas as points."""
    import pandas

    above = itertools.takewhile(_is_above_the_header, text.splitlines(keepends=True))
    text = text[sum(map(len, above)) :].removeprefix("#").lstrip(" ")
    head = text.partition("\n")[0]
    separator = next((sign for sign in ";\t," if sign in head), r"\s+")
    try:
        with warnings.catch_warnings():  # of rows that are longer than the header
            warnings.simplefilter("error", pandas.errors.ParserWarning)
            table = pandas.read_csv(
                io.StringIO(text), sep=separator, dtype=str, keep_default_na=False,
                index_col=False, skipinitialspace=True,
            )  # fmt: skip
    except (ValueError, pandas.errors.ParserWarning) as problem:
        said = " ".join(str(problem).split())
        raise SceneError("", None, f"is no CSV file ({said})", file=file) from None
    table.columns = [str(name).strip() for name in table.columns]
    for name in set(COLUMNS) & set(table.columns) if separator != "," else ():
        words = table[name]
        commas = words.str.contains(",", regex=False)
        decimal, others = words[commas], words[~commas]
        if decimal.size and decimal.str.fullmatch(_GROUPED).all() and others.str.isdecimal().any():
            allowed = "may have a comma of thousands: leave it out, and write decimals with a point"
            raise SceneError(name, decimal.iloc[0], allowed, file=file)
        if not words.str.contains(".", regex=False).any():
            table[name] = words.str.replace(",", ".")
    return table


def _is_above_the_header(line: str) -> bool:
    """Whether a line is a comment, or blank, and not the header itself."""
    return line.strip()[:1] in ("", "#") and COLUMNS[1] not in line


_GROUPED = r"\d{1,3}(,\d{3})+"
"""A number with commas of thousands; 1,234 may have a decimal comma if no other is whole."""


def _of_table(scene: Scene, table: pandas.DataFrame, file: str) -> Sampled:
    """Return the peaks in a table."""
    import pandas

    names = [str(name) for name in table.columns]
    # The second of a name has .1 added.
    if any(names.count(name) != 1 or f"{name}.1" in names for name in COLUMNS):
        shown = ", ".join(repr(name[:_MOST_CELL_CHARS]) for name in names[:8])
        allowed = f"has the columns {shown}, must have {' and '.join(COLUMNS)}"
        if {COLUMNS[0], "force"} <= set(names) and COLUMNS[1] not in names:
            raise SceneError("", None, f"{allowed}: did you mean {COLUMNS[1]}?", file=file)
        allowed += (
            " (contact 2 is that of granules 1 and 2), once each, or be a dump of LAMMPS with id,"
            " x, fx; pulses (hc.judge_trains) stand in contact or granule and force_N; forces over"
            " time (hc.judge_traces) in time_s and contact_2_N, contact_3_N, ...: else name them"
            " with --column time=... --column gauge_16=..."
        )
        raise SceneError("", None, allowed, file=file)
    values = []
    for name in COLUMNS:
        words = table[table.columns[names.index(name)]]
        numbers = pandas.to_numeric(words, errors="coerce").to_numpy(np.float64)
        wrong = np.flatnonzero(~np.isfinite(numbers))
        if wrong.size:
            word = str(words.iloc[int(wrong[0])])[:_MOST_CELL_CHARS]
            key = f"{name} in row {int(wrong[0]) + 1}"
            raise SceneError(key, word, "must be a finite number", file=file)
        values.append(numbers)
    if table.empty:
        raise SceneError("", None, "has no row of numbers", file=file)
    peaks = by_contact(values[0], values[1], scene, file)
    return Sampled(peaks, np.zeros_like(peaks))


def of_mapping(given: Mapping[int, float], scene: Scene) -> FloatArray:
    """Return the peaks of a mapping from contacts to forces [N]."""
    try:
        contacts, forces = np.array([*given.items()], np.float64).reshape(-1, 2).T
    except (TypeError, ValueError):
        raise SceneError("peak_force", None, "must map contacts to forces [N]") from None
    return by_contact(contacts, forces, scene, None)


def by_contact(
    contacts: FloatArray, forces: FloatArray, scene: Scene, file: str | None
) -> FloatArray:
    """Return peaks [N], (contacts,), NaN for missing ones, of forces with numbers of contacts."""
    first, last = scene.contacts[0], scene.last_contact
    peaks = np.full(len(scene.contacts), np.nan)
    for row, (contact, force) in enumerate(zip(contacts.tolist(), forces.tolist(), strict=True), 1):
        key: str
        wrong: Any
        if contact not in scene.contacts:
            key, wrong = "contact", int(contact) if contact.is_integer() else contact
            allowed = (
                f"must be a whole number from {first} to {last}: contact 2 lies between granules 1"
                f" and 2{_other_numbers(contacts, first, last)}"
            )
        elif not np.isnan(peaks[int(contact) - first]):
            key, wrong, allowed = "contact", int(contact), _TWICE
        elif not 0 <= force < np.inf:
            key, wrong = "peak_force", force
            allowed = (
                "must be finite and at least 0 [N]: turn the sign where forces that press are"
                " negative, leave out contacts without a peak"
            )
        else:
            peaks[int(contact) - first] = force
            continue
        raise SceneError(key if file is None else f"{key} in row {row}", wrong, allowed, file=file)
    return peaks


_TWICE = (
    "is given twice: several pulses of a contact stand in the columns contact and force_N"
    " (hc.judge_trains)"
)


def _other_numbers(contacts: FloatArray, first: int, last: int) -> str:
    """Return a hint for contacts that are numbered from 0 or 1; empty for others."""
    least = float(np.min(contacts))
    fits = least in range(first) and bool(np.all(contacts == np.round(contacts)))
    if not fits or np.max(contacts) + first - least > last:
        return ""
    return f", and these numbers begin with {least:g}: add {first - least:g} to each"


Results = Annotated[Path | str | Sequence[Path | str] | Mapping[int, float] | ArrayLike, read]
"""What can be judged; pandas tables are array-like, too."""


def judge(
    scene: SceneLike,
    results: Results,
    *,
    units: str = "si",
    tolerance: float = TOLERANCE,
    dt: float | None = None,
    time_limit: float = TIME_LIMIT,
    progress: ShowProgress = None,
) -> Judgement:
    """Judge results of any code by the reference, and search for the cause of differences.

    Parameters
    ----------
    scene
        What was computed, or the path of its file.
    results
        Peak forces [N] of contacts by the paper's numbers, 2 ... N, and N + 1 at a wall: a mapping
        from contacts to forces, or an array of shape (contacts,) with NaN for missing peaks.

        Or a pandas table, or a CSV file, with the columns contact and peak_force_N.

        Or a text dump of all granules by LAMMPS with id, x and fx, or a list of files that together
        are one: peaks are found between its frames. Files may be gzipped.
    units
        ``si``, ``cgs``, ``micro``, ``nano`` (LAMMPS's styles), of a dump.
    tolerance
        Largest relative difference that passes; between 0 and 1.
    dt
        Step of the code [s], if known; it turns numbers of steps into times. The error of velocity
        Verlet at this step is stated, except for damped contacts.
    time_limit
        Time limit of the reference [s].
    progress
        True for a line in the terminal on what is being done, or a function that is
        called with each such line.

    Raises
    ------
    SceneError
        For anything but a scene, for results that cannot be used, impossible peaks, tolerances or
        steps, and for a tolerance within the error of the reference.
    RunFailed
        If the reference cannot be computed, or velocity Verlet is unstable with such a step.
    """
    scene = to_scene(scene)
    require(dt is None or is_positive(dt), "dt", dt, f"{POSITIVE} [s]")
    with telling(progress) as report_progress:
        report_progress("reading results")
        given = read(scene, results, units, dt)
        sampling = given.error if given.how else None
        judgement = judged(
            scene, given.peak_force, tolerance, dt, sampling, time_limit, report_progress
        )
    if not given.how:
        return judgement
    remarks = [given.how]
    if judgement.sampled_too_rarely:
        remarks.append(
            f"{judgement.sampled_too_rarely} contacts are not judged, as samples so far apart, or"
            f" numbers of so few digits, may be off by more than the tolerance of {tolerance:.1e}:"
            " write samples more often, with dump_modify format float %.15g"
        )
    return replace(judgement, remarks=(*remarks, *judgement.remarks))
