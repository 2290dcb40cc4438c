"""Keys that follow from others by a formula."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.sweeps import sweep
from hertzchain.sweeps.ties import Tie, ties_of
from tests.command_line import Command
from tests.conftest import STEEL

SCENE = hc.Scene(hc.Chain(20, **STEEL), hc.Striker(0.5))
LENGTH = {"chain.granules": "0.2 / (2 * chain.radius)"}


def test_a_fixed_length() -> None:
    """As plain runs; radii of 5 and 10 mm make 20 and 10 granules."""
    table = sweep(SCENE, {"chain.radius": "5 mm, 10 mm"}, ties=LENGTH).to_frame()
    assert table["chain.granules"].tolist() == [20, 10]
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


def test_a_value_that_is_impossible_by_itself_is_a_row_too() -> None:
    ties = {"chain.density": "4e6 * (chain.radius - 0.005)"}
    table = sweep(SCENE, {"chain.radius": "4 mm, 5 mm, 7 mm"}, ties=ties).to_frame()
    assert table["failure"].isna().tolist() == [False, False, True]


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
        ({"chain.radius": "(1.5).hex()"}, "must be + - * / **"),
        ({"chain.radius": "[1][0]"}, "must be + - * / **"),
        ({"chain.radius": "1 if 1 else 2"}, "must be + - * / **"),
        ({"chain.radius": "1 +"}, "must be + - * / **"),
        ({"chain.radius": "sqrt2*1e-3"}, "must be + - * / **"),
        ({"chain.radius": "_()"}, "must be + - * / **"),
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


def test_the_command(tmp_path: Path, hertzchain: Command) -> None:
    SCENE.to_toml(tmp_path / "scene.toml")
    vary = (
        "--vary",
        "chain.radius=5 mm:10 mm:2",
        "--tie",
        f"chain.granules={LENGTH['chain.granules']}",
    )
    out = ("-o", tmp_path / "out")
    done = hertzchain("sweep", tmp_path / "scene.toml", *vary, *out)
    assert done.status == 0, done.err
    found = hc.Sweep.load(tmp_path / "out")
    assert found.to_frame()["chain.granules"].tolist() == [20, 10]
    assert found.manifest["ties"] == LENGTH
    other = hertzchain("sweep", tmp_path / "scene.toml", *vary[:3], "chain.granules=7", *out)
    assert other.status == 2
    refused = hertzchain("sweep", tmp_path / "scene.toml", *vary[:3], "chain.granules", *out)
    assert "--tie chain.granules: must be NAME=VALUE" in refused.err


def test_a_formula_has_full_names(segmented: hc.Scene) -> None:
    with pytest.raises(SceneError, match=r"stands in a formula by its full name, chain\.segments"):
        ties_of(segmented, {"chain.segments.1.radius": "2 * segments.2.radius"}, [])
