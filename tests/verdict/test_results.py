"""Results as people have them: files of LAMMPS and of others, read, sampled and judged."""

from __future__ import annotations

import contextlib
import gzip
import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.engine import engine
from hertzchain.errors import SceneError
from hertzchain.verdict.results import tables
from hertzchain.verdict.results.motion import Motion, last_digit, peaks_of
from hertzchain.verdict.results.reading import read
from tests import scenes
from tests.command_line import Command
from tests.conftest import STEEL
from tests.effort import effort

N = 12
SCENE = hc.Scene(hc.Chain(N, **STEEL), hc.Pulse("cosine", 100.0, 2.0, rise_time=5e-5), hc.Run(4e-4))
DT = 1e-7
EVERY = 20  # steps between two samples: 0.14 natural time units

OF_VELOCITIES = 0.02 * (DT / SCENE.units.time) ** 2
"""Error of peaks between samples by velocity Verlet's own velocities, which are no derivatives, at
most: 0.006 (dt / unit)^2 measured, 3 % of the error of its steps."""


@dataclass(frozen=True, eq=False)
class Samples:
    """A run of native, sampled: what files of other codes hold."""

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    net_force: FloatArray
    contact_force: FloatArray


def sampled(scene: hc.Scene, apart: float, phase: float = 0.0) -> Samples:
    """Samples so far apart in natural time units."""
    unit = scene.units.time
    time = np.arange(phase * apart * unit, scene.end_time, apart * unit)
    history = hc.Native(rtol=1e-9).run(scene, record=time).history
    assert history is not None
    force = history.contact_force
    net = np.broadcast_to(scene.granules.constant_force, history.displacement.shape).copy()
    net[:, 0] += scene.applied_force(time)
    net[:, :-1] -= force[:, : scene.chain.granules - 1]
    net[:, 1:] += force[:, : scene.chain.granules - 1]
    if scene.wall is not None:
        net[:, -1] -= force[:, -1]
    position = scene.granules.position + history.displacement
    between = force[:, : scene.chain.granules - 1]
    return Samples(time, position, history.velocity, net, between)


@pytest.fixture(scope="module")
def truth() -> FloatArray:
    return hc.Native("reference").run(SCENE).peak_force


@pytest.fixture(scope="module")
def run() -> Samples:
    return sampled(SCENE, 0.1)


# Sampling


def off(found: FloatArray, true: FloatArray) -> FloatArray:
    """Relative differences of the peaks that count."""
    counts = true > 1e-3 * true.max()
    return np.asarray(np.abs(found[counts] / true[counts] - 1))


WAYS: dict[str, Callable[[Samples], Motion]] = {
    "all": lambda r: Motion(r.time, True, r.position, r.velocity, r.net_force),
    "positions": lambda r: Motion(r.time, True, r.position),
    "net forces": lambda r: Motion(r.time, True, net_force=r.net_force),
    "contact forces": lambda r: Motion(r.time, False, contact_force=r.contact_force),
}


