"""Peaks as people have them: dumps of LAMMPS and tables, right and wrong ones."""

from __future__ import annotations

import contextlib
import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.engine import engine
from hertzchain.errors import SceneError
from hertzchain.verdict import results
from hertzchain.verdict.results import Motion, last_digit, peaks_of, pushed_at_the_end, read
from tests import scenes
from tests.command_line import Command
from tests.conftest import STEEL
from tests.effort import effort
from tests.verdict.samples import (
    DT,
    HEAD,
    SCENE,
    TERMS,
    N,
    Samples,
    deck,
    dump_of,
    motion,
    off,
    sampled,
)

# A run of the scene, and its peaks


@pytest.fixture(scope="module")
def truth() -> FloatArray:
    return hc.Native("reference").run(SCENE).peak_force


@pytest.fixture(scope="module")
def run() -> Samples:
    return sampled(SCENE, 0.1)


# Peaks from samples are off by no more than is said, by whichever way they are found


@pytest.mark.parametrize("apart", [0.05, 0.2, 0.5, pytest.param(0.8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["cosine_LM0.3_n2", pytest.param("demo", marks=pytest.mark.slow)])
def test_peaks_are_off_by_no_more_than_is_said(name: str, apart: float) -> None:
    scene = scenes.load(name)
    result = hc.Native("reference").run(scene)
    samples = sampled(scene, apart, 0.3)
    counts = result.peak_force > 1e-3 * result.peak_force.max()
    peaks = peaks_of(scene, motion(samples))
    # The reference itself is right to 1e-9.
    allowed = peaks.error[counts] + 1e-9
    assert np.all(off(peaks.peak_force, result.peak_force) <= allowed)


def of_contacts(time: FloatArray, force: list[FloatArray]) -> Motion:
    """Net forces on three granules that press each other with these forces."""
    first, second = force
    net_force = np.column_stack([0 * first, first - second, second])
    return Motion(np.asarray(time, np.float64), False, net_force)


@pytest.mark.parametrize("higher", [0.99, 1.0, 1.001, 1.01, 1.03])
@pytest.mark.parametrize("rate", [0.7, 1.2, 1.5])
def test_the_maximum_may_be_that_of_another_hump(rate: float, higher: float) -> None:
    """The first hump has a sample at its maximum; the second, which may be shorter, has none."""
    time = 0.4 * np.arange(-30.0, 90.0)
    shape = 1 / np.cosh(0.7 * time) ** 2 + higher / np.cosh(rate * (time - 8.2)) ** 2
    scene = hc.Scene(hc.Chain(3, **STEEL), hc.Pulse("cosine", 100.0, 2.0, rise_time=5e-5))
    peaks = peaks_of(scene, of_contacts(time, [shape, shape[::-1]]))
    # At 8 time units the other hump adds 4 exp(-1.4 * 8) = 5e-5.
    assert np.all(np.abs(peaks.peak_force / max(1.0, higher) - 1) <= peaks.error + 6e-5)
    assert rate > 0.7 or np.all(peaks.error < 2e-3)


@pytest.mark.parametrize("digits", [4, 6, 9, 12])
def test_digits_of_numbers_are_counted(digits: int, run: Samples, truth: FloatArray) -> None:
    words = [f"{value:.{digits}g}" for value in run.net_force.ravel()]
    force = np.array(words, float).reshape(run.net_force.shape)
    grain = last_digit(force)
    size = np.floor(np.log10(np.abs(run.net_force).max()))
    assert grain == pytest.approx(10.0 ** (size - digits + 1), rel=1e-9, abs=0)
    assert last_digit(0 * force) == 0
    peaks = peaks_of(SCENE, Motion(run.time, True, force, grain))
    assert np.all(off(peaks.peak_force, truth) <= peaks.error)
    exact = peaks_of(SCENE, Motion(run.time, True, force))
    assert peaks.error - exact.error == pytest.approx(2 * grain / exact.peak_force, abs=1e-15)


@pytest.mark.parametrize("name", TERMS)
def test_scenes_with_terms(name: str) -> None:
    scene = TERMS[name]
    true = hc.Native(rtol=1e-8).run(scene).peak_force[: scene.chain.granules - 1]
    peaks = peaks_of(scene, motion(sampled(scene, 0.1)))
    assert np.isnan(peaks.peak_force[true.size :]).all()
    error = peaks.error[: true.size]
    assert np.all(off(peaks.peak_force[: true.size], true) <= error + 1e-8)
    assert np.max(error) < 1e-3


def twice(run: Samples, more: float) -> Motion:
    """A run with one sample again, in which one granule feels more by a share of the largest."""
    net_force = np.insert(run.net_force, 50, run.net_force[50], axis=0)
    net_force[51, 4] += more * np.abs(run.net_force).max()
    return Motion(np.insert(run.time, 50, run.time[50]), True, net_force)


def test_a_sample_may_stand_there_twice(run: Samples, truth: FloatArray) -> None:
    peaks = peaks_of(SCENE, twice(run, 0.05 / 3))
    assert np.all(off(peaks.peak_force, truth) <= peaks.error)


def test_samples_that_cannot_be(run: Samples) -> None:
    column, near = TERMS["column"], replace(SCENE, near_wall=hc.Wall("rigid"))
    led = replace(SCENE, shock=hc.Piston(0.1), wall=hc.Wall("rigid"))
    for scene, run_of, words in (
        (near, motion(run), "has no force of a near wall"),
        (led, motion(run), "do not tell contact forces between a piston and a wall"),
        (SCENE, twice(run, 0.15), "has two different samples of one time"),
        (column, replace(motion(sampled(column, 0.1)), is_clock=False), "no times: give --dt"),
        (SCENE, Motion(run.time[:6], True, run.net_force[:6]), "has 6 samples of the run"),
        (SCENE, Motion(run.time[::-1], True, run.net_force), "has times that do not increase"),
    ):
        with pytest.raises(SceneError, match=words):
            peaks_of(scene, run_of)


# Files as people have them: of LAMMPS, and tables; what their sampling adds to a tolerance


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("files")
    file = folder / "in.chain"
    file.write_text(deck(folder), encoding="utf-8")
    with engine() as lammps:
        lammps.file(str(file))
    return folder


@pytest.fixture(scope="module")
def verlet() -> FloatArray:
    """The peaks that LAMMPS has at these steps; steps end at the corners of the pulse."""
    return hc.Native("velocity-verlet", DT).run(SCENE).peak_force


@pytest.mark.lammps
@pytest.mark.parametrize(("file", "dt"), [("six.dump", DT), ("fine.dump", None), ("frame.*", None)])
def test_dumps_of_lammps_have_its_peaks(
    file: str, dt: float | None, files: Path, verlet: FloatArray
) -> None:
    peaks = read(SCENE, list(files.glob(file)), "si", dt)
    apart = "20 steps" if file == "frame.*" else "2e-06 s"
    assert f"peaks are from net forces in a dump, 201 samples {apart} apart" in peaks.how
    assert np.all(off(peaks.peak_force, verlet) <= peaks.error)
    assert peaks.error is not None
    assert np.max(peaks.error) < 5e-5


@pytest.mark.lammps
@pytest.mark.parametrize(("axis", "sign"), [("y", 1), ("z", -1)])
def test_the_axis_and_the_pushed_end_are_found(
    axis: str, sign: int, tmp_path: Path, verlet: FloatArray
) -> None:
    file = tmp_path / "in.chain"
    file.write_text(deck(tmp_path, axis, sign), encoding="utf-8")
    with engine() as lammps:
        lammps.file(str(file))
    peaks = read(SCENE, [tmp_path / "six.dump"], "si", None)
    assert np.all(off(peaks.peak_force, verlet) <= peaks.error)


@pytest.mark.lammps
def test_a_run_of_lammps_is_judged(files: Path, hertzchain: Command) -> None:
    SCENE.to_toml(files / "scene.toml")
    judged = hertzchain("judge", files / "scene.toml", files / "six.dump", "--json")
    document = judged.json()
    assert (judged.status, document["verdict"]) == (0, "pass")
    assert document["sampling_error"] < 5e-5
    assert document["remarks"][0].startswith("peaks are from net forces in a dump")
    other = replace(SCENE, shock=hc.Pulse("cosine", 101.0, 2.0, rise_time=5e-5))
    assert hc.judge(other, files / "six.dump").verdict == "fail"


def test_a_dump_may_have_other_units(run: Samples, truth: FloatArray, tmp_path: Path) -> None:
    micro = Samples(1e6 * run.time, 1e6 * run.position, 1e9 * run.net_force)
    (tmp_path / "dump.xyz").write_text("".join(dump_of(micro)), encoding="utf-8")
    peaks = read(SCENE, [tmp_path / "dump.xyz"], "micro", None)
    assert np.all(off(peaks.peak_force, truth) <= peaks.error)


@pytest.mark.parametrize(("across", "is_a_chain"), [(3e-3, False), (3e-4, True)])
def test_granules_stand_in_a_row(
    across: float, is_a_chain: bool, run: Samples, tmp_path: Path
) -> None:
    """The middle granule is beside the others, by a fraction of the length of the chain."""
    length = run.position[0, -1] - run.position[0, 0]
    text = "".join(dump_of(run, across * length * (np.arange(N) == N // 2)))
    (tmp_path / "dump").write_text(text, encoding="utf-8")
    refused = pytest.raises(SceneError, match="not in a row along x, y or z: they differ by")
    with contextlib.nullcontext() if is_a_chain else refused:
        read(SCENE, [tmp_path / "dump"], "si", None)


def test_files_that_are_not_one_dump(
    run: Samples, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frame, table = (tmp_path / name for name in ("1", "peaks.csv"))
    frame.write_text(dump_of(run)[0], encoding="utf-8")
    table.write_text("contact,peak_force_N\n2,3.0\n", encoding="utf-8")
    with pytest.raises(SceneError, match=r"has 1 samples of the run, .*: name all files of a dump"):
        read(SCENE, [frame], "si", None)
    monkeypatch.setattr(results, "LARGEST_FILES_BYTES", 10)
    with pytest.raises(SceneError, match="larger than"):
        read(SCENE, [table], "si", None)
    monkeypatch.setattr(results, "LARGEST_FILES_BYTES", int(1.5 * frame.stat().st_size))
    with pytest.raises(SceneError, match="has 1 samples"):
        read(SCENE, [frame], "si", None)
    with pytest.raises(SceneError, match="cannot be read"):  # of both together
        read(SCENE, [frame, frame], "si", None)


@pytest.mark.parametrize("signs", [";,", ";.", "\t,", ",."])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "latin-1"])
def test_separators_and_decimal_commas(
    signs: str, encoding: str, truth: FloatArray, tmp_path: Path
) -> None:
    """As spreadsheets export them in countries that write 101,5."""
    separator, decimal = signs[0], signs[1]
    file = tmp_path / "peaks.csv"
    rows = [["contact", "stoß", "peak_force_N"]]
    rows += [[str(k), "1.5", f"{force:.12g}"] for k, force in enumerate(truth, start=2)]
    lines = [separator.join(row) + "\n" for row in rows]
    text = lines[0] + "".join(lines[1:]).replace(".", decimal)
    file.write_text(text, encoding=encoding)
    peaks = read(SCENE, [file], "si", None)
    assert peaks.peak_force == pytest.approx(truth, rel=1e-11, abs=0)
    table = pandas.read_csv(file, sep=separator, decimal=decimal, encoding=encoding)
    assert hc.judge(SCENE, table).verdict == "pass"


def test_columns_stand_in_any_order_among_others(tmp_path: Path) -> None:
    file = tmp_path / "peaks.csv"
    file.write_text('\ufeffnote, peak_force_N ,contact\n"a,b",3.5,4\n,2e2,2\n\n,0,3.0\n')
    peak_force = read(SCENE, [file], "si", None).peak_force
    assert peak_force.tolist()[:3] == [200.0, 0.0, 3.5]
    assert np.isnan(peak_force[3:]).all()
    file.write_text(
        "# made by\n\n# contact peak_force_N\n2 200\n4  3.5\n"
    )  # as np.savetxt writes it
    assert read(SCENE, [file], "si", None).peak_force[[0, 2]].tolist() == [200.0, 3.5]


@pytest.mark.parametrize(("share", "at_the_end"), [(0.05 / 3, False), (0.15, True)])
def test_a_force_before_the_pulse_is_no_push(share: float, at_the_end: bool) -> None:
    """On either side of a twentieth of the largest force."""
    force = np.zeros((9, N))
    force[1, -1] = share
    force[2:, 0] = 1.0
    assert pushed_at_the_end(force) == at_the_end
    assert not pushed_at_the_end(force[:, :-1])
    assert pushed_at_the_end(-force[:, ::-1]) != at_the_end


def given_by(run: Samples, every: int, tmp_path: Path, factor: float = 1.0) -> Path:
    file = tmp_path / "dump"
    some = Samples(run.time[::every], run.position[::every], factor * run.net_force[::every])
    file.write_text("".join(dump_of(some)), encoding="utf-8")
    return file


def test_the_sampling_error_adds_to_the_tolerance(run: Samples, tmp_path: Path) -> None:
    file = given_by(run, 3, tmp_path)
    judged = hc.judge(SCENE, file, tolerance=1e-3)
    error = judged.sampling_error
    assert 1e-5 < error < 1e-3
    assert f"they may be off by up to {error:.1e} for that" in judged.remarks[0]
    assert not any("not judged" in remark for remark in judged.remarks)
    rare = hc.judge(SCENE, given_by(run, 6, tmp_path), tolerance=1e-4)
    assert rare.remarks[1].startswith("11 contacts are not judged, as samples so far apart")
    assert "0 judged, 0 failed, 0 not given, 11 sampled too rarely, not judged" in " ".join(
        str(rare).split()
    )
    for factor, verdict in ((1 + 0.98e-3, "pass"), (1 + 1.1e-3 + 2 * error, "fail")):
        changed = hc.judge(SCENE, given_by(run, 3, tmp_path, factor))
        assert changed.verdict == verdict


# Results that cannot be used are one sentence

GRANULES = "ITEM: ATOMS id x vx fx"
USUAL = b"contact,peak_force_N\n"
ROWS = "".join(f"\n{k} {k} 0 0" for k in range(1, N + 1))
BROKEN: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "is empty, must be a CSV file with a header"),
    "no row": (USUAL, "has no peak"),
    "binary": (bytes(range(256)) * 10, "is not a text file"),
    "other columns": (b"a,b\n1,2\n3,4\n", "has the columns 'a', 'b', must have contact and peak_f"),
    "a trace": (b"t [us];F [N]\n0;1\n", "name them with --column time=... --column gauge_16=..."),
    "no number": (USUAL + b"2,x\n", "peak_force_N in row 1 = 'x': must be a finite number"),
    "cut off": (USUAL + b"2,3\n3\n", "peak_force_N in row 2 = '': must be a finite number"),
    "a cell more": (
        USUAL + b"2,3\n3,4,5\n",
        "is no table: line 3 has more cells than the first, must be a CSV file",
    ),
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
    "a spreadsheet": (
        b"PK\x03\x04\0\0",
        "unpack an archive, save a spreadsheet as CSV",
    ),
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
        "must have finite numbers in the columns id, x, fx",
    ),
    "pairs": (f"{HEAD}ITEM: ENTRIES a b c d{ROWS}".encode(), "must have the columns id, x"),
    "no header": (b"2,3.0\n3,4.0\n", "has no header, must be a CSV file with a header that names"),
    "prose": (
        b"a word,\n,more, words, and more\n",
        "is no table: a row has more cells than the first",
    ),
    "frames that differ": (
        f"{HEAD}{GRANULES}{ROWS}\n{HEAD}ITEM: ATOMS id vx x fx{ROWS}".encode(),
        "frame 2: must have the columns .* the same as other frames",
    ),
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
