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
from hertzchain.verdict import results
from hertzchain.verdict.results import pushed_at_the_end, read
from tests.command_line import Command
from tests.verdict.results.runs import DT, SCENE, N, Samples, deck, dump_of, off


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


def test_a_dump_may_be_packed_have_other_units_or_any_name(
    run: Samples, truth: FloatArray, tmp_path: Path
) -> None:
    micro = Samples(1e6 * run.time, 1e6 * run.position, 1e9 * run.net_force)
    (tmp_path / "dump.gz").write_bytes(gzip.compress("".join(dump_of(run)).encode()))
    (tmp_path / "dump.xyz").write_text("".join(dump_of(micro)), encoding="utf-8")
    for name, units in (("dump.gz", "si"), ("dump.xyz", "micro")):
        peaks = read(SCENE, [tmp_path / name], units, None)
        assert np.all(off(peaks.peak_force, truth) <= peaks.error), name


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
    frame, table, bomb = (tmp_path / name for name in ("1", "peaks.csv", "bomb.gz"))
    frame.write_text(dump_of(run)[0], encoding="utf-8")
    table.write_text("contact,peak_force_N\n2,3.0\n", encoding="utf-8")
    bomb.write_bytes(gzip.compress(bytes(10**6)))
    with pytest.raises(SceneError, match=r"has 1 samples of the run, .*: name all files of a dump"):
        read(SCENE, [frame], "si", None)
    monkeypatch.setattr(results, "LARGEST_FILES_BYTES", 10)
    with pytest.raises(SceneError, match="larger than"):
        read(SCENE, [table], "si", None)
    monkeypatch.setattr(results, "LARGEST_FILES_BYTES", 10**5)
    with pytest.raises(SceneError, match="when unpacked"):
        read(SCENE, [bomb], "si", None)
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


@pytest.mark.parametrize("first", [0, 1])
def test_contacts_numbered_from_0_or_1_get_a_hint(first: int, tmp_path: Path) -> None:
    file = tmp_path / "peaks.csv"

    def written(count: int) -> list[Path]:
        rows = (f"{k},100\n" for k in range(first, first + count))
        file.write_text("contact,peak_force_N\n" + "".join(rows))
        return [file]

    words = f"contact in row 1 = {first}: .* these numbers begin with {first}: add {2 - first} "
    with pytest.raises(SceneError, match=words):
        read(SCENE, written(N - 1), "si", None)
    # One more than there are contacts is another chain, or counts granules.
    with pytest.raises(SceneError, match=r"contact 2 lies between granules 1 and 2$"):
        read(SCENE, written(N), "si", None)


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
