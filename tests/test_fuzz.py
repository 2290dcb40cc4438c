"""Readers under nonsense: a scene, or one printable line that names the file, within a second."""

from __future__ import annotations

import os
import random
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.scene.file import read_table
from tests.effort import effort
from tests.places import ROOT

DEMO = (ROOT / "validation" / "scenes" / "demo.toml").read_text(encoding="utf-8")
SCENE = DEMO + '\n[run]\nend_time = "1.2 ms"\n'
TABLE_SCENE = SCENE.partition("[shock]")[0] + '[shock]\nprofile = "table"\nfile = "pulse.csv"\n'
TABLE = "time_s,force_N\n0,0\n1e-5,100\n2e-5,40.5\n3e-5,0\n"

LONGEST = 1000
"""Characters of a message, without the name of the file."""
SLOWEST = 30.0
"""Effort for a file: a thousand times what one of a few kilobytes takes."""

NUMBERS = [
    "0", "-0.0", "-1", "2", "60", "1e3", "1e308", "5e-324", "1e999", "-inf", "nan", "0x10", "1_000",
    "9223372036854775808", "4.75", "1" * 400, "0x" + "f" * 5000, "1979-05-27", "true", "1.", "+",
]  # fmt: skip
UNITS = [
    "mm", "GPa", "kg/m^3", "g/cm**3", "µs", "degC", "delta_degC", "%", "dBm", "m m m**99", "m^99",
    "m**-99 * m**99", "m**99**99", "m/m", "N / m^2", "m**0.5", "Å", "furlong", "hbar", "ymol", "",
    "lambda: 0", "__class__", "m\\u0000", "\\u202e", "m" * 70, "m " * 30, "Ym^99", "ym^99 * Ym^99",
]  # fmt: skip
WORDS = [
    "", "cosine", "triangular", "table", "pulse.csv", ".", "/", "missing.csv", "pulse.csv/x",
    "a\\u0000b", "a\\nb", "\\U0001F600", "é", "x" * 5000, "%s%n{0}", "~", "nested.toml",
]  # fmt: skip
KEYS = [
    "granules", "radius", "poisson_ratio", "profile", "peak_force", "momentum_ratio", "rise_time",
    "end_time", "file", "chain", "shock", "run", '""', '"a\\nb"', '"\\u202e"', "k" * 3000,
    ".".join("a" * 150), "é",
]  # fmt: skip
SCRAPS = [
    b"\x00", b"\xff", b"\xef\xbb\xbf", b"\r\n", b"\r", b"\n", b"[", b"]", b"{", b"=", b".", b",",
    b"#", b"\\", b'"""', b"[[chain]]", b"\xe2\x80\xae", b"\xc2\x85", b"nan", b"1e999", b"\x1b[31m",
    b"[" * 500, b"{a=" * 500, b"a." * 150,
]  # fmt: skip


def mutated(rng: random.Random, valid: str) -> bytes:
    """A valid file with a few pieces changed, lost, doubled or put in; half of them numbers."""
    content = bytearray(valid.encode())
    for _ in range(rng.choice([1, 1, 1, 2, 3, 8])):
        if rng.random() < 0.5:
            at = rng.choice([k for k, byte in enumerate(content) if chr(byte).isdigit()] or [0])
            content[at : at + 1] = rng.choice(NUMBERS).encode()
            continue
        at = rng.randrange(len(content) + 1)
        upto = min(len(content), at + rng.choice([0, 1, 1, 2, 5, 30]))
        doubled = bytes(content[at:upto]) * rng.choice([2, 50])
        other = [b"", doubled, bytes([rng.randrange(256)]), rng.choice(UNITS).encode()]
        content[at:upto] = rng.choice([*other, rng.choice(SCRAPS)])
    return bytes(content)


def a_value(rng: random.Random, depth: int = 0) -> str:
    """A TOML value of any type, most of them strings with odd units."""
    inside = [a_value(rng, depth + 1) for _ in range(rng.randrange(3))] if depth < 3 else []
    pairs = [f"{rng.choice(KEYS)} = {value}" for value in inside]
    values = [
        rng.choice(NUMBERS),
        f'"{rng.choice(NUMBERS)}{rng.choice([" ", "", "  "])}{rng.choice(UNITS)}"',
        f'"{rng.choice(WORDS)}"',
        f"[{', '.join(inside)}]",
        f"{{{', '.join(pairs)}}}",
        "[" * 400 + "]" * 400,
    ]
    return rng.choices(values, [30, 30, 20, 9, 9, 2])[0]


def written_scene(rng: random.Random, valid: str) -> bytes:
    """A scene file whose grammar is mostly right, with odd keys and values in it."""
    lines = valid.splitlines()
    for _ in range(rng.choice([1, 1, 2, 4])):
        at = rng.randrange(len(lines))
        if "=" in lines[at] and rng.random() < 0.7:
            lines[at] = f"{lines[at].partition('=')[0]}= {a_value(rng)}"
        else:
            header = rng.choice(["[{}]", "[[{}]]", "[chain.{}]"]).format(rng.choice(KEYS))
            line = f"{rng.choice(KEYS)} = {a_value(rng)}"
            lines.insert(at, rng.choice([header, line, line]))
    return "\n".join(lines).encode()


