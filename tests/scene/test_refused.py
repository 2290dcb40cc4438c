"""Scene files that cannot be, one line each: an error in one sentence with file, key and value."""

from __future__ import annotations

from pathlib import Path

import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from tests.scene.test_scene import refusal, scene_of

CHAIN = {
    "chain.granules": "60",
    "chain.radius": '"4.75 mm"',
    "chain.young_modulus": '"193 GPa"',
    "chain.poisson_ratio": "0.3",
    "chain.density": '"7958 kg/m^3"',
}
PULSE = {
    "shock.profile": '"cosine-triangular"',
    "shock.peak_force": '"100 N"',
    "shock.duration_ratio": "2",
    "shock.momentum_ratio": "2.0",
}
SINE = {"shock.profile": '"sine"', "shock.amplitude": '"5 N"', "shock.frequency": '"8 kHz"'}

BASES: dict[str, dict[str, str]] = {
    "none": {},
    "shock": PULSE,
    "chain": CHAIN,
    "pulse": CHAIN | PULSE,
    "table": CHAIN | {"shock.profile": '"table"', "shock.file": '"pulse.csv"'},
    "piston": CHAIN | {"shock.profile": '"piston"'},
    "striker": CHAIN | {"striker.velocity": '"1 m/s"'},
    "sine": CHAIN | SINE | {"shock.cycles": "3", "precompression.force": '"5 N"'},
    "measured": PULSE
    | {
        "chain.granules": "60",
        "chain.radius": "5e-3",
        "chain.stiffness": "1e10",
        "chain.mass": "4e-3",
    },
    "trapezoid": CHAIN
    | {
        "shock.profile": '"trapezoid"',
        "shock.peak_force": "10",
        "shock.duration": "3",
        "shock.rise_time": "1",
        "shock.fall_time": "1",
    },
    "file": PULSE | {"chain.file": '"granules.csv"'},
}
"""Scenes as keys and values in TOML."""

