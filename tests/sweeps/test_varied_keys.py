"""Keys that cannot vary, and keys that follow from others by a formula."""

from __future__ import annotations

import pickle
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.sweeps import sweep
from hertzchain.sweeps.design import design
from hertzchain.sweeps.ties import Tie, ties_of
from tests.command_line import Command
from tests.conftest import STEEL
from tests.sweeps.made import CHAIN_SECTION, SHOCK
from tests.sweeps.test_sweeps_of_files import LOADED, PISTON, PLAIN, SINE, STRIKER, TABLE, chain_of

REFUSED: list[tuple[hc.Scene, dict[str, Any], str]] = [
    (PLAIN, {"striker.velocity": "1,2"}, "the scene has no [striker]; add the section to its file"),
    (PLAIN, {"wall.kind": "rigid,same"}, "wall.kind: cannot vary: the scene has no [wall]; add"),
    (PLAIN, {"velocity": "1,2"}, "velocity: cannot vary; what can vary: chain.granules, chain.rad"),
    (STRIKER, {"shock.colour": "1,2"}, "cannot vary: the scene has no [shock]; add the section"),
    (STRIKER, {"radius": "1,2"}, "is in several sections: name one of chain.radius, striker.rad"),
    (STRIKER, {"striker.velocty": "1,2"}, "cannot vary; did you mean striker.velocity? What can"),
    (STRIKER, {"wall.kind": "rigid,soft"}, "wall.kind = 'soft': must be one of rigid, same, elas"),
    (STRIKER, {"wall.kind": [1, 2]}, "wall.kind = 1: must be the name of a wall"),
    (
        replace(STRIKER, wall=hc.Wall("elastic", 1e9, 0.3)),
        {"wall.kind": "elastic,rigid", "wall.young_modulus": "1e9,2e9"},
        'only a wall of kind "elastic" has it, in all scenes',
    ),
    (STRIKER, {"wall.young_modulus": "1,2"}, 'cannot vary: only a wall of kind "elastic" has it'),
    (STRIKER, {"striker.velocity": "0,1"}, "striker.velocity = 0.0: must be a finite number above"),
    (SINE, {"duration_ratio": "2,3"}, "duration_ratio: cannot vary; "),
    (TABLE, {"shock.velocity": "2,3"}, "shock.velocity: cannot vary; what can"),
    (PISTON, {"velocity": "0,1"}, "shock.velocity = 0"),
    (SINE, {"cycles": "0,1"}, "shock.cycles = 0: must be an integer"),
    (SINE, {"amplitude": "11,12"}, "shock.amplitude = 11.0: must be at most the static load"),
    (LOADED, {"chain.gap": [1e-6, 2e-6]}, "chain.gap: must be 0 with [precompression]"),
    (PLAIN, {"peek_force": "1,2"}, "cannot vary; did you mean peak_force?"),
    (replace(PLAIN, chain=chain_of()), {"chain.radius": "1,2"}, "chain.radius: cannot vary; "),
]


@pytest.mark.parametrize(("scene", "vary", "words"), REFUSED, ids=[one[2] for one in REFUSED])
def test_what_cannot_vary_is_refused_in_a_sentence(
    scene: hc.Scene, vary: dict[str, Any], words: str
) -> None:
    with pytest.raises(SceneError) as problem:
        design(scene, vary)
    assert words in str(problem.value)
    assert "\n" not in str(problem.value)


OF_SEGMENTS = {
    "granules": "granules: cannot vary: segments, a file or lists say how many",
    "chain.segments.3.radius": "cannot vary; did you mean chain.segments.",
    "chain.segments.0.radius": "cannot vary; did you mean chain.segments.",
    "chain.segments.1.radius_ratio": "did you mean chain.segments.2.radius_ratio?",
    "chain.segments.1.cell.3.density": "cannot vary; did you mean chain.segments.",
    "segments.2.cell.1.density": "cannot vary; did you mean chain.segments.",
    "chain.segments.1": "chain.segments.1: cannot vary; ",
    "chain.colour": "chain.gap, keys of segments, such as chain.segments.2.radius_ratio",
    "chain.segments.2.radius": "chain.segments.2.radius = 0.0: must be a finite number above 0",
    "chain.segments.2.radius_ratio": "chain.segments.2.radius_ratio = 0.0: must be a finite number",
    "chain.segments.2.granules": "chain.segments.2.granules = 0: must be an integer from 1",
}


