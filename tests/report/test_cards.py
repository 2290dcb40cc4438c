"""What objects show of themselves, on few lines, and calls of their progress."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

import hertzchain as hc
from hertzchain import progress
from hertzchain.report.contents import of_examination
from hertzchain.verdict.check import Check, Kind
from tests.command_line import Command
from tests.conftest import paper_scene
from tests.examiner.corpus import scene_of
from tests.examiner.made import changed, examined, found
from tests.recordings import write_scope

MOST_LINES = 15  # of the issue

SCENE = paper_scene("cosine-triangular", 1.0, 2.0, granules=12)

SIZE = (3.4, 2.6)  # inches


@pytest.fixture(scope="module")
def result() -> hc.Result:
    """A run that has recorded 80 frames."""
    return hc.Native().run(SCENE, record=80)


@pytest.fixture(scope="module")
def comparison(both: hc.Comparison) -> hc.Comparison:
    """Native and what is taken for LAMMPS; a check fails."""
    odd = Check(Kind("one thing is odd"), "native", 1.5, 1.0, 0.25, False, "it should be 1")
    return replace(both, checks=(odd,))


@pytest.fixture(scope="module")
def judgement(native: hc.Comparison) -> hc.Judgement:
    """Peaks that are a hundredth too high."""
    return hc.judge(SCENE, native.native.peak_force * 1.01)


@pytest.fixture(scope="module")
def sweep() -> hc.Sweep:
    vary: dict[str, Any] = {
        "shock.momentum_ratio": "0.1:10:20:log",
        "shock.duration_ratio": [2.0, 3.0],
    }
    return hc.sweep(SCENE, vary)


@pytest.fixture(scope="module")
def examination() -> hc.DeckExamination:
    """A deck whose granules are too heavy and whose first is too large."""
    scene = scene_of("steel")
    right = found(scene)
    radius = right.radius.copy()
    radius[0] *= 1.2
    return examined(scene, changed(right, mass=1.1 * right.mass, radius=radius))


def fact(shown: object, label: str) -> str:
    """The value behind a label in the text of an object."""
    (value,) = re.findall(rf"^  {re.escape(label)} {{2,}}(.*)$", repr(shown), re.MULTILINE)
    return str(value)


# Text


def test_a_scene_prints_what_it_is() -> None:
    what = "cosine-triangular pulse, n = 2, LM_ratio = 1, 100 N on 12 granules"
    assert repr(SCENE).startswith(f"Scene: {what}\n")
    assert float(fact(SCENE, "radius").removesuffix(" m")) == SCENE.chain.radius
    assert float(fact(SCENE, "density").removesuffix(" kg/m^3")) == SCENE.chain.density
    end = float(fact(SCENE, "end of the run").removesuffix(" s"))
    assert end == pytest.approx(SCENE.end_time, rel=1e-5)  # six digits
    assert len(repr(SCENE).split("\n")) <= MOST_LINES
    radius = np.linspace(1e-3, 3e-3, 5000)
    scene = replace(SCENE, chain=hc.Chain(5000, radius, 193e9, 0.3, 7958.0), wall=hc.Wall("rigid"))
    assert fact(scene, "radius") == "0.001 to 0.003 m"
    assert fact(scene, "terms") == "unlike granules, wall"
    assert len(repr(scene)) < 1500


def test_a_chain_prints_as_it_is_made() -> None:
    assert eval(repr(SCENE.chain), {"Chain": hc.Chain}) == SCENE.chain  # noqa: S307 - our own


@pytest.mark.parametrize("name", ["comparison", "judgement", "examination"])
def test_a_verdict_is_drawn(name: str, request: pytest.FixtureRequest) -> None:
    shown = request.getfixturevalue(name)
    above, below = shown.plot().axes
    native = shown.native if name == "comparison" else shown.reference
    np.testing.assert_array_equal(above.lines[0].get_ydata(), native.peak_force)
    assert below.get_ylabel() == "relative difference"


def test_a_notebook_shows_a_figure_without_pyplot(result: hc.Result, sweep: hc.Sweep) -> None:
    drawn = sweep.plot("momentum_ratio", "speed_m_s", size=SIZE)
    for figure in (replace(result, history=None).plot(SIZE), drawn):
        assert tuple(figure.get_size_inches()) == SIZE
        pixels = imread(io.BytesIO(figure._repr_png_()))  # type: ignore[attr-defined]
        width, height = (figure.get_size_inches() * figure.dpi).astype(int)
        assert pixels.shape[:2] == (height, width)
        assert pixels.min() < 0.5 < pixels.max()  # something is drawn


# What is to correct in a deck


def test_the_sentence_of_an_examination(examination: hc.DeckExamination) -> None:
    peaks = replace(examination.checks[-1], passed=False, effect=None)
    right = tuple(replace(check, passed=True) for check in examination.checks)
    others = {
        "2 things are to correct in the deck.": examination,
        "One thing is to correct in the deck.": replace(
            examination, checks=(*right[:3], examination.to_correct[0], right[-1]), findings=()
        ),
        f"The deck is the scene: all {len(right)} checks passed.": replace(
            examination, checks=right
        ),
    }
    for sentence, other in others.items():
        off = " Its peaks are off by 7.0e-05 at most, 0.001 is allowed."
        assert of_examination(other).verdict.sentence == sentence + off
    off_only = of_examination(replace(examination, checks=(*right[:-1], peaks), findings=()))
    assert off_only.verdict.sentence == (
        "No number of the deck alone is to blame, but its peaks are off: small differences add up."
        " None of its peaks can be judged."
    )
    assert [failure.name for failure in off_only.verdict.failures] == [peaks.name]


# ``progress=True``: a line on stderr in a terminal, none in a pipe


CALLS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "compare": (
        lambda how: hc.compare(SCENE, ["native"], progress=how),
        "native: Eq. 1 as it is written",
    ),
    "sweep": (
        lambda how: hc.sweep(SCENE, {"duration_ratio": [2.0, 3.0]}, progress=how),
        "sweep: 2 of 2 rows",
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_terminal_shows_a_line_on_stderr(
    name: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # Rich takes stderr for a terminal then
    call, said = CALLS[name]
    call(True)
    out, err = capfd.readouterr()
    # Rich draws ten times a second, so that of quick work only the last line is sure to be seen.
    assert said in err
    assert err.endswith("\x1b[1A\x1b[2K")  # up a line, and erase it
    assert out == ""


@pytest.mark.parametrize("how", [True, False, None])
@pytest.mark.parametrize("name", CALLS)
def test_a_pipe_shows_nothing(
    name: str, how: bool | None, capfd: pytest.CaptureFixture[str]
) -> None:
    CALLS[name][0](how)
    assert capfd.readouterr() == ("", "")


COMMANDS: dict[str, list[str]] = {
    "run scene.toml --plot a.svg": ["native: running", "writing a.svg"],
    "timestep scene.toml": ["trying steps"],
    "deck scene.toml -o in.chain": [
        "native: time step and expected peaks of the deck",
        "writing in.chain",
    ],
    "unit-test scene.toml": ["native: motion of the wave"],
    "pulse scope.csv --scale 25": ["choosing the fewest rows that keep the pulse"],
    "sweep scene.toml --vary duration_ratio=2,3 -o a": ["0 of 2 rows", "2 of 2 rows"],
    "plot a --x duration_ratio --y peak_force": ["drawing a", "writing a/plot.png"],
}


def test_commands_say_what_they_do(
    hertzchain: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines: list[str] = []

    @contextmanager
    def kept() -> Iterator[Callable[[str], None]]:
        yield lines.append

    monkeypatch.setattr(progress, "shown_progress", kept)
    monkeypatch.chdir(tmp_path)
    write_scope(tmp_path / "scope.csv", 1000)
    SCENE.to_toml(tmp_path / "scene.toml")
    for command, said in COMMANDS.items():
        lines.clear()
        done = hertzchain(*command.split())
        assert done.status == 0, done.err
        assert [line for line in lines if not line.startswith("compiling")] == said, command