REFUSED = """
none => [chain]: missing section
shock => [chain]: missing section
chain => [shock]: missing section
none chain=[{granules=60}]; shock={} => chain =
pulse colour=1 => colour = 1: unknown key, allowed are the sections
pulse wal={} => did you mean wall?
pulse chain.diameter="9.5 mm" => chain.diameter = '9.5 mm': unknown key: write radius, half of it
pulse chain.granule=60 => chain.granule = 60: unknown key, allowed are granules,
pulse -chain.granules => chain.granules: missing
pulse chain.radius="4.75 s" => chain.radius = '4.75 s': has the wrong dimension
pulse run.end_tim=1 => run.end_tim = 1: unknown key, allowed are end
pulse -shock.duration_ratio => shock.duration_ratio: missing
pulse -shock.momentum_ratio => shock.momentum_ratio or rise_time: missing
pulse shock.rise_time=1 => both are given
pulse -shock.profile => shock.profile: missing
pulse shock.file="pulse.csv" => shock.file = 'pulse.csv': unknown key
pulse shock.granule=61 => shock.granule = 61: must be at most 60, the granules of the chain
pulse chain.segments=3 => chain.segments = 3: must be one or more tables, [[chain.segments]]
pulse chain.segments=[] => chain.segments = []: must be one or more tables
pulse chain.granules=1000001; chain.segments=[{granules=9}] => chain.granules = 1000001: must be at most
file chain.file=3 => chain.file = 3: must be the name of a CSV file
pulse chain.radius=1e300 => too large or too small
pulse -shock.momentum_ratio; shock.rise_time=1e308 => too large or too small
pulse chain.radius=1e-105; shock.peak_force=1 => too small to be represented; check the units
pulse chain.young_modulus=1e-308; shock.peak_force=1e-300 => too small to be represented
pulse chain.young_modulus=1e300; shock.peak_force=1e-20 => too small to be represented
pulse chain.density=1e-290; chain.young_modulus=1e-10; shock.peak_force=1e-30 => too small to be represented
pulse chain.density=1e-250; shock.peak_force=1e140 => too small to be represented
striker chain.segments=[{granules=59}, {granules=1, radius=1e-150}] => too large or too small to be represented
table -shock.file => shock.file: missing
table shock.file=3 => shock.file = 3: must be the name of a CSV file
table shock.file="no.csv" => no.csv
table shock.file="." => shock.file
table shock.file="a\\u0000b" => shock.file
table shock.peak_force=1 => shock.peak_force = 1: not allowed with file, allowed are granule, profile, file
piston => velocity or file: missing, give exactly one of them
piston shock.velocity=1; shock.file="motion.csv" => shock.velocity = 1: not allowed with file, allowed are profile, file
piston shock.velocity=1; shock.peak_force=1 => shock.peak_force = 1: not a key of profile = "piston", allowed are velocity
trapezoid shock.momentum_ratio=2 => shock.momentum_ratio = 2: not a key of profile = "trapezoid", allowed are peak_force, duration
piston shock.file="none.csv" => shock.file = 'none.csv': cannot be read
pulse shock.granule=0 => shock.granule = 0: must be an integer of at least 1
sine -precompression.force => shock.amplitude = 5.0: must be at most the static load
sine precompression.force=4.9999999 => shock.amplitude = 5.0: must be at most the static load
sine wall.kind="rigid"; -precompression.force; precompression.gravity=1e4 => shock.amplitude = 5.0: must be at most
pulse striker.velocity=1 => [shock] and [striker]: both sections are given
striker striker.loaded=true => needs [precompression]
pulse chain.segments=[{granules=10}, {granules=20}] => chain.segments: the granules of all segments must sum to chain.granules = 60
pulse chain.segments=[{granules=61}] => chain.segments.1.granules = 61: the granules
pulse chain.segments=[{radius=1e-3}] => chain.segments.1.granules: missing
pulse chain.segments=[{granules=60, cell=[]}] => chain.segments.1.cell = []: must be
pulse chain.segments=[{granules=60, cell=[{}], radius_ratio=2}] => chain.segments.1.radius_ratio = 2.0: not allowed with a cell
pulse chain.segments=[{granules=60, raduis=1e-3}] => chain.segments.1.raduis = 0.001: unknown key & did you mean radius?
pulse chain.segments=[{granules=60, gap=-1e-6}] => chain.gap of granule 1 = -1e-06
pulse chain.segments=[{granules=60, radius_ratio=1e300}] => chain.radius of granule 3 = inf: must be a finite number above 0
pulse chain.segments=[{granules=60, cell=[{poisson_ratio=0.7}]}] => chain.poisson_ratio of granule 1 = 0.7
pulse chain.granules=1000001; wall.kind="same" => chain.granules = 1000001: must be at most 1000000 in a scene with wall
pulse precompression={} => precompression.force and gravity: both are 0
pulse precompression.gravity=9.81 => precompression.gravity = 9.81: needs a [wall]
pulse precompression.force=20; chain.gap=1e-6 => chain.gap: must be 0 with [precompression]
pulse precompression.force=20; wall={kind="same", gap=1e-6} => wall.gap = 1e-06: must be 0 with [precompression]
pulse wall={} => wall.kind: missing, must be one of rigid, same, elastic
pulse wall={kind="rigid", young_modulus=1e9} => wall.young_modulus = 1000000000.0: only a wall of kind "elastic" has it
pulse chain.segments=[{granules=60, cell=[{}, {yield_strength=2e7}]}] => is allowed only with chain.yield_strength
pulse gauge={granule=3} => must be [[gauge]], with two brackets
pulse gauge=[{}] => gauge.granule or contact: missing
pulse gauge=[{granule=3, contact=3}] => gauge.granule and contact: both are given
pulse gauge=[{granule=3}, {contact=3}, {granule=3}] => gauge.granule = 3: has two gauges: leave one out
pulse gauge=[{granule=1}] => gauge.granule = 1: must be a granule from 2 to 60
pulse gauge=[{contact=61}] => gauge.contact = 61: must be a contact from 2 to 60
pulse chain.granules=1; wall.kind="same"; gauge=[{granule=1}] => granule 1 is pressed on one side only: give contact = 2
pulse chain.granules=1; wall.kind="same"; gauge=[{contact=3}] => gauge.contact = 3: must be 2, the only contact
pulse gauge=[{bead=3}] => unknown key, allowed are granule, contact
pulse contact.restitution=0.9 => contact.damping: missing, must be one of restitution, viscoelastic, dashpot
pulse contact.damping="restitution" => contact.restitution: missing
pulse contact={damping="restitution", restitution=0.5, attracton=true} => did you mean attraction?
pulse contact={damping="dashpot", coefficient=1, restitution=0.5} => contact.restitution = 0.5: not allowed with damping = "dashpot", which takes coefficient
pulse -chain.density => chain.density: missing, or give mass
pulse chain.segments=[{granules=60, mass=4e-3}] => chain.segments.1.mass = 0.004: is allowed only with chain.mass
measured chain.segments=[{granules=60, young_modulus=1e9}] => is allowed only with chain.young_modulus
measured chain.segments=[{granules=60, length=1e-2}] => is allowed only with chain.length
measured -chain.radius => chain.radius: missing
trapezoid shock.rise_time=3 => shock.rise_time = 3: must be below duration = 3 s
trapezoid shock.fall_time=1e-20 => shock.fall_time = 1e-20: must be above 3e-12 s, the rounding of times
trapezoid shock.fall_time=2.5 => shock.fall_time = 2.5: must be at most duration - rise_time = 2 s
file chain.granules=3 => chain.granules = 3: must be 2, the rows of chain.file
file chain.radius=1e-3 => chain.radius = 0.001: not allowed with file, allowed are file, granules
file chain.file="no.csv" => must be a CSV file
"""  # noqa: E501 - a line is a case
"""A scene, keys that are set or left out, and what the sentence has."""


