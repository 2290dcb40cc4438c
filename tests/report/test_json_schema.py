"""JSON documents stand alone, and are what docs/schema says of them."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
import pytest
import tomli_w

import hertzchain as hc
from hertzchain import theory
from hertzchain.known.certificate import CASES, ROUND_OFF, UNTESTED, Certificate, Row
from hertzchain.observables.result import DEFINITIONS, LostDigits
from hertzchain.pulses.pulse import measured_pulse, pulse_of
from hertzchain.pulses.recording import read_recording
from hertzchain.pulses.spectrum import spectrum_of, times_of
from hertzchain.scene.file import sections_of
from hertzchain.verdict.tradeoff import tradeoff
from tests.conftest import STEEL, paper_scene
from tests.examiner.corpus import scene_of
from tests.examiner.made import changed, examined, found
from tests.oracles import scene_schema
from tests.oracles.json_schema import FOLDER, problems, read
from tests.places import ROOT
from tests.recordings import GAIN, write_scope

SHORT = paper_scene("cosine", 1.0, 2.0, granules=8)

CERTIFICATE = Certificate(
    "lmp", "20250722", None, 2,
    (Row(CASES["gravity"], UNTESTED, reason="its suffix fell back"),
     Row(CASES["elastic wall"], ROUND_OFF, 1e-12, 1e-9, styles=("granular",))), 2.5,
)  # fmt: skip

UNCERTAIN = replace(SHORT, uncertain=(hc.Uncertain("shock.peak_force", 0.1, relative=True),))

UNLIKE = replace(
    SHORT,
    chain=hc.Chain(3, [1e-3, 2e-3, 1e-3], 193e9, 0.3, 7958.0, gap=[0.0, 1e-6, 0.0]),
    shock=hc.PulseTable((0.0, 1e-5, 4e-5), (0.0, 10.0, 0.0)),
    wall=hc.Wall("elastic", 70e9, 0.3),
)

HELD = replace(
    SHORT,
    shock=hc.Striker(1.0, radius=5e-3),
    wall=hc.Wall("rigid"),
    precompression=hc.Precompression(force=5.0, gravity=9.81),
    contact=hc.Contact("restitution", restitution=0.9),
    run=hc.Run(2e-4),
)

SHIPPED = sorted(
    path
    for path in [*(ROOT / "validation" / "scenes").rglob("*.toml"),
                 *(p for p in (ROOT / "tests" / "decks" / "user").glob("*.toml")
                   if p.name not in ("mistakes.toml", "right.toml"))]
    if path.stem != "long_chain"  # a million granules
)  # fmt: skip


def through_json(document: dict[str, Any]) -> dict[str, Any]:
    read: dict[str, Any] = json.loads(json.dumps(document, allow_nan=False))
    return read


def comparison() -> dict[str, Any]:
    """Native, and what is taken for LAMMPS, which lost digits."""
    native = hc.compare(SHORT, ["native"])
    lost = LostDigits(1e9, 1e-6, 1e-9)
    other = replace(native.native, backend="lammps", lost_digits=lost)
    return replace(native, results={**native.results, "lammps": other}).to_dict()


def examination() -> dict[str, Any]:
    """A deck whose granules are too heavy."""
    scene = scene_of("steel")
    right = found(scene)
    return examined(scene, changed(right, mass=1.1 * right.mass)).to_dict()


def judged(factor: float, **how: Any) -> dict[str, Any]:
    return hc.judge(SHORT, factor * hc.Native().run(SHORT).peak_force, **how).to_dict()


def trains() -> pd.DataFrame:
    return pd.DataFrame({"contact": [3, 3], "force_N": [10.0, 1.0], "time_s": [2e-5, 9e-5]})


def traces() -> pd.DataFrame:
    return hc.Native().run(replace(SHORT, gauges=(hc.Gauge(granule=4),)), 500).to_traces()


def manifest(**how: Any) -> dict[str, Any]:
    return dict(hc.sweep(SHORT, **how).manifest)


def predicted(**changes: Any) -> dict[str, Any]:
    return theory.predict(replace(SHORT, **changes)).to_dict()


def recorded(noise: float = 0.01, **given: Any) -> dict[str, Any]:
    with TemporaryDirectory() as folder:
        path = write_scope(Path(folder) / "scope.csv", 1000, noise)
        recording = read_recording(path, scale=GAIN)
    return measured_pulse(recording, pulse_of(recording, **given)).to_dict()


def spectrum() -> dict[str, Any]:
    pressed = replace(SHORT, precompression=hc.Precompression(20.0))
    return spectrum_of(hc.Native().run(pressed, times_of(pressed)), hc.Gauge(granule=4)).to_dict()


TABLE = hc.PulseTable((0.0, 2e-5, 4e-5), (0.0, 100.0, 0.0))

PAST_THE_PAPER = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=0.2)
"""Inside the map, and outside of the paper's range."""


