"""How hard each contact of a shocked chain of spheres is pressed, and how sure that is.

PYTEST_DONT_REWRITE, because otherwise pytest warns if this was imported before pytest started.
"""

from __future__ import annotations

import importlib

TYPE_CHECKING = False  # typing takes time, in which Ctrl-C is not answered
if TYPE_CHECKING:
    from typing import Any

    from hertzchain import theory as theory
    from hertzchain.engines.lammps.backend import Lammps as Lammps
    from hertzchain.engines.liggghts import Liggghts as Liggghts
    from hertzchain.engines.native.backend import Native as Native
    from hertzchain.engines.native.batch import Batch as Batch
    from hertzchain.engines.native.batch import peak_forces as peak_forces
    from hertzchain.engines.native.batch import similar_peak_forces as similar_peak_forces
    from hertzchain.engines.yade import Yade as Yade
    from hertzchain.errors import HertzchainError as HertzchainError
    from hertzchain.examiner.examined import DeckCheck as DeckCheck
    from hertzchain.examiner.examined import DeckExamination as DeckExamination
    from hertzchain.examiner.examining import examine as examine
    from hertzchain.known.certificate import Certificate as Certificate
    from hertzchain.known.certificate import certify as certify
    from hertzchain.lab.fit import Fit as Fit
    from hertzchain.lab.fit import fit as fit
    from hertzchain.lab.spread import Spread as Spread
    from hertzchain.lab.spread import spread as spread
    from hertzchain.lab.validation import Validation as Validation
    from hertzchain.lab.validation import validate as validate
    from hertzchain.observables.result import Result as Result
    from hertzchain.report.figures import plot as plot
    from hertzchain.report.files import write_trajectory as write_trajectory
    from hertzchain.scene.chain import Chain as Chain
    from hertzchain.scene.scene import Scene as Scene
    from hertzchain.scene.schedule import Run as Run
    from hertzchain.scene.shocks import HalfSine as HalfSine
    from hertzchain.scene.shocks import Moving as Moving
    from hertzchain.scene.shocks import Piston as Piston
    from hertzchain.scene.shocks import Pulse as Pulse
    from hertzchain.scene.shocks import PulseTable as PulseTable
    from hertzchain.scene.shocks import Sawtooth as Sawtooth
    from hertzchain.scene.shocks import Sine as Sine
    from hertzchain.scene.shocks import Striker as Striker
    from hertzchain.scene.shocks import Trapezoid as Trapezoid
    from hertzchain.scene.terms import Contact as Contact
    from hertzchain.scene.terms import Gauge as Gauge
    from hertzchain.scene.terms import Precompression as Precompression
    from hertzchain.scene.terms import Uncertain as Uncertain
    from hertzchain.scene.terms import Wall as Wall
    from hertzchain.sweeps.design import scenes as scenes
    from hertzchain.sweeps.sweeping import Sweep as Sweep
    from hertzchain.sweeps.sweeping import sweep as sweep
    from hertzchain.verdict.comparison import Comparison as Comparison
    from hertzchain.verdict.comparison import compare as compare
    from hertzchain.verdict.judgement import Judgement as Judgement
    from hertzchain.verdict.results import TrainJudgement as TrainJudgement
    from hertzchain.verdict.results import judge as judge
    from hertzchain.verdict.results import judge_trains as judge_trains
    from hertzchain.verdict.traces import TraceJudgement as TraceJudgement
    from hertzchain.verdict.traces import judge_traces as judge_traces

_HOME = {
    name: f"hertzchain.{module}"
    for module, names in {
        "engines.lammps.backend": "Lammps",
        "engines.liggghts": "Liggghts",
        "engines.native.backend": "Native",
        "engines.native.batch": "Batch peak_forces similar_peak_forces",
        "engines.yade": "Yade",
        "errors": "HertzchainError",
        "examiner.examined": "DeckCheck DeckExamination",
        "examiner.examining": "examine",
        "lab.fit": "Fit fit",
        "known.certificate": "Certificate certify",
        "observables.result": "Result",
        "report.figures": "plot",
        "report.files": "write_trajectory",
        "scene.chain": "Chain",
        "scene.scene": "Scene",
        "scene.schedule": "Run",
        "scene.shocks": "HalfSine Moving Piston Pulse PulseTable Sawtooth Sine Striker Trapezoid",
        "scene.terms": "Contact Gauge Precompression Uncertain Wall",
        "sweeps.design": "scenes",
        "sweeps.sweeping": "Sweep sweep",
        "lab.spread": "Spread spread",
        "lab.validation": "Validation validate",
        "verdict.comparison": "Comparison compare",
        "verdict.judgement": "Judgement",
        "verdict.results": "TrainJudgement judge judge_trains",
        "verdict.traces": "TraceJudgement judge_traces",
    }.items()
    for name in names.split()
}
"""The module of each public name."""

__all__ = sorted([*_HOME, "theory"])  # noqa: PLE0605 - type checkers read the imports above


def __dir__() -> list[str]:
    """Return the public names."""
    return [*__all__, "__version__"]


def __getattr__(name: str) -> Any:
    """Load a public name, and what it needs, when it is first used; it checks its arguments."""
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("hertzchain")
    if name == "theory":
        return importlib.import_module("hertzchain.theory")
    if name in _HOME:
        checked = importlib.import_module("hertzchain.scene.keys").checked
        value = checked(getattr(importlib.import_module(_HOME[name]), name))
        return globals().setdefault(name, value)
    raise AttributeError(f"module 'hertzchain' has no attribute {name!r}")
