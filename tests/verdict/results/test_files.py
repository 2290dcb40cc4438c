"""Files as people have them: of LAMMPS, and tables; what their sampling adds to a tolerance."""

from __future__ import annotations

import contextlib
import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.engine import engine
from hertzchain.errors import SceneError
from hertzchain.verdict.results import tables
from hertzchain.verdict.results.reading import read
from tests.command_line import Command
from tests.verdict.results.runs import (
    DT,
    OF_VELOCITIES,
    SCENE,
    N,
    Samples,
    deck,
    dump_of,
    off,
    table,
)


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
@pytest.mark.parametrize(
    ("file", "dt", "words", "most"),
    [
        ("six.dump", None, "net forces", 5e-5),
        ("six.dump", DT, "net forces", 5e-5),
        ("fine.dump", None, "net forces", 5e-5),
        ("fine.dump", DT, "between the samples", 1e-6),
        ("places.dump", None, "positions, by Hertz's law", 5e-5),
        ("frame.*", None, "net forces", 5e-5),
        ("log.lammps", None, "net forces", 5e-5),
        ("print.txt", None, "net forces", 5e-5),
        ("ave.txt", None, "net forces", 5e-5),
    ],
)
def test_files_of_lammps_have_its_peaks(
    file: str, dt: float | None, words: str, most: float, files: Path, verlet: FloatArray
) -> None:
    found = read(SCENE, list(files.glob(file)), {}, "si", dt)
    assert words in found.how
    assert np.all(off(found.peak_force, verlet) <= found.error + OF_VELOCITIES)
    assert np.max(found.error) < most


@pytest.mark.lammps
@pytest.mark.parametrize(("axis", "sign"), [("y", 1), ("z", -1)])
def test_the_axis_and_the_pushed_end_are_found(
    axis: str, sign: int, tmp_path: Path, verlet: FloatArray
) -> None:
    file = tmp_path / "in.chain"
    file.write_text(deck(tmp_path, axis, sign), encoding="utf-8")
    with engine() as lammps:
        lammps.file(str(file))
    for name in ("six.dump", "fine.dump", "places.dump"):
        found = read(SCENE, [tmp_path / name], {}, "si", None)
        assert np.all(off(found.peak_force, verlet) <= found.error + OF_VELOCITIES), name


@pytest.mark.lammps
def test_digits_that_are_too_few_are_the_reason_given(files: Path) -> None:
    """Six digits of places are 1e-7 m here, where overlaps are 5e-6 m."""
    judged = hc.judge(SCENE, files / "few.dump")
    assert not judged.judged.any()
    assert "11 contacts are not judged, as samples so far apart, or numbers" in judged.remarks[1]
    assert judged.remarks[1].endswith("dump_modify format float %.15g")
    true = judged.reference.peak_force
    assert judged.sampling is not None
    assert np.all(off(judged.given, true) <= judged.sampling[true > 1e-3 * true.max()])


@pytest.mark.lammps
def test_a_dump_may_be_packed_or_have_any_name(files: Path, tmp_path: Path) -> None:
    content = (files / "fine.dump").read_bytes()
    (tmp_path / "dump.gz").write_bytes(gzip.compress(content))
    (tmp_path / "dump.xyz").write_bytes(content)
    peaks = read(SCENE, [files / "fine.dump"], {}, "si", None).peak_force
    for name in ("dump.gz", "dump.xyz"):
        assert np.array_equal(read(SCENE, [tmp_path / name], {}, "si", None).peak_force, peaks)


@pytest.mark.lammps
def test_a_run_of_lammps_is_judged(files: Path, hertzchain: Command) -> None:
    SCENE.to_toml(files / "scene.toml")
    judged = hertzchain("judge", files / "scene.toml", files / "six.dump", "--json")
    document = judged.json()
    assert (judged.status, document["verdict"]) == (0, "pass")
    assert document["sampling_error"] < 5e-5
    assert document["remarks"][0].startswith("peaks are from samples of net forces")
    shown = hertzchain("judge", files / "scene.toml", files / "ave.txt")
    assert "samples 20 steps apart" in " ".join(shown.out.split())
    other = replace(SCENE, shock=hc.Pulse("cosine", 101.0, 2.0, rise_time=5e-5))
    assert hc.judge(other, files / "log.lammps").verdict == "fail"


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
        read(SCENE, [tmp_path / "dump"], {}, "si", None)