DOCUMENTS: dict[str, tuple[str, Callable[[], dict[str, Any]]]] = {
    "run": ("run.json", lambda: hc.Native().run(SHORT).to_dict()),
    "run, unlike": ("run.json", lambda: hc.Native().run(UNLIKE).to_dict()),
    "run, held": ("run.json", lambda: hc.Native().run(HELD).to_dict()),
    "run, pulses": ("run.json", lambda: hc.Native().run(SHORT).to_dict(pulses=True)),
    "compare": ("compare.json", comparison),
    "judge, pass": ("judge.json", lambda: judged(1.0)),
    "judge, fail": ("judge.json", lambda: judged(1.0 + 3e-3)),
    "judge, step": ("judge.json", lambda: judged(1.0, dt=1e-8)),
    "judge, traces": ("traces.json", lambda: hc.judge_traces(SHORT, traces()).to_dict()),
    "judge, trains": ("trains.json", lambda: hc.judge_trains(SHORT, trains()).to_dict()),
    "fit": ("fit.json", lambda: hc.fit(SHORT, traces(), ["shock.peak_force"]).to_dict()),
    "fit, peaks": (
        "fit.json",
        lambda: hc.fit(SHORT, dict.fromkeys(range(2, 9), 10.0), ["shock.peak_force"]).to_dict(),
    ),
    "fit, instrument": (
        "fit.json",
        lambda: hc.fit(SHORT, traces(), ["shock.peak_force", "gauge_4.offset"]).to_dict(),
    ),
    "spectrum": ("spectrum.json", spectrum),
    "spread": ("uncertainty.json", lambda: hc.spread(UNCERTAIN, 16).to_dict()),
    "validate": (
        "validation.json",
        lambda: hc.validate(UNCERTAIN, traces(), realisations=16).to_dict(),
    ),
    "certify": (
        "certify.json",
        lambda: {"hertzchain": "0", "status": 0, "certificates": [CERTIFICATE.to_dict()]},
    ),
    "examine": ("examine.json", examination),
    "sweep": ("sweep.json", lambda: manifest(vary={"shock.profile": ["cosine", "triangular"]})),
    "sweep, table": (
        "sweep.json",
        lambda: manifest(vary=pd.DataFrame({"chain.radius [mm]": [1, None]}), peaks=True),
    ),
    "sweep, drawn": (
        "sweep.json",
        lambda: manifest(vary={"chain.radius": "1 mm:2 mm", "peak_force": "1:9:2"}, samples=2),
    ),
    "predict": ("predict.json", predicted),
    "predict, past the paper": ("predict.json", lambda: predicted(shock=PAST_THE_PAPER)),
    "predict, no transition": ("predict.json", lambda: predicted(chain=hc.Chain(6, **STEEL))),
    "predict, table": ("predict.json", lambda: predicted(shock=TABLE)),
    "predict, held": ("predict.json", lambda: theory.predict(HELD).to_dict()),
    "tradeoff": ("tradeoff.json", lambda: tradeoff(SHORT, ["compiled"], enough=0.0).to_dict()),
    "pulse": ("pulse.json", lambda: recorded(noise=0.0)),
    "pulse, baseline": ("pulse.json", lambda: recorded(baseline=0.0)),
}

STAND_ALONE = {
    *("run.json", "traces.json", "trains.json", "fit.json", "uncertainty.json"),
    *("validation.json", "compare.json", "judge.json", "examine.json", "sweep.json"),
    "spectrum.json",
}
"""Schemas of documents with their scene and the version of all definitions."""


FIRST = {
    "first_peak_force_N", "first_peak_time_s", "arrival_time_s", "first_width_s", "kind",
    "clear", "near_end", "peak_error", "first_peak_error", "arrival_error_s",
    "first_width_error_s", "contact_time_s", "contact_time_error_s", "wave", "gauges", "pulses",
    "restitution",
}  # fmt: skip
"""Keys of runs with first pulses."""


