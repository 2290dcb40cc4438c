"""hertzchain predict: the formulas alone."""

from __future__ import annotations

from hertzchain.cli.options import AsJson, SceneFile, load_scene
from hertzchain.cli.output import console, print_json


def predict(scene: SceneFile, as_json: AsJson = False) -> None:
    """Predict without simulating: a map of peaks, p, F_SW, the formulas, the exact wave."""
    from hertzchain import theory
    from hertzchain.report.console import print_prediction

    prediction = theory.predict(load_scene(scene))
    if as_json:
        print_json(prediction.to_dict())
    else:
        print_prediction(console(), prediction)
