"""A scene as people give it: the scene itself, or the path of its file."""

from __future__ import annotations

import os

from hertzchain.errors import require
from hertzchain.scene.scene import Scene

SceneLike = Scene | str | os.PathLike[str]
"""A scene, or the path of a scene file."""


def to_scene(given: SceneLike) -> Scene:
    """Return the scene, read from its file where a path is given; else raise a SceneError."""
    if isinstance(given, str | os.PathLike):
        return Scene.from_toml(os.fspath(given))
    kind = None if given is None else type(given).__name__
    allowed = "must be a Scene or the path of a scene file (TOML)"
    require(isinstance(given, Scene), "scene", kind, allowed)
    return given