def text_of(case: str) -> str:
    """Return the scene file of a case."""
    base, _, changes = case.partition(" ")
    keys = dict(BASES[base])
    for change in filter(None, changes.split("; ")):
        key, _, value = change.partition("=")
        if key.startswith("-"):
            del keys[key[1:]]
        else:
            keys[key] = value
    return "\n".join(f"{key} = {value}" for key, value in keys.items())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a pulse table and a table of granules."""
    (tmp_path / "pulse.csv").write_text("time_s,force_N\n0,0\n1e-5,100\n")
    (tmp_path / "granules.csv").write_text(GRANULES + TWO)
    return tmp_path


@pytest.mark.parametrize("base", ["pulse", "table", "striker", "sine", "file"])
def test_the_scenes_themselves_are_read(base: str, folder: Path) -> None:
    chain = scene_of(folder, text_of(base)).chain
    if base == "file":
        assert (chain.granules, chain.radius, chain.gap) == (2, (0.005, 0.004), 1e-6)
        assert chain.young_modulus == 193e9


@pytest.mark.parametrize("case", REFUSED.strip().splitlines())
def test_it_is_refused_in_one_sentence(case: str, folder: Path) -> None:
    given, _, words = case.partition(" => ")
    said = refusal(folder, text_of(given))
    assert said.startswith(f"{folder / 'scene.toml'}: ")
    assert [word for word in words.split(" & ") if word not in said] == []
    assert "\n" not in said


def test_a_long_value_is_not_shown_whole(tmp_path: Path) -> None:
    for value in (f'"{"m" * 10_000}"', "1" * 5000, f"0x{'f' * 5000}", "[" * 5000 + "]" * 5000):
        said = refusal(tmp_path, text_of(f"pulse chain.radius={value}"))
        assert "scene.toml: " in said
        assert len(said) < 400


def test_no_other_key_is_suggested_for_friction(tmp_path: Path) -> None:
    contact = 'contact={damping="restitution", restitution=0.5, friction=0.3}'
    assert "did you mean" not in refusal(tmp_path, text_of(f"pulse {contact}"))


NOT_TOML = [b"[chain", b"chain = ", b"\xff\xfe", b"\x00", b"\x89PNG\r\n", b"{}", b"a: 1"]
NOT_TOML += [b"a = 1\na = 2\n", b"[chain]\n[shock]\n[chain]", b"a = {b = 1, b = 2}"]


@pytest.mark.parametrize("content", NOT_TOML, ids=repr)
def test_what_is_not_toml_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=r"scene\.toml: is not TOML"):
        hc.Scene.from_toml(path)


@pytest.mark.parametrize("name", [".", "missing.toml", "x" * 5000, "with\0nul.toml"])
def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(SceneError, match="TOML"):
        hc.Scene.from_toml(tmp_path / name)


# Tables

GRANULES = "radius_m,young_modulus_Pa,poisson_ratio,density_kg_m3,gap_m\n"
TWO = "0.005,193e9,0.3,7958,0\n0.004,193e9,0.3,7958,1e-6\n"
PUSH, MOVE = "time_s,force_N\n0,1\n", "time_s,displacement_m\n1e-5,0\n"

TABLES: list[tuple[str, str, str]] = [
    ("table", "", "time_s,force_N"),
    ("table", "time_s;force_N\n0;1\n1;1\n", "time_s,force_N"),
    ("table", PUSH, "at least 2 rows"),
    ("table", PUSH + "1,one\n", "row 2 = '1,one': must be 2 numbers"),
    ("table", PUSH + "1\n", "row 2 = '1': must be 2 numbers"),
    (
        "table",
        PUSH.replace("0", "-1e-9") + "1,1\n",
        "time_s in row 1 = -1e-09: must be a finite number of at",
    ),
    ("table", PUSH + "0,2\n", "time_s in row 2 = 0.0: must be a finite number above 0.0"),
    ("table", PUSH + "inf,1\n", "time_s in row 2 = inf: must be"),
    ("table", PUSH + "1,-1e-9\n", "force_N in row 2 = -1e-09: must be"),
    ("table", PUSH + "1,1e999\n", "force_N in row 2 = inf: must be"),
    ("table", PUSH.replace("1", "0") + "1,0\n", "force_N"),
    ("table", PUSH + "1,\x00\n", "row 2"),
    ("table", "\x89PNG\r\n\x1a\n\x00\udcff\xfe", "must be a CSV file"),
    ("piston", "time_s,force_N\n0,0\n1,1\n", "must be time_s,displacement_m"),
    ("piston", MOVE.replace(",0", ",1e-9") + "1,1", "displacement_m in row 1 = 1e-09: must be 0"),
    ("piston", MOVE + "3e-5,inf\n", "displacement_m in row 2 = inf: must be a finite number"),
    ("piston", MOVE + "3e-5,0\n4e-5,0\n", "must not be 0 in all rows"),
    (
        "piston",
        MOVE.replace("1e-5", "0") + "1e-300,1e10\n",
        "displacement_m in row 2: is reached in",
    ),
    ("file", GRANULES.replace(",gap_m", "") + TWO, "first line = 'radius_m,young_modulus_Pa"),
    ("file", GRANULES.replace("gap_m", "gap_mm") + TWO, "column = 'gap_mm': is unknown: the first"),
    ("file", GRANULES + TWO + "1,2,3\n", "row 3 = '1,2,3': must be 5 numbers"),
    ("file", GRANULES, "granules = 0: must be an integer from 1"),
    ("file", GRANULES.replace("density_kg_m3", "mass_kg,density_kg_m3") + TWO, "must be 6 numbers"),
    ("file", "radius_m,stiffness_N_m-1.5,gap_m\n5e-3,1e10,0\n", "density: missing"),
    ("file", GRANULES + TWO.replace("0.004", "-1"), "radius of granule 2 = -1.0"),
]


@pytest.mark.parametrize(("base", "table", "words"), TABLES)
def test_a_table_is_refused_in_one_sentence(
    base: str, table: str, words: str, tmp_path: Path
) -> None:
    path = tmp_path / "own.csv"
    path.write_bytes(table.encode("utf-8", "surrogateescape"))
    key = "chain.file" if base == "file" else "shock.file"
    said = refusal(tmp_path, text_of(f'{base} {key}="own.csv"'))
    assert "own.csv" in said
    assert words in said
    assert "\n" not in said