@pytest.fixture(scope="module", params=DOCUMENTS)
def given(request: pytest.FixtureRequest) -> tuple[str, dict[str, Any]]:
    """The name of a schema, and a document that it is about."""
    schema, make = DOCUMENTS[request.param]
    return schema, through_json(make())


def test_a_document_is_what_its_schema_says(given: tuple[str, dict[str, Any]]) -> None:
    schema, document = given
    assert problems(document, schema) == []
    schema, document = given
    if schema not in STAND_ALONE:
        assert not {"contacts", "definitions"} & document.keys()
        return
    assert document["hertzchain"] == version("hertzchain")
    assert document["definitions"] == DEFINITIONS
    if schema != "sweep.json":
        peaks = document.get("reference", document.get("results", {}).get("native", document))
        contacts = document["contacts"]
        last = document["scene"]["chain"]["granules"] + ("wall" in document["scene"])
        assert contacts == list(range(2, last + 1))
        if schema in ("judge.json", "run.json", "compare.json", "examine.json", "traces.json"):
            assert len(peaks["peak_force_N"]) == len(contacts)


def test_what_a_schema_does_not_say_is_seen(given: tuple[str, dict[str, Any]]) -> None:
    """Every key is taken away, or is of another type: all but those that may be left out."""
    schema, document = given
    optional = {"static_force_N", "compile_time_s", *FIRST}
    optional |= {"definitions"} if schema == "sweep.json" else set()
    for name in document.keys() - optional:
        without = {key: value for key, value in document.items() if key != name}
        assert problems(without, schema), name
    for name in document:
        assert problems({**document, name: {"no": "such"}}, schema), name
    assert "'more' was unexpected" in problems({**document, "more": 1}, schema)[0]


def test_each_schema_is_tried_and_says_which_it_is() -> None:
    tried = {schema for schema, _ in DOCUMENTS.values()}
    assert {path.name for path in FOLDER.glob("*.json")} == {*tried, "parts.json"}
    for name in tried:
        assert read(name)["$schema"] == "https://json-schema.org/draft/2020-12/schema"
        assert read(name)["title"]


def scene_from(sections: dict[str, Any], folder: Path) -> hc.Scene:
    """A scene from the ``scene`` of a document: TOML, with tables as files."""
    sections = copy.deepcopy(sections)
    shock, chain = sections.get("shock", {}), sections["chain"]
    if "time_s" in shock:
        column = "force_N" if "force_N" in shock else "displacement_m"
        rows = zip(shock.pop("time_s"), shock.pop(column), strict=True)
        lines = [f"time_s,{column}", *(f"{time!r},{value!r}" for time, value in rows)]
        (folder / "rows.csv").write_text("\n".join(lines))
        shock["file"] = "rows.csv"
    unlike = {key: value for key, value in chain.items() if isinstance(value, list)}
    if unlike and "segments" not in chain:
        each = [dict(zip(unlike, row, strict=True)) for row in zip(*unlike.values(), strict=True)]
        segments = [{"granules": 1, **granule} for granule in each]
        sections["chain"] = {**chain, **each[0], "segments": segments}
    (folder / "scene.toml").write_text(tomli_w.dumps(sections))
    return hc.Scene.from_toml(folder / "scene.toml")


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_scenes_come_back_from_json(path: Path, tmp_path: Path) -> None:
    scene = hc.Scene.from_toml(path)
    sections = through_json(sections_of(scene))
    assert problems(sections, "parts.json", "/$defs/scene") == []
    assert scene_from(sections, tmp_path) == scene


@pytest.mark.parametrize("scene", [UNLIKE, HELD], ids=["unlike", "held"])
def test_a_run_comes_back_from_its_document(scene: hc.Scene, tmp_path: Path) -> None:
    document = through_json(hc.Native().run(scene).to_dict())
    result = hc.Native().run(scene_from(document["scene"], tmp_path))
    np.testing.assert_array_equal(result.peak_force, document["peak_force_N"])


def test_the_schema_of_a_scene_is_that_of_its_keys() -> None:
    parts = json.loads(scene_schema.FILE.read_text(encoding="utf-8"))
    assert scene_schema.updated(copy.deepcopy(parts)) == parts