@pytest.mark.parametrize("name", OF_SEGMENTS)
def test_what_segments_do_not_have_is_refused(segmented: hc.Scene, name: str) -> None:
    with pytest.raises(SceneError) as problem:
        design(segmented, {name: [0, 2]})
    assert OF_SEGMENTS[name] in str(problem.value)


OF_ROWS: list[tuple[hc.Scene, dict[str, Any], str]] = [
    (STRIKER, {"wall.kind": "elastic,rigid"}, "wall.young_modulus: missing, a wall of kind"),
    (LOADED, {"precompression.force": [0.0, 1.0]}, "precompression.force and gravity: both are 0"),
    (SINE, {"amplitude": "11,5"}, "shock.amplitude = 11.0: must be at most the static load"),
    (LOADED, {"gravity": [1.0, 0.0]}, "precompression.gravity = 1.0: needs a [wall]"),
    (LOADED, {"chain.gap": [1e-6, 0.0]}, "chain.gap: must be 0 with [precompression]"),
]


@pytest.mark.parametrize(("scene", "vary", "words"), OF_ROWS, ids=[one[2] for one in OF_ROWS])
def test_what_only_the_rest_of_a_scene_excludes_is_the_reason_in_its_row(
    scene: hc.Scene, vary: dict[str, Any], words: str
) -> None:
    bad, good = hc.sweep(scene, vary, rtol=1e-4).to_frame()["failure"].tolist()
    assert words in bad
    assert pd.isna(good)


def test_a_ratio_whose_radii_leave_floating_point_is_the_reason_in_a_row(tmp_path: Path) -> None:
    taper = "[[chain.segments]]\ngranules = 6\n"
    (tmp_path / "taper.toml").write_text(CHAIN_SECTION + taper + SHOCK)
    table = hc.sweep(tmp_path / "taper.toml", {"chain.segments.1.radius_ratio": [1e-300, 1.0]})
    assert "chain.radius of granule 3 = 0.0: must be" in table.to_frame()["failure"][0]


def test_a_chain_with_other_values_has_no_segments(segmented: hc.Scene) -> None:
    """The segments of the file would not describe it."""
    assert segmented.chain.section is not None
    assert pickle.loads(pickle.dumps(segmented)).chain.section == segmented.chain.section  # noqa: S301
    assert replace(segmented, shock=hc.Striker(1.0)).chain.section is not None
    other = replace(segmented.chain, density=1000.0)
    assert other.section is None
    with pytest.raises(SceneError, match=r"chain\.radius: cannot vary"):
        design(replace(segmented, chain=other), {"chain.radius": [1.0, 2.0]})


# Ties


SCENE = hc.Scene(hc.Chain(20, **STEEL), hc.Striker(0.5))
GRANULES = "chain.granules"
LENGTH = {GRANULES: "0.2 / (2 * chain.radius)"}


def test_a_fixed_length(tmp_path: Path, hertzchain: Command) -> None:
    """By the command, as plain runs; radii of 5 and 10 mm make 20 and 10 granules."""
    SCENE.to_toml(tmp_path / "scene.toml")
    tied = ("--vary", "chain.radius=5 mm:10 mm:2", "--tie", f"chain.granules={LENGTH[GRANULES]}")
    done = hertzchain("sweep", tmp_path / "scene.toml", *tied, "-o", tmp_path / "out")
    assert done.status == 0, done.err
    found = hc.Sweep.load(tmp_path / "out")
    assert found.manifest["ties"] == LENGTH
    table = found.to_frame()
    assert table[GRANULES].tolist() == [20, 10]
    for radius, granules, peak in zip(
        (5e-3, 10e-3), (20, 10), table["largest_peak_force_N"], strict=True
    ):
        chain = hc.Chain(granules, **{**STEEL, "radius": radius})
        plain = hc.Native().run(hc.Scene(chain, hc.Striker(0.5)))
        assert peak == pytest.approx(plain.peak_force.max(), rel=2e-5)


