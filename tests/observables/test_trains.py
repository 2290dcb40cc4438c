"""All pulses of contacts and gauges, judged by an independent solver."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.errors import HertzchainError, SceneError
from tests.command_line import Command
from tests.conftest import STEEL
from tests.observables.test_first_pulse import random_scene
from tests.oracles import judge
from tests.scenes import TABLE


@pytest.mark.parametrize(
    "number",
    [pytest.param(number, marks=[] if number == 4 else pytest.mark.slow) for number in range(300)],
)
def test_random_scenes(number: int) -> None:
    """No pulse is off by more than what is stated, and none is missed."""
    try:
        shares = dict(judge.of_trains(hc.Native(rtol=1e-6).run(random_scene(number))))
    except HertzchainError:
        return  # a refusal is honest
    assert {name: part for name, part in shares.items() if not part <= 1} == {}


STEEL_PAIR = hc.Scene(
    hc.Chain(2, **STEEL), hc.Striker(1.0),
    contact=hc.Contact("viscoelastic", relaxation_time=2e-6, attraction=True),
)  # fmt: skip
HELD = hc.PulseTable((0.0, 2e-3, 4e-3, 6e-3), (0.0, 10.0, 10.0, 0.0))


@pytest.mark.parametrize(
    ("scene", "contact", "expected"),
    [
        pytest.param(STEEL_PAIR, 2, 1, id="pull"),
        pytest.param(hc.Scene(hc.Chain(2, **STEEL), HELD, hc.Run(7e-3), wall=hc.Wall("rigid"),
                              contact=hc.Contact("restitution", restitution=0.5)),
                     2, 1, id="plateau"),
        pytest.param(hc.Scene(hc.Chain(12, **STEEL), hc.Striker(1.0), hc.Run(3.2e-4),
                              wall=hc.Wall("rigid")), 6, 2, id="reflected"),
        pytest.param(hc.Scene(hc.Chain(12, velocity=[1.0, *[0.0] * 10, -1.0], **STEEL), hc.Moving(),
                              hc.Run(1.8e-4)), 5, 2, id="crossing"),
        *(pytest.param(TABLE["piston, damped"][name], 2, 1, id=name)
          for name in ("stops before a strong damper", "a stroke shorter than a step")),
    ],
)  # fmt: skip
def test_what_is_a_pulse(scene: hc.Scene, contact: int, expected: int) -> None:
    """A plateau is one pulse, a pull none; waves that are apart are two, at their own times."""
    result = hc.Native().run(scene)
    train = result.pulses(contact=contact)
    strong = train[train["force_N"] > 0.5 * train["force_N"].max()]
    assert len(strong) == expected
    assert (strong["width_s"] < np.append(strong["time_s"].diff()[1:], np.inf)).all()
    peak = result.peak_at(contact) - scene.granules.static_force[scene.contacts.index(contact)]
    assert strong["force_N"].max() == pytest.approx(peak, rel=1e-6)


@pytest.mark.parametrize("granules", [12, 13])
def test_waves_that_cross_are_reflected_alike(granules: int) -> None:
    """By symmetry equal waves meet in the middle contact as at a rigid wall, a fixed granule."""
    ends, half = [1.0, *[0.0] * (granules - 2), -1.0], (granules + 1) // 2
    whole = hc.Scene(hc.Chain(granules, velocity=ends, **STEEL), hc.Moving(), hc.Run(1.8e-4))
    held = hc.Scene(hc.Chain(half, **STEEL), hc.Striker(1.0), whole.run, wall=hc.Wall("rigid"))
    if granules % 2:
        chain = hc.Chain(half, fixed=[False] * (half - 1) + [True], **STEEL)
        held = hc.Scene(chain, hc.Striker(1.0), whole.run)
    result, expected = hc.Native().run(whole), hc.Native().run(held)
    for contact in expected.contact.tolist():
        measured, true = result.pulses(contact=contact), expected.pulses(contact=contact)
        assert len(measured) == len(true) > 0
        for name, error, scale in (
            ("time_s", "time_error_s", 1.0), ("force_N", "force_error", true["force_N"]),
            ("arrival_time_s", "arrival_error_s", 1.0), ("width_s", "width_error_s", 1.0),
        ):  # fmt: skip
            off = (measured[name] - true[name]).abs() / scale
            assert not (off > measured[error] + true[error]).any()


def test_command_json_and_judge(hertzchain: Command, tmp_path: Path) -> None:
    """The list is written, read again and judged; weak pulses may be missing, wrong ones fail."""
    scene, pulses = tmp_path / "wall.toml", tmp_path / "pulses.csv"
    hc.Scene(
        hc.Chain(6, **STEEL), hc.Striker(1.0), hc.Run(2.5e-4), wall=hc.Wall("rigid"),
        gauges=(hc.Gauge(granule=4),),
    ).to_toml(scene)  # fmt: skip
    done = hertzchain("run", scene, "--pulses", "--json", "-o", pulses)
    trains = done.json()["pulses"]
    assert [next(iter(train.items())) for train in trains] == [
        *(("contact", k) for k in range(2, 8)), ("granule", 4)
    ]  # fmt: skip
    table = pd.read_csv(pulses)
    assert table["force_N"].tolist() == [p["force_N"] for t in trains for p in t["pulses"]]
    assert "All pulses" in hertzchain("run", scene, "--pulses").out
    strong = table[(table["contact"] == 4) & (table["force_N"] > 0.3 * table["force_N"].max())]
    assert len(strong) == 2 < np.count_nonzero(table["contact"] == 4)
    strong.to_csv(pulses, index=False)
    assert hertzchain("judge", scene, pulses).status == 0
    strong.assign(force_N=strong["force_N"] * [1.0, 1.01]).to_csv(pulses, index=False)
    done = hertzchain("judge", scene, pulses, "--json")
    assert done.status == 1
    failed = [check["name"] for check in done.json()["checks"] if not check["passed"]]
    assert failed == ["contact 4: force of pulse 2 [N]"]
    table[table["contact"] == 4].tail(1).to_csv(pulses, index=False)
    done = hertzchain("judge", scene, pulses)
    assert done.status == 1
    assert "it was not measured, though a weaker one was" in " ".join(done.out.split())
    for wrong, words in (
        ({"time_s": strong["time_s"].to_numpy()[::-1]}, "must increase from pulse to pulse"),
        ({"width_s": ["", "wide"]}, "width_s in row 2"),
        ({"granule": 4}, "row 1"),
        ({"contact": [4, 9]}, "contact in row 2 = 9.0: must be a contact from 2 to 7"),
        ({"time_us": 1.0}, "column = 'time_us'"),
    ):
        strong.assign(**wrong).to_csv(pulses, index=False)
        done = hertzchain("judge", scene, pulses)
        assert (done.status, done.out) == (2, "")
        assert words in done.err
    result = hc.Native().run(scene)
    assert hc.judge_trains(scene, result.pulses(granule=4))
    with pytest.raises(SceneError, match="gauge"):
        result.pulses(granule=3)
