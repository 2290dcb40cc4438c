"""Results that cannot be used are one sentence."""

from __future__ import annotations

import gzip
import random
from pathlib import Path

import numpy as np
import pandas
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.verdict.results import read
from tests.effort import effort
from tests.verdict.results.runs import HEAD, SCENE, N

GRANULES = "ITEM: ATOMS id x vx fx"
USUAL = b"contact,peak_force_N\n"
ROWS = "".join(f"\n{k} {k} 0 0" for k in range(1, N + 1))
BROKEN: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "is no CSV file"),
    "no row": (USUAL, "has no row of numbers"),
    "binary": (bytes(range(256)) * 10, "is not a text file"),
    "other columns": (b"a,b\n1,2\n3,4\n", "has the columns 'a', 'b', must have contact and peak_f"),
    "force for a peak": (b"contact,force\n2,3\n", "and peak_force_N: did you mean peak_force_N?"),
    "a trace": (b"t [us];F [N]\n0;1\n", "name them with --column time=... --column gauge_16=..."),
    "no number": (USUAL + b"2,x\n", "peak_force_N in row 1 = 'x': must be a finite number"),
    "cut off": (USUAL + b"2,3\n3\n", "peak_force_N in row 2 = '': must be a finite number"),
    "a cell more": (USUAL + b"2,3\n3,4,5\n", "is no CSV file .*line 3"),
    "thousands": (
        b"contact;peak_force_N\n2;101,5\n3;1.101,5\n4;99,5\n",
        r"peak_force_N in row 1 = '101,5': must be a finite number",
    ),
    "commas of thousands": (
        b"contact; peak_force_N\n2; 1,015\n3; 985\n",
        r"peak_force_N = '1,015': may have a comma of thousands",
    ),
    "a contact too far": (USUAL + b"2,3\n13,3\n", "contact in row 2 = 13: .* from 2 to 12"),
    "a contact twice": (USUAL + b"2,3\n2,3\n", "contact in row 2 = 2: is given twice"),
    "a peak that is nan": (USUAL + b"2,nan\n", "peak_force_N in row 1 = .nan.: must be a finite"),
    "a long cell": (USUAL + b"2," + b"x" * 200_000 + b"\n", "= 'x{40}': must be a finite number"),
    "a damaged archive": (gzip.compress(b"contact")[:-9], "its compression is damaged"),
    "a spreadsheet": (b"PK\x03\x04\0\0", "a spreadsheet is saved as CSV first"),
    "a log": (
        b"LAMMPS (22 Jul 2025)\nunits si\n",
        "has the columns 'LAMMPS', .* or be a dump of LAMMPS with id, x, fx",
    ),
    "dump without frames": (b"ITEM: TIMESTEP\n", "frame 1: ends in the middle"),
    "dump cut off": (f"{HEAD}{GRANULES}\n1 0 0 0\n".encode(), "frame 1: ends in the middle"),
    "no forces": (f"{HEAD}ITEM: ATOMS id x y z{ROWS}".encode(), "must have the columns id, x"),
    "a row cut off": (f"{HEAD}{GRANULES}{ROWS[:-2]}".encode(), "frame 1: ends in the middle"),
    "a column twice": (b"contact,peak_force_N,contact\n2,3,2\n", "once each"),
    "two granules": (
        f"{HEAD}{GRANULES}{ROWS[:16]}".replace("\n12\n", "\n2\n").encode(),
        "has 2 granules, the scene 12",
    ),
    "a word for a number": (
        f"{HEAD}{GRANULES}{ROWS[:-1]}x".encode(),
        "must have finite numbers in the columns fx, fy, fz",
    ),
    "pairs": (f"{HEAD}ITEM: ENTRIES a b c d{ROWS}".encode(), "must have the columns id, x"),
    "text between": (f"{HEAD}{GRANULES}{ROWS}\nmore\n".encode(), "or has other rows there"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_file_that_cannot_be_used_is_one_sentence(name: str, tmp_path: Path) -> None:
    content, words = BROKEN[name]
    file = tmp_path / "results"
    file.write_bytes(content)
    with pytest.raises(SceneError, match=words) as caught:
        read(SCENE, [file], "si", None)
    assert str(caught.value).startswith(str(file))
    assert str(caught.value).isprintable()


def test_units_and_peaks_that_cannot_be(tmp_path: Path) -> None:
    (tmp_path / "peaks.csv").write_bytes(USUAL + b"2,3\n")
    for given, units, words in (
        ({2: 1.0}, "real", "units = 'real': must be one of si, cgs"),
        ({2: 1.0}, "cgs", "units = 'cgs': is for dumps"),
        (tmp_path / "peaks.csv", "cgs", "units = 'cgs': is for dumps: peak_force_N of a table"),
    ):
        with pytest.raises(SceneError, match=words):
            hc.judge(SCENE, given, units=units)
    table = pandas.DataFrame({"contact": [2, 3], "peak_force_N": ["1.0", "2_0.5"]})
    with pytest.raises(SceneError, match=r"peak_force_N in row 2 = '2_0\.5': must be a finite"):
        hc.judge(SCENE, table)


FRAME = f"{HEAD}{GRANULES}{ROWS}\n" * 8
PEAKS = "contact,peak_force_N\n2,105.4\n3,116.2\n"


def is_read_or_refused(path: Path) -> None:
    try:
        peak_force = read(SCENE, [path], "si", None).peak_force
    except SceneError as problem:
        assert str(problem).isprintable()  # noqa: PT017
        assert len(str(problem)) < 1000  # noqa: PT017
    else:
        assert peak_force.shape == (N - 1,)
        assert not np.any(peak_force < 0)
        assert not np.any(np.isinf(peak_force))


@pytest.mark.parametrize("seed", range(10))
def test_hostile_tables_give_peaks_or_one_sentence(tmp_path: Path, seed: int) -> None:
    draw = random.Random(seed)  # noqa: S311
    path = tmp_path / "peaks.csv"
    pieces = [*'2\x00",\n\r\u202e', "nan", "1e999", "-1", "contact", "1" * 400]
    for _ in range(50):
        text = list(draw.choice((PEAKS, FRAME)))
        for _ in range(draw.randint(1, 6)):
            at = draw.randrange(len(text))
            text[at : at + draw.randint(0, 3)] = draw.choice(pieces)
        path.write_bytes("".join(text).encode()[: draw.randint(0, 2000)])
        # 0.2 at most measured.
        assert effort(lambda: is_read_or_refused(path)) < 30