def outcome(read: Callable[[], object]) -> str:
    """Return "" for a scene that was read, otherwise the error message; anything else fails."""
    refusals: list[SceneError] = []

    def tried() -> None:
        try:
            read()
        except SceneError as problem:
            refusals.append(problem)

    took = effort(tried)
    assert took < SLOWEST, f"{took:.2g}: {refusals}"
    if not refusals:
        return ""
    said, file = str(refusals[0]), str(refusals[0].file)
    assert said.isprintable(), said  # so that it is one line
    assert said.startswith((file, repr(file)[1:-1])), said
    assert len(said) - len(file) < LONGEST, said
    return said


def fuzz(folder: Path, count: int, seed: int) -> tuple[int, int]:
    """Read so many files; returns how many were taken for scenes or tables, and how many not."""
    (folder / "pulse.csv").write_text(TABLE)
    taken = 0
    for k in range(count):
        valid = (SCENE, TABLE_SCENE, SCENE, TABLE)[k % 4]
        change = mutated if valid is TABLE or k // 4 % 2 else written_scene
        content = change(random.Random(seed + k), valid)  # noqa: S311 - nothing secret
        path = _written(folder / "fuzzed", content)
        try:
            taken += not outcome(partial(read_table_of if valid is TABLE else there_and_back, path))
        except BaseException as problem:
            problem.add_note(f"{change.__name__}, seed {seed + k}: {content[:300]!r}")
            raise
    return taken, count - taken


def read_table_of(path: Path) -> hc.PulseTable:
    return read_table(hc.PulseTable, path)


def there_and_back(path: Path) -> None:
    """Read a scene; one that can be read is written and read to be the same."""
    scene = hc.Scene.from_toml(path)
    copy = path.with_name("again.toml")
    scene.to_toml(copy)
    assert hc.Scene.from_toml(copy) == scene


def _written(path: Path, content: bytes) -> Path:
    path.unlink(missing_ok=True)  # some file systems are slow to empty a file
    path.write_bytes(content)
    return path


@pytest.fixture(autouse=True)
def _units_loaded(tmp_path: Path) -> None:
    """Pint loads before the clock runs: it takes half a second, once."""
    path = _written(tmp_path / "units.toml", SCENE.replace("4.75 mm", "1e-4 furlong").encode())
    hc.Scene.from_toml(path)


def test_nonsense_is_refused_in_a_sentence(tmp_path: Path) -> None:
    taken, refused = fuzz(tmp_path, 1_200, seed=1)
    assert taken > 60  # mutations that matter to nothing, such as in a comment
    assert refused > 600


@pytest.mark.slow
def test_much_nonsense_is_refused_in_a_sentence(tmp_path: Path) -> None:
    taken, refused = fuzz(tmp_path, 100_000, seed=1_000_000)
    assert taken > 5_000
    assert refused > 50_000


# Texts that made a reader fail, and paths that are not files


@pytest.mark.parametrize(
    "text",
    [
        ".".join("a" * 190) + " = 1",  # deep enough for repr to fail, further down the stack
        f"[{'.'.join('a' * 190)}]\n{'.'.join('b' * 190)} = {'{a = ' * 150}1{'}' * 150}",
        f"[{'k' * 10_000}]\n[{'k' * 10_000}]",
    ],
    ids=["dots", "nested", "long section"],
)
def test_deep_and_long_scenes_are_refused(tmp_path: Path, text: str) -> None:
    path = _written(tmp_path / "scene.toml", text.encode())
    assert outcome(lambda: hc.Scene.from_toml(path))


@pytest.mark.parametrize("name", ["two\nlines.toml", "\x1b[31mred.toml", "not\udcffutf8.toml"])
def test_names_of_files_are_shown_on_one_line(tmp_path: Path, name: str) -> None:
    for text in ("", "a = 1", SCENE.replace("60", "0"), TABLE_SCENE):
        path = _written(tmp_path / name, text.encode())
        assert repr(str(path))[1:-1] in outcome(partial(hc.Scene.from_toml, path))


posix = pytest.mark.skipif(os.name != "posix", reason="has other pipes and devices")


@posix
@pytest.mark.parametrize("read", [hc.Scene.from_toml, read_table_of])
def test_an_endless_file_is_refused(read: Callable[[Path], object]) -> None:
    assert "cannot be read (larger than" in outcome(lambda: read(Path("/dev/zero")))


@posix
def test_a_scene_may_come_through_a_pipe(tmp_path: Path, demo: hc.Scene) -> None:
    """As from ``hertzchain run <(sed ... demo.toml)``, later than the reader looks for it."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    late = threading.Timer(0.2, pipe.write_text, [DEMO])
    late.start()
    read = hc.Scene.from_toml(pipe)
    late.join()
    assert read.shock == demo.shock