def test_files_that_are_not_one_dump(
    run: Samples, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, other, log, bomb = (tmp_path / name for name in ("1", "2", "log", "bomb.gz"))
    frame = dump_of(run)[0]
    one.write_text(frame, encoding="utf-8")
    other.write_text(frame.replace("id x y", "id x z"), encoding="utf-8")
    log.write_text("LAMMPS (22 Jul 2025)\n", encoding="utf-8")
    bomb.write_bytes(gzip.compress(bytes(10**6)))
    for files, words in (
        ([one], "has 1 samples of the run, .*: name all files of a dump"),
        ([one, other], "has frames of different columns"),
        ([one, log], "log: is no dump of LAMMPS: several files"),
    ):
        with pytest.raises(SceneError, match=words):
            read(SCENE, files, {}, "si", None)
    monkeypatch.setattr(tables, "MOST_BYTES", 10**5)
    with pytest.raises(SceneError, match="when unpacked"):
        read(SCENE, [bomb], {}, "si", None)


def test_warnings_between_the_lines_of_a_log_are_skipped() -> None:
    rows = "   Step   v_f2\n  0  1.5\nWARNING: Communication cutoff is 0\n  10  2.5\n"
    log = f"LAMMPS (2 Aug 2023)\n{rows}Loop time of 1\n{rows.replace('  0  1.5', '  5  9')}Loop"
    table = tables.table_of(log, "log")
    assert table.names == ("Step", "v_f2")
    np.testing.assert_array_equal(table.numbers([0, 1]), [[0, 1.5], [10, 2.5], [5, 9], [10, 2.5]])


@pytest.mark.parametrize(
    ("head", "name", "what", "columns", "factor"),
    [
        ("time", "f{}", "net_force", {}, 1.0),
        ("time_s", "contact_force_{}", "contact_force", {}, 1.0),
        ("t", "x{}", "position", {}, 1.0),
        ("T", "N_{}", "contact_force", {"time": "T", "contact_force": "N_*"}, 1.0),
        ("T", "N_{}", "contact_force", {"time": "T", "contact_force": "N_* [kN]"}, 1e-3),
        ("T", "q{}", "net_force", {"time": "T", "net_force": "q* [2 mN]"}, 500.0),
        ("T", "p{}", "position", {"time": "T", "position": "p* [mm]"}, 1e3),
    ],
)
def test_series_in_columns(
    head: str,
    name: str,
    what: str,
    columns: dict[str, str],
    factor: float,
    run: Samples,
    truth: FloatArray,
    tmp_path: Path,
) -> None:
    text = table(run, head, getattr(run, what), name, factor)
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    (tmp_path / "b.txt").write_text(text.replace(",", "\t"), encoding="utf-8")
    for file in ("a.csv", "b.txt"):
        found = read(SCENE, [tmp_path / file], columns, "si", None)
        assert np.all(off(found.peak_force, truth) <= found.error + 1e-9)
    frame = pandas.read_csv(tmp_path / "a.csv")
    same = read(SCENE, frame, columns, "si", None)
    assert np.array_equal(same.peak_force, found.peak_force)


def test_peaks_in_other_columns_and_units(truth: FloatArray, tmp_path: Path) -> None:
    file = tmp_path / "peaks.txt"
    rows = "".join(f"{k} x {force / 1e3:.12g}\n" for k, force in enumerate(truth, start=2))
    file.write_text("i note F\n" + rows.replace(" x ", " 0 "), encoding="utf-8")
    found = read(SCENE, [file], {"contact": "i", "peak_force": "F [kN]"}, "si", None)
    assert found.how == ""
    assert found.peak_force == pytest.approx(truth, rel=1e-11, abs=0)
    frame = pandas.DataFrame({0: range(2, N + 1), 1: truth})
    judged = hc.judge(SCENE, frame, columns={"contact": "0", "peak_force": "1"})
    assert (judged.verdict, judged.sampling_error) == ("pass", None)
    dyne = pandas.DataFrame({"contact": range(2, N + 1), "F": 1e5 * truth})
    assert hc.judge(SCENE, dyne, columns={"peak_force": "F"}, units="cgs").verdict == "pass"
    lj = hc.judge(SCENE, dyne, columns={"peak_force": "F [10 uN]"}, units="lj")
    assert lj.verdict == "pass"


@pytest.mark.parametrize(
    ("separator", "decimal", "end"),
    [(";", ",", ""), (";", ".", ""), (";", ",", ";"), ("\t", ".", "\t"), ("  ", ",", "")],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "latin-1"])
