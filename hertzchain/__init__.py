"""How hard each contact of a shocked chain of spheres is pressed, and how sure that is.

PYTEST_DONT_REWRITE, because otherwise pytest warns if this was imported before pytest started.
"""

from __future__ import annotations

import importlib

TYPE_CHECKING = False  # typing takes time, in which Ctrl-C is not answered
if TYPE_CHECKING:
    from typing import Any

    from hertzchain import theory
    from hertzchain.engines.lammps.backend import Lammps
    from hertzchain.engines.liggghts import Liggghts
    from hertzchain.engines.native.backend import Native
    from hertzchain.engines.native.batch import Batch, peak_forces, similar_peak_forces
    from hertzchain.engines.yade import Yade
    from hertzchain.errors import HertzchainError
    from hertzchain.examiner.examined import DeckCheck, DeckExamination
    from hertzchain.examiner.examining import examine
    from hertzchain.fits.fit import Fit, fit
    from hertzchain.known.certificate import Certificate, certify
    from hertzchain.observables.result import Result
    from hertzchain.report.figures import plot
    from hertzchain.report.files import write_trajectory
    from hertzchain.scene.chain import Chain
    from hertzchain.scene.scene import Scene
    from hertzchain.scene.schedule import Run
    from hertzchain.scene.shocks import (
        HalfSine,
        Moving,
        Piston,
        Pulse,
        PulseTable,
        Sawtooth,
        Sine,
        Striker,
        Trapezoid,
    )
    from hertzchain.scene.terms import Contact, Gauge, Precompression, Uncertain, Wall
    from hertzchain.sweeps.design import scenes
    from hertzchain.sweeps.sweeping import Sweep, sweep
    from hertzchain.uncertainty.spread import Spread, spread
    from hertzchain.uncertainty.validation import Validation, validate
    from hertzchain.verdict.comparison import Comparison, compare
    from hertzchain.verdict.judgement import Judgement
    from hertzchain.verdict.results import TrainJudgement, judge, judge_trains
    from hertzchain.verdict.traces import TraceJudgement, judge_traces

_HOME = {
    "Batch": "hertzchain.engines.native.batch",
    "Certificate": "hertzchain.known.certificate",
    "Chain": "hertzchain.scene.chain",
    "Comparison": "hertzchain.verdict.comparison",
    "DeckCheck": "hertzchain.examiner.examined",
    "DeckExamination": "hertzchain.examiner.examined",
    "Fit": "hertzchain.fits.fit",
    "Gauge": "hertzchain.scene.terms",
    "HalfSine": "hertzchain.scene.shocks",
    "HertzchainError": "hertzchain.errors",
    "Judgement": "hertzchain.verdict.judgement",
    "Lammps": "hertzchain.engines.lammps.backend",
    "Liggghts": "hertzchain.engines.liggghts",
    "Moving": "hertzchain.scene.shocks",
    "Native": "hertzchain.engines.native.backend",
    "Contact": "hertzchain.scene.terms",
    "Piston": "hertzchain.scene.shocks",
    "Precompression": "hertzchain.scene.terms",
    "Pulse": "hertzchain.scene.shocks",
    "PulseTable": "hertzchain.scene.shocks",
    "Result": "hertzchain.observables.result",
    "Run": "hertzchain.scene.schedule",
    "Sawtooth": "hertzchain.scene.shocks",
    "Scene": "hertzchain.scene.scene",
    "Sine": "hertzchain.scene.shocks",
    "Striker": "hertzchain.scene.shocks",
    "Spread": "hertzchain.uncertainty.spread",
    "Sweep": "hertzchain.sweeps.sweeping",
    "TraceJudgement": "hertzchain.verdict.traces",
    "TrainJudgement": "hertzchain.verdict.results",
    "Trapezoid": "hertzchain.scene.shocks",
    "Uncertain": "hertzchain.scene.terms",
    "Validation": "hertzchain.uncertainty.validation",
    "Wall": "hertzchain.scene.terms",
    "Yade": "hertzchain.engines.yade",
    "certify": "hertzchain.known.certificate",
    "compare": "hertzchain.verdict.comparison",
    "examine": "hertzchain.examiner.examining",
    "fit": "hertzchain.fits.fit",
    "judge": "hertzchain.verdict.results",
    "judge_traces": "hertzchain.verdict.traces",
    "judge_trains": "hertzchain.verdict.results",
    "peak_forces": "hertzchain.engines.native.batch",
    "plot": "hertzchain.report.figures",
    "scenes": "hertzchain.sweeps.design",
    "similar_peak_forces": "hertzchain.engines.native.batch",
    "spread": "hertzchain.uncertainty.spread",
    "sweep": "hertzchain.sweeps.sweeping",
    "validate": "hertzchain.uncertainty.validation",
    "write_trajectory": "hertzchain.report.files",
}

__all__ = [
    "Batch",
    "Certificate",
    "Chain",
    "Comparison",
    "Contact",
    "DeckCheck",
    "DeckExamination",
    "Fit",
    "Gauge",
    "HalfSine",
    "HertzchainError",
    "Judgement",
    "Lammps",
    "Liggghts",
    "Moving",
    "Native",
    "Piston",
    "Precompression",
    "Pulse",
    "PulseTable",
    "Result",
    "Run",
    "Sawtooth",
    "Scene",
    "Sine",
    "Spread",
    "Striker",
    "Sweep",
    "TraceJudgement",
    "TrainJudgement",
    "Trapezoid",
    "Uncertain",
    "Validation",
    "Wall",
    "Yade",
    "certify",
    "compare",
    "examine",
    "fit",
    "judge",
    "judge_traces",
    "judge_trains",
    "peak_forces",
    "plot",
    "scenes",
    "similar_peak_forces",
    "spread",
    "sweep",
    "theory",
    "validate",
    "write_trajectory",
]


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
        checked = importlib.import_module("hertzchain.scene.arguments").checked
        value = checked(getattr(importlib.import_module(_HOME[name]), name))
        return globals().setdefault(name, value)
    raise AttributeError(f"module 'hertzchain' has no attribute {name!r}")
