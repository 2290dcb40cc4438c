"""hertzchain predict: the formulas alone."""

from __future__ import annotations

from hertzchain.cli.options import AsJson, SceneFile, load_scene
from hertzchain.cli.output import show


def predict(scene: SceneFile, as_json: AsJson = False) -> None:
    """Predict peaks, p and F_SW without a simulation.

    They come from the formulas, a map of simulated peaks, and the exact solitary wave.
    """
    from hertzchain import theory
    from hertzchain.report.console import print_prediction

    prediction = theory.predict(load_scene(scene))
    show(as_json, prediction.to_dict, lambda console: print_prediction(console, prediction))