def test_separators_and_decimal_commas(
    separator: str, decimal: str, end: str, encoding: str, truth: FloatArray, tmp_path: Path
) -> None:
    """As spreadsheets export them in countries that write 101,5."""
    file = tmp_path / "peaks.csv"
    rows = [["contact", "stoß", "peak_force_N"]]
    rows += [[str(k), "1.5", f"{force:.12g}"] for k, force in enumerate(truth, start=2)]
    lines = [separator.join(row) + end + "\n" for row in rows]
    text = lines[0] + "".join(lines[1:]).replace(".", decimal)
    file.write_text(text, encoding=encoding)
    found = read(SCENE, [file], {}, "si", None)
    assert found.peak_force == pytest.approx(truth, rel=1e-11, abs=0)


def test_the_usual_columns_stand_in_any_order_among_others(tmp_path: Path) -> None:
    """``_N`` says what it is, whatever the other units; a contact may be missing."""
    file = tmp_path / "peaks.csv"
    file.write_text('\ufeffnote, peak_force_N ,contact\n"a,b",3.5,4\n,2e2,2\n\n,0,3.0\n')
    found = read(SCENE, [file], {}, "cgs", None).peak_force
    assert found.tolist()[:3] == [200.0, 0.0, 3.5]
    assert np.isnan(found[3:]).all()


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("name", ["peak_force_N", "F"])
def test_contacts_numbered_from_0_or_1_get_a_hint(first: int, name: str, tmp_path: Path) -> None:
    file = tmp_path / "peaks.csv"
    columns = {"contact": "contact", "peak_force": name} if name == "F" else {}

    def written(count: int) -> list[Path]:
        rows = (f"{k},100\n" for k in range(first, first + count))
        file.write_text(f"contact,{name}\n" + "".join(rows))
        return [file]

    words = f"contact in row 1 = {first}: .* these numbers begin with {first}: add {2 - first} "
    with pytest.raises(SceneError, match=words):
        read(SCENE, written(N - 1), columns, "si", None)
    # One more than there are contacts is another chain, or counts granules.
    with pytest.raises(SceneError, match=r"contact 2 lies between granules 1 and 2$"):
        read(SCENE, written(N), columns, "si", None)


def given_by(run: Samples, every: int, tmp_path: Path, factor: float = 1.0) -> Path:
    file = tmp_path / "series.csv"
    some = Samples(*(array[::every] for array in vars(run).values()))
    file.write_text(table(some, "time", some.contact_force, "fc{}", factor), encoding="utf-8")
    return file


def test_the_sampling_error_adds_to_the_tolerance(run: Samples, tmp_path: Path) -> None:
    file = given_by(run, 3, tmp_path)
    judged = hc.judge(SCENE, file, tolerance=1e-3)
    error = judged.sampling_error
    assert error is not None
    assert 1e-5 < error < 1e-3
    assert f"they may be off by up to {error:.1e} for that" in judged.remarks[0]
    for factor, verdict in ((1 + 0.98e-3, "pass"), (1 + 1.1e-3 + 2 * error, "fail")):
        changed = hc.judge(SCENE, given_by(run, 3, tmp_path, factor))
        assert changed.verdict == verdict


def test_reports_say_what_sampling_costs(run: Samples, tmp_path: Path, hertzchain: Command) -> None:
    scene, xml = tmp_path / "scene.toml", tmp_path / "junit.xml"
    SCENE.to_toml(scene)
    file = given_by(run, 3, tmp_path)
    error = hc.judge(SCENE, file).sampling_error
    shown = hertzchain("judge", scene, file)
    words = " ".join(shown.out.split())
    assert f"error of sampling, at most {error:.1e}, which adds to the tolerance" in words
    assert "sampled too rarely" not in words
    given_by(run, 6, tmp_path)
    rare = hertzchain("judge", scene, file, "--tolerance", 1e-4, "--junit", xml)
    assert rare.status == 1
    assert "0 judged, 0 failed, 0 not given, 11 sampled too rarely, not judged" in rare.out
    assert xml.read_text(encoding="utf-8").count("sampled too rarely to be judged") == 11
