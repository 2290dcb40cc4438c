"""Results that cannot be used are one sentence."""

from __future__ import annotations

import gzip
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.verdict.results import tables
from hertzchain.verdict.results.reading import read
from tests.command_line import Command
from tests.effort import effort
from tests.verdict.results.runs import (
    HEAD,
    SCENE,
    N,
    Samples,
    table,
)

GRANULES = "ITEM: ATOMS id x vx fx"
USUAL = b"contact,peak_force_N\n"
ROWS = "".join(f"\n{k} {k} 0 0" for k in range(1, N + 1))
SERIES = "time," + ",".join(f"fx{k}" for k in range(1, N + 1)) + "\n"
SERIES += "".join(f"{k}," + ",".join(str(k * j % 7) for j in range(N)) + "\n" for k in range(20))
BROKEN: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "has no row of numbers"),
    "binary": (bytes(range(256)) * 10, "is not a text file"),
    "other columns": (b"a b\n1 2\n3 4\n", "has the columns a, b: say which are what"),
    "no number": (SERIES.replace("\n0,", "\nx,").encode(), "time in line 2 = 'x': must be"),
    "nan": (SERIES.replace("0,0,0", "0,0,nan", 1).encode(), "fx2 in line 2 = 'nan'"),
    "cut off": (SERIES[:-3].encode(), "fx12 in line 21 = '': must be a finite number"),
    "a cell more": (f"{SERIES[:-1]},1\n".encode(), "line 21: has 14 columns, .* 13"),
    "thousands": (
        b"contact;peak_force_N\n2;101,5\n3;1.101,5\n4;99,5\n",
        r"peak_force_N in line 3 = '1.101,5': must be a finite number, with a comma",
    ),
    "a point among commas": (
        b"contact;peak_force_N\n2;101,5\n3;1.101\n4;99,5\n",
        r"= '1.101': must",
    ),
    "a contact too far": (USUAL + b"2,3\n13,3\n", "contact in row 2 = 13: .* from 2 to 12"),
    "a contact twice": (USUAL + b"2,3\n2,3\n", "contact in row 2 = 2: is given twice"),
    "a peak that is nan": (USUAL + b"2,nan\n", "peak_force_N in line 2 = .nan.: must be a finite"),
    "a long cell": (USUAL + b'2,"' + b"1" * 200_000 + b'"\n', "is no CSV file"),
    "a damaged archive": (gzip.compress(b"contact")[:-9], "its compression is damaged"),
    "a spreadsheet": (b"PK\x03\x04\0\0", "a spreadsheet is saved as CSV first"),
    "no thermo": (b"LAMMPS (22 Jul 2025)\nunits si\n", "is a log without thermo output"),
    "dump without frames": (b"ITEM: TIMESTEP\n", "ends in the middle of frame 1"),
    "dump cut off": (f"{HEAD}{GRANULES}\n1 0 0 0\n".encode(), "ends in the middle of frame 1"),
    "two granules": (
        f"{HEAD}{GRANULES}{ROWS[:16]}".replace("\n12\n", "\n2\n").encode(),
        "has frames of 2 granules, the scene 12",
    ),
    "a word for a number": (
        f"{HEAD}{GRANULES}{ROWS[:-1]}x".encode(),
        "fx in row 12 of frame 1 = 'x'",
    ),
    "scaled": (f"{HEAD}ITEM: ATOMS id type xs ys{ROWS}".encode(), "atom writes x after"),
    "nothing of use": (f"{HEAD}ITEM: ATOMS id q a b{ROWS}".encode(), "has id, q, a, b, must"),
    "pairs": (f"{HEAD}ITEM: ENTRIES a b c d{ROWS}".encode(), "is a dump of pairs: write one"),
    "text between": (f"{HEAD}{GRANULES}{ROWS}\nmore\n".encode(), "or has other rows there"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_file_that_cannot_be_used_is_one_sentence(name: str, tmp_path: Path) -> None:
    content, words = BROKEN[name]
    file = tmp_path / "results"
    file.write_bytes(content)
    with pytest.raises(SceneError, match=words) as caught:
        read(SCENE, [file], {}, "si", None)
    assert str(caught.value).startswith(f"{file}: ")
    assert str(caught.value).isprintable()


def test_files_that_cannot_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hertzchain: Command
) -> None:
    with pytest.raises(SceneError, match="cannot be read"):
        read(SCENE, [tmp_path / "none"], {}, "si", None)
    SCENE.to_toml(tmp_path / "scene.toml")
    (tmp_path / "b.csv").write_text("a,b,c,d\n1,2,3,4\n")
    monkeypatch.setattr(tables, "MOST_BYTES", 10)
    with pytest.raises(SceneError, match="larger than"):
        read(SCENE, [tmp_path / "b.csv"], {}, "si", None)
    refused = hertzchain("judge", tmp_path / "scene.toml", tmp_path / "b.csv")
    assert refused.status == 2
    assert refused.err.count("\n") == 1