@pytest.mark.parametrize("apart", [0.05, 0.2, 0.5, pytest.param(0.8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["cosine_LM0.3_n2", pytest.param("demo", marks=pytest.mark.slow)])
def test_peaks_are_off_by_no_more_than_is_said(name: str, apart: float) -> None:
    scene = scenes.load(name)
    result = hc.Native("reference").run(scene)
    samples = sampled(scene, apart, 0.3)
    counts = result.peak_force > 1e-3 * result.peak_force.max()
    for way, make in WAYS.items():
        found = peaks_of(scene, make(samples), "file")
        # The reference itself is right to 1e-9.
        allowed = found.error[counts] + 1e-9
        assert np.all(off(found.peak_force, result.peak_force) <= allowed), way


@pytest.mark.parametrize("way", WAYS)
def test_what_is_said_is_not_far_from_what_it_is(way: str, run: Samples) -> None:
    """Compare error and bound at 0.1 natural time units; engines' interpolation has 1e-8 there."""
    least = 1e-8 if way == "all" else 1e-6
    found = peaks_of(SCENE, WAYS[way](run), "file")
    assert np.max(found.error) < 100 * least
    assert np.median(found.error) > 0


@settings(max_examples=20, deadline=None)
@given(st.floats(0.03, 0.8), st.floats(0.0, 1.0), st.floats(-0.3, 0.3))
def test_maxima_of_a_curve_are_off_by_no_more_than_is_said(
    apart: float, phase: float, skew: float
) -> None:
    """A hump with a known maximum of 1, which lasts about as long as a wave."""
    time = np.arange(-6, 6, apart) + phase * apart
    shape = 1 / np.cosh(0.7 * time) ** 2 / np.cosh(0.7 * skew * time)
    motion = Motion(time + 10, False, contact_force=np.column_stack([shape, 0.5 * shape]))
    scene = hc.Scene(hc.Chain(3, **STEEL), hc.Pulse("cosine", 100.0, 2.0, rise_time=5e-5))
    found = peaks_of(scene, motion, "file")
    assert np.all(np.abs(found.peak_force / (1.0, 0.5) - 1) <= found.error + 1e-12)


@pytest.mark.parametrize("higher", [0.99, 1.0, 1.001, 1.01, 1.03])
@pytest.mark.parametrize("rate", [0.7, 1.2, 1.5])
def test_the_maximum_may_be_that_of_another_hump(rate: float, higher: float) -> None:
    """The first hump has a sample at its maximum; the second, which may be shorter, has none."""
    time = 0.4 * np.arange(-30.0, 90.0)
    shape = 1 / np.cosh(0.7 * time) ** 2 + higher / np.cosh(rate * (time - 8.2)) ** 2
    motion = Motion(time, False, contact_force=np.column_stack([shape, shape[::-1]]))
    scene = hc.Scene(hc.Chain(3, **STEEL), hc.Pulse("cosine", 100.0, 2.0, rise_time=5e-5))
    found = peaks_of(scene, motion, "file")
    # At 8 time units the other hump adds 4 exp(-1.4 * 8) = 5e-5.
    assert np.all(np.abs(found.peak_force / max(1.0, higher) - 1) <= found.error + 6e-5)
    assert rate > 0.7 or np.all(found.error < 2e-3)


@pytest.mark.parametrize("digits", [4, 6, 9, 12])
def test_digits_of_numbers_are_counted(digits: int, run: Samples, truth: FloatArray) -> None:
    """Positions of six digits tell overlaps to 1e-7 m of 1e-5 m."""

    def rounded(values: FloatArray) -> FloatArray:
        words = [f"{value:.{digits}g}" for value in values.ravel()]
        return np.array(words, float).reshape(values.shape)

    position = rounded(run.position)
    grain = last_digit(position)
    assert grain == pytest.approx(10.0 ** (-digits), rel=1e-9, abs=0)  # places of 0.1 m
    found = peaks_of(SCENE, Motion(run.time, True, position, grain=grain), "file")
    assert np.all(off(found.peak_force, truth) <= found.error)
    force = rounded(run.contact_force)
    found = peaks_of(
        SCENE, Motion(run.time, True, contact_force=force, force_grain=last_digit(force)), "file"
    )
    assert np.all(off(found.peak_force, truth) <= found.error)


def test_positions_of_few_digits_are_left_for_forces(run: Samples) -> None:
    few = np.round(run.position, 6)
    motion = Motion(run.time, True, few, run.velocity, run.net_force, grain=1e-6)
    assert peaks_of(SCENE, motion, "file").how.startswith("samples of net forces")
    motion = replace(motion, position=run.position, grain=0.0)
    assert peaks_of(SCENE, motion, "file").how.startswith("positions, velocities")


GRAVITY = hc.Precompression(gravity=9.81)
RESTITUTION = hc.Contact("restitution", restitution=0.9)
VISCOELASTIC = hc.Contact("viscoelastic", relaxation_time=1e-7)
TERMS = {
    "striker on a wall": hc.Scene(SCENE.chain, hc.Striker(1.0), SCENE.run, wall=hc.Wall("rigid")),
    "pressed": replace(SCENE, precompression=hc.Precompression(force=20.0)),
    "column": replace(SCENE, wall=hc.Wall("same"), precompression=GRAVITY),
    "damped": replace(SCENE, contact=RESTITUTION),
    "damped, with a wall": replace(SCENE, contact=VISCOELASTIC, wall=hc.Wall("same")),
}


@pytest.mark.parametrize("name", TERMS)
def test_scenes_with_terms(name: str) -> None:
    scene = TERMS[name]
    true = hc.Native(rtol=1e-8).run(scene).peak_force[: scene.chain.granules - 1]
    samples = sampled(scene, 0.1)
    for way, make in WAYS.items():
        if scene.contact is not None and way.startswith("positions"):
            with pytest.raises(SceneError, match="says nothing of contact forces in such a scene"):
                peaks_of(scene, make(samples), "file")
            continue
        found = peaks_of(scene, make(samples), "file")
        assert np.all(off(found.peak_force, true) <= found.error + 1e-8), way
        assert np.max(found.error) < 1e-3, way


# Files of LAMMPS


def deck(folder: Path, axis: str = "x", sign: int = 1) -> str:
    """A run of the scene that writes every kind of file."""
    at, force = ["0", "0", "0"], ["0.0", "0.0", "0.0"]
    k = "xyz".index(axis)
    at[k] = "$((v_i-1)*0.0095)" if sign > 0 else "$(-(v_i-1)*0.0095)"
    force[k] = "v_push"
    each = range(1, N + 1)
    return f"""\
units si
atom_style sphere
boundary f f f
comm_modify vel yes
newton off
atom_modify map array sort 0 0
region box block -0.13 0.13 -0.13 0.13 -0.13 0.13 units box
create_box 1 box
variable i loop {N}
label granule
create_atoms 1 single {" ".join(at)} units box
next i
jump SELF granule
set group all diameter 0.0095
set group all density 7958
neighbor 0.002 bin
pair_style granular
pair_coeff * * hertz/material 193e9 0.0 0.3 tangential linear_nohistory 0.0 0.0
fix motion all nve
group first id 1
variable push equal {sign * 100}*sin(PI/2*time/5e-05)^2
fix shock first addforce {" ".join(force)}
timestep {DT}
dump six all custom {EVERY} {folder}/six.dump id type x y z vx vy vz fx fy fz
dump fine all custom {EVERY} {folder}/fine.dump id x y z vx vy vz fx fy fz
dump_modify fine format float %.15g
dump places all custom {EVERY} {folder}/places.dump id xu yu zu
dump_modify places format float %.15g time yes units yes
dump few all custom {EVERY} {folder}/few.dump id x y z
dump frames all custom {EVERY} {folder}/frame.* id x y z vx vy vz fx fy fz
{"".join(f"variable f{j} equal f{axis}[{j}]{chr(10)}" for j in each)}
thermo {EVERY}
thermo_style custom step time {" ".join(f"v_f{j}" for j in each)}
fix shown all print {EVERY} "$(time) {" ".join(f"$(f{axis}[{j}])" for j in each)}" &
    file {folder}/print.txt screen no title "time {" ".join(f"f{j}" for j in each)}"
fix mean all ave/time 1 1 {EVERY} {" ".join(f"v_f{j}" for j in each)} file {folder}/ave.txt
log {folder}/log.lammps
run 1000
unfix shock
run 3000
undump six
undump fine
undump places
undump few
undump frames
unfix shown
unfix mean
log none
"""


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


def dump_of(run: Samples, beside: FloatArray | float = 0.0) -> list[str]:
    """Frames of a dump of places, with some granules beside the others [m]."""
    across = np.broadcast_to(beside, N)
    return [
        HEAD.replace("\n0\n", f"\n{step}\n", 1)
        + "ITEM: ATOMS id x y\n"
        + "".join(f"{k + 1} {x:.15g} {across[k]:.15g}\n" for k, x in enumerate(places))
        for step, places in enumerate(run.position)
    ]


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


# Tables


def table(run: Samples, head: str, values: FloatArray, name: str, factor: float = 1.0) -> str:
    columns = [head, *(name.format(k) for k in range(1, values.shape[1] + 1))]
    rows = np.column_stack([run.time, values * factor])
    lines = [",".join(f"{value:.12g}" for value in row) for row in rows]
    return "\n".join([",".join(columns), *lines]) + "\n"


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


# Sampling in the verdict


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


# Unusable files

GRANULES = "ITEM: ATOMS id x vx fx"
USUAL = b"contact,peak_force_N\n"
ROWS = "".join(f"\n{k} {k} 0 0" for k in range(1, N + 1))
SERIES = "time," + ",".join(f"fx{k}" for k in range(1, N + 1)) + "\n"
SERIES += "".join(f"{k}," + ",".join(str(k * j % 7) for j in range(N)) + "\n" for k in range(20))
HEAD = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n12\nITEM: BOX BOUNDS f f f\n0 1\n0 1\n0 1\n"
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


def test_net_forces_before_a_wall_need_times() -> None:
    scene = TERMS["column"]
    samples = sampled(scene, 0.1)
    motion = replace(WAYS["net forces"](samples), is_clock=False)
    with pytest.raises(SceneError, match="has steps and no times: give --dt"):
        peaks_of(scene, motion, "file")


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


def test_contacts_that_pull_a_little_are_no_negative_forces(run: Samples) -> None:
    """As cohesion does: the largest force still presses."""
    force = np.where(run.contact_force > 0, run.contact_force, -0.01 * run.contact_force.max())
    peaks = peaks_of(SCENE, Motion(run.time, True, contact_force=force), "file").peak_force
    assert np.all(peaks > 0)


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
