"""Stored sweeps: folders, formats, resumed and refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import polars
import pytest

import hertzchain as hc
from hertzchain.errors import OutputError, SceneError
from hertzchain.sweeps import loop
from hertzchain.sweeps.sweeping import claimed, settings
from tests.sweeps.conftest import GRID, SHORT


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """A folder with the sweep over ``GRID``."""
    hc.sweep(SHORT, GRID, output=tmp_path / "out")
    return tmp_path / "out"


@pytest.mark.lammps
@pytest.mark.usefixtures("one_core")
def test_a_folder_has_what_memory_has_and_opens_in_pandas_and_polars(tmp_path: Path) -> None:
    vary = {**GRID, "shock.momentum_ratio": [1.0], "shock.peak_force": [100.0, 1e9]}  # too deep
    backends = ("native", hc.Lammps(rtol=1e-3))
    out = tmp_path / "out"
    kept = hc.sweep(SHORT, vary, backends=backends, peaks=True, output=out)
    memory = hc.sweep(SHORT, vary, backends=backends, peaks=True)
    table = memory.to_frame().sort_values(["backend", "scene"], ignore_index=True)
    for frame in (kept.to_frame(), hc.Sweep.load(out).to_frame()):
        pd.testing.assert_frame_equal(frame, table, check_exact=True)
    pd.testing.assert_frame_equal(kept.peaks_to_frame(), memory.peaks_to_frame(), check_exact=True)
    assert kept.count() == memory.count()
    opened = {
        "pandas": pd.read_parquet(out / "scenes"),
        "polars": polars.read_parquet(out / "scenes" / "*.parquet").to_pandas(),
    }
    lists = ["contact", "peak_force_N", "peak_time_s"]
    for who, frame in opened.items():
        assert list(frame.columns) == [*table.columns, *lists], who
        whole = frame.sort_values(["backend", "scene"], ignore_index=True)
        same: Any = {"check_dtype": False, "check_exact": True, "obj": who}
        pd.testing.assert_frame_equal(whole[table.columns], table, **same)
        long = whole.dropna(subset=lists).explode(lists, ignore_index=True)
        peaks = kept.peaks_to_frame()
        pd.testing.assert_frame_equal(long[peaks.columns].astype(peaks.dtypes), peaks, **same)


def test_a_sweep_that_is_there_is_not_measured_again_and_what_is_half_written_is_removed(
    out: Path,
) -> None:
    first = hc.Sweep.load(out).to_frame()
    written = {path: path.stat().st_mtime_ns for path in out.rglob("*.parquet")}
    for left in (out / ".hertzchain-killed", out / "scenes" / ".hertzchain-killed"):
        left.mkdir()
        (left / "native-0000.parquet").write_bytes(b"PAR1 and no more")
    told: list[tuple[int, int]] = []
    resumed = hc.sweep(SHORT, GRID, output=out, progress=lambda *how_far: told.append(how_far))
    assert told == [(8, 8)]
    pd.testing.assert_frame_equal(resumed.to_frame(), first, check_exact=True)
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*.parquet")} == written
    assert not list(out.rglob(".hertzchain-*"))


@pytest.mark.parametrize(
    ("backend", "other", "same"),
    [
        (hc.Lammps(), hc.Lammps(time_limit=9.0), True),
        (hc.Native(), hc.Native(peaks_only=True), True),
        (hc.Lammps(), hc.Lammps(extrapolated=True), False),
        (hc.Native(), hc.Native("rk4"), False),
    ],
)
def test_what_changes_no_number_does_not_make_another_sweep(
    backend: hc.Native | hc.Lammps, other: hc.Native | hc.Lammps, same: bool
) -> None:
    first, second = map(settings, (backend, other))
    assert (first == second) is same


@pytest.mark.parametrize("is_kept", [True, False])
def test_an_unknown_column_is_refused_with_what_there_is(tmp_path: Path, is_kept: bool) -> None:
    swept = hc.sweep(SHORT, GRID, output=tmp_path / "out" if is_kept else None)
    said = r"^largest_peak_force: is not a column .* scene,.* did you mean largest_peak_force_N\?$"
    with pytest.raises(SceneError, match=said):
        swept.to_frame(["scene", "largest_peak_force"])


OTHERS: list[tuple[dict[str, Any], str]] = [
    ({"scene": replace(SHORT, run=hc.Run(1.0))}, "scene, parts"),
    ({"vary": {**GRID, "shock.momentum_ratio": "0.5:2:5:log"}}, "vary, rows"),
    ({"rtol": 1e-5}, "backends"),
    ({"backends": ["native", "lammps"]}, "backends, parts, rows"),
    ({"peaks": True}, "peaks"),
]
"""What another sweep has, and the entries of its manifest that say so."""


@pytest.mark.parametrize(("others", "entries"), OTHERS)
def test_a_folder_of_another_sweep_is_left_as_it_is(
    out: Path, others: dict[str, Any], entries: str
) -> None:
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    asked = {"scene": SHORT, "vary": GRID, **others}
    with pytest.raises(OutputError) as refused:
        hc.sweep(**asked, output=out)
    assert str(refused.value) == (
        f"{out}: belongs to another sweep, with another value of {entries} in its sweep.json; name"
        " another folder"
    )
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_another_seed_or_version_is_another_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, Any] = {"vary": {"shock.momentum_ratio": "1:2"}, "samples": 4}
    hc.sweep(SHORT, **asked, output=tmp_path)
    with pytest.raises(OutputError, match="another value of samples in"):
        hc.sweep(SHORT, **asked, seed=1, output=tmp_path)
    monkeypatch.setattr("hertzchain.sweeps.sweeping.version", lambda _: "999")
    with pytest.raises(OutputError, match="another value of hertzchain in"):
        hc.sweep(SHORT, **asked, output=tmp_path)


@pytest.mark.parametrize("was_there", [False, True])
def test_a_part_is_there_whole_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, was_there: bool
) -> None:
    out, whole = tmp_path / "out", pd.DataFrame.to_parquet
    if was_there:
        out.mkdir()

    def dies(frame: pd.DataFrame, path: Path, **options: Any) -> None:
        whole(frame, path, **options)
        path.write_bytes(path.read_bytes()[:100])
        raise KeyboardInterrupt

    with monkeypatch.context() as dying:
        dying.setattr(pd.DataFrame, "to_parquet", dies)
        with pytest.raises(KeyboardInterrupt):
            hc.sweep(SHORT, GRID, peaks=True, output=out)
    assert out.exists() is was_there  # not left, where it was made for nothing
    assert not list(tmp_path.rglob("*.parquet"))
    resumed = hc.sweep(SHORT, GRID, peaks=True, output=out)
    there = hc.sweep(SHORT, GRID, peaks=True).to_frame()
    pd.testing.assert_frame_equal(resumed.to_frame(), there, check_exact=True)


def with_changed_bit(content: bytes) -> bytes:
    """Return a file with one bit of its first column changed."""
    return content[:40] + bytes([content[40] ^ 1]) + content[41:]


DAMAGES: dict[str, Callable[[Path, Path], object]] = {
    "lost": lambda path, _: path.unlink(),
    "truncated": lambda path, _: path.write_bytes(path.read_bytes()[:-9]),
    "a bit": lambda path, _: path.write_bytes(with_changed_bit(path.read_bytes())),
    "no table": lambda path, _: path.write_bytes(path.read_bytes()[::-1]),
    "another part": lambda path, other: path.write_bytes(other.read_bytes()),
    "a column less": lambda path, _: (
        pd.read_parquet(path).drop(columns="peak_time_s").to_parquet(path)
    ),
}
"""Damages of a part, next to another one."""


@pytest.mark.parametrize("damage", DAMAGES)
def test_parts_that_are_lost_or_damaged_are_measured_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damage: str
) -> None:
    monkeypatch.setattr(loop, "MOST_ROWS", 3)
    hc.sweep(SHORT, GRID, peaks=True, output=tmp_path)
    whole = hc.sweep(SHORT, GRID, peaks=True)
    path, other = (tmp_path / "scenes" / f"native-000{k}.parquet" for k in (1, 0))
    DAMAGES[damage](path, other)
    if damage == "no table":
        words = r"cannot be read \(.*\).* the same sweep measures its scenes again"
        with pytest.raises(OutputError, match=f"{path}: {words}"):
            hc.Sweep.load(tmp_path).to_frame()
    counts: list[int] = []
    resumed = hc.sweep(
        SHORT, GRID, peaks=True, output=tmp_path, progress=lambda done, _: counts.append(done)
    )
    assert counts[0] == 5  # of 8 rows: those of the two other parts
    for frame, expected in (
        (resumed.to_frame(), whole.to_frame()),
        (resumed.peaks_to_frame(), whole.peaks_to_frame()),
    ):
        pd.testing.assert_frame_equal(frame, expected, check_exact=True)


def test_a_folder_with_other_things_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(OutputError, match=r"is not a sweep, thesis\.tex is in it"):
        hc.sweep(SHORT, GRID, output=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
    for where, words in (
        (tmp_path / "thesis.tex", "is a file, must be a folder"),
        (tmp_path / "thesis.tex" / "out", "cannot be made"),
    ):
        with pytest.raises(OutputError, match=words):
            hc.sweep(SHORT, GRID, output=where)
    for where in (tmp_path, tmp_path / "nothing", tmp_path / "thesis.tex"):
        with pytest.raises(OutputError, match="is not a sweep"):
            hc.Sweep.load(where)
    (tmp_path / "sweep.json").write_text('{"format": "parq')
    with pytest.raises(OutputError, match="cannot be read"):
        hc.sweep(SHORT, GRID, output=tmp_path)
    for nothing in ("[]", '{"format": "csv"}'):
        (tmp_path / "sweep.json").write_text(nothing)
        with pytest.raises(OutputError, match="describes no sweep"):
            hc.sweep(SHORT, GRID, output=tmp_path)


def test_a_full_disk_is_one_error_and_what_is_done_stays(full_disk: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        hc.sweep(SHORT, GRID, output=full_disk / "out")


def test_nothing_is_found_where_nothing_was_asked_for() -> None:
    with pytest.raises(OutputError, match="has no peaks of all contacts"):
        hc.sweep(SHORT, GRID).peaks_to_frame()


def test_two_processes_do_not_work_on_one_sweep(out: Path) -> None:
    manifest = json.loads((out / "sweep.json").read_text())
    with claimed(out, manifest), pytest.raises(OutputError, match="another process is at work"):
        hc.sweep(SHORT, GRID, output=out)
    assert hc.sweep(SHORT, GRID, output=out).count().done == 8


def test_a_sweep_is_not_put_into_another(out: Path) -> None:
    with pytest.raises(OutputError, match="is inside of the sweep"):
        hc.sweep(SHORT, GRID, output=out / "scenes" / "inner")