def series(run: Samples, tmp_path: Path, change: Callable[[str], str]) -> Path:
    file = tmp_path / "series.csv"
    file.write_text(change(table(run, "time", run.net_force, "f{}")), encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("columns", "units", "words"),
    [
        ({"colour": "red"}, "si", "column = 'colour': must be one of contact, peak_force"),
        ({"time": "T"}, "si", "column time = 'T': is no column of the file, which has time, f1"),
        ({"time": "f*"}, "si", "stands for 12 columns of the file, must be 1"),
        ({"net_force": "f1*"}, "si", "stands for 4 columns of the file, must be 12"),
        ({"contact_force": "f*"}, "si", "stands for 12 columns of the file, must be 11"),
        ({"net_force": "f* [furlong]"}, "si", "wrong dimension"),
        ({"id": "time [s]"}, "si", "is a pure number"),
        ({}, "real", "units = 'real': must be one of si, cgs"),
        ({}, "lj", "units lj have no scale: give the unit of each column"),
    ],
)
def test_columns_and_units_that_cannot_be(
    columns: dict[str, str], units: str, words: str, run: Samples, tmp_path: Path
) -> None:
    with pytest.raises(SceneError, match=words) as caught:
        read(SCENE, [series(run, tmp_path, str)], columns, units, None)
    assert str(caught.value).isprintable()


def test_samples_that_cannot_be(run: Samples, tmp_path: Path) -> None:
    def few(text: str) -> str:
        return "\n".join(text.splitlines()[:7])

    def backwards(text: str) -> str:
        head, *rows = text.splitlines()
        return "\n".join([head, *rows[::-1]])

    for change, words in ((few, "has 6 samples"), (backwards, "do not increase")):
        with pytest.raises(SceneError, match=words):
            read(SCENE, [series(run, tmp_path, change)], {}, "si", None)


def test_forces_that_press_and_are_negative_are_refused(run: Samples, tmp_path: Path) -> None:
    """In samples, with some of the other sign as noise leaves them, and in tables of peaks."""
    turned = -run.contact_force
    turned[:5] = 1e-9
    file = tmp_path / "turned.csv"
    file.write_text(table(run, "time", turned, "c{}"), encoding="utf-8")
    words = rf"negative where granules press .the largest is {turned.min():.4g} N.: turn their sign"
    with pytest.raises(SceneError, match=words):
        read(SCENE, [file], {"contact_force": "c*"}, "si", None)
    peaks = pandas.DataFrame({"contact": [2, 3], "F": [-78.0, -70.0]})
    with pytest.raises(SceneError, match=r"peak_force in row 1 = -78.0: must be .*: turn the sign"):
        hc.judge(SCENE, peaks, columns={"peak_force": "F"})


def test_tables_and_options_that_cannot_be() -> None:
    with pytest.raises(SceneError, match=r"columns = .*: is for files and tables: leave it out"):
        hc.judge(SCENE, np.ones(N - 1), columns={"peak_force": "F"})
    with pytest.raises(SceneError, match="units = 'cgs': is for files and tables"):
        hc.judge(SCENE, {2: 1.0}, units="cgs")
    frame = pandas.DataFrame({"contact": [2, 3], "peak_force_N": [1.0, np.nan]})
    with pytest.raises(SceneError, match="peak_force_N in row 2 = '': must be a finite number"):
        hc.judge(SCENE, frame)
    frame = pandas.DataFrame({"contact": [2, 3], "peak_force_N": ["1.0", "2_0.5"]})
    with pytest.raises(SceneError, match=r"peak_force_N in row 2 = '2_0.5': must be a finite"):
        hc.judge(SCENE, frame)


PEAKS = "contact,peak_force_N\n2,105.4\n3,116.2\n"


def is_read_or_refused(path: Path) -> None:
    try:
        found = read(SCENE, [path], {}, "si", None).peak_force
    except SceneError as problem:
        assert str(problem).isprintable()  # noqa: PT017
        assert len(str(problem)) < 1000  # noqa: PT017
    else:
        assert found.shape == (N - 1,)
        assert not np.any(found < 0)
        assert not np.any(np.isinf(found))


@pytest.mark.parametrize("seed", range(20))
def test_hostile_tables_give_peaks_or_one_sentence(tmp_path: Path, seed: int) -> None:
    draw = random.Random(seed)  # noqa: S311
    path = tmp_path / "peaks.csv"
    pieces = [*'2\x00",\n\r\u202e', "nan", "1e999", "-1", "contact", "1" * 400]
    for _ in range(50):
        text = list(draw.choice((PEAKS, SERIES)))
        for _ in range(draw.randint(1, 6)):
            at = draw.randrange(len(text))
            text[at : at + draw.randint(0, 3)] = draw.choice(pieces)
        path.write_bytes("".join(text).encode()[: draw.randint(0, 600)])
        # 0.2 at most measured.
        assert effort(lambda: is_read_or_refused(path)) < 30