def test_a_tie_over_a_tie_and_a_value_that_no_scene_has() -> None:
    """A row says why a tied density is impossible; the others are measured."""
    ties = {
        "chain.gap": "chain.radius / 1000",
        "chain.density": "8000 * (1.4 - 50000 * chain.gap - striker.velocity)",
    }
    vary = {"chain.radius": "5 mm, 10 mm", "striker.velocity": "0.5, 1"}
    table = sweep(SCENE, vary, ties=ties).to_frame()
    assert table["chain.density"].tolist() == pytest.approx([5200, 1200, 3200, -800])
    assert table["failure"].isna().tolist() == [True, True, True, False]
    assert "density" in table["failure"][3]


def test_a_division_by_zero_in_a_tie_is_said_in_its_row() -> None:
    formula = "1 / (striker.velocity - 0.5)"
    table = sweep(SCENE, {"velocity": "0.5, 0.75"}, ties={"chain.granules": formula}).to_frame()
    assert table["failure"].isna().tolist() == [False, True]
    said = re.escape(f"; it is tied by {formula}, striker.velocity = 0.5")
    assert re.fullmatch(f"chain.granules = inf: must be an integer .*{said}", table["failure"][0])


def test_arithmetic() -> None:
    tie = Tie("chain.radius", "-chain.gap**2 + sqrt(chain.density) / 2 * pi - 1e0")
    values = {"chain.gap": np.array([1.0, 3.0]), "chain.density": 16.0}
    assert tie.value(values) == pytest.approx([2 * np.pi - 2, 2 * np.pi - 10])


@pytest.mark.parametrize(
    ("ties", "words"),
    [
        ({"chain.radius": "__import__('os').getpid()"}, "must be + - * / **"),
        ({"chain.radius": "chain.gap.__class__"}, "cannot vary"),
        ({"chain.radius": "sqrt.real"}, "cannot vary"),
        ({"chain.radius": "1 +"}, "must be + - * / **"),
        ({"chain.radius": "sqrt2*1e-3"}, "must be + - * / **"),
        ({"chain.radius": "(" * 900}, "must be + - * / **"),
        ({"chain.radius": "-" * 200_000 + "1"}, "must be + - * / **"),
        ({"chain.radius": "2 * chain.radius"}, "tied to itself"),
        ({"chain.gap": "striker.velocity", "striker.velocity": "1.0"}, "stands below it"),
        ({"chain.young_modulus": "1e9"}, "both free and tied"),
        ({"chain.raduis": "1"}, "did you mean"),
        ({"chain.gap": "1.0", "gap": "2.0"}, "tied twice"),
    ],
)
def test_what_is_no_tie(ties: dict[str, str], words: str) -> None:
    with pytest.raises(SceneError) as caught:
        ties_of(SCENE, ties, ["chain.young_modulus"])
    assert words in str(caught.value)


def test_two_measures_of_one_pulse_are_not_both_given() -> None:
    both = {"shock.momentum_ratio": "3.0"}
    with pytest.raises(SceneError, match="replace each other"):
        ties_of(
            hc.Scene(SCENE.chain, hc.Pulse("cosine", 10.0, 3.0, rise_time=3e-5)),
            both,
            ["shock.rise_time"],
        )


def test_a_scene_without_memory_is_a_row_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(*_: object) -> hc.Result:
        raise MemoryError

    monkeypatch.setattr(hc.Native, "run", run)
    rows = hc.sweep(STRIKER, {"striker.velocity": "0.5,1"}).to_frame()
    assert rows["failure"].tolist() == ["there is not enough memory for this scene"] * 2


def test_a_formula_has_full_names(segmented: hc.Scene) -> None:
    with pytest.raises(SceneError, match=r"stands in a formula by its full name, chain\.segments"):
        ties_of(segmented, {"chain.segments.1.radius": "2 * segments.2.radius"}, [])
