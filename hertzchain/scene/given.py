"""A scene as people give it: the scene itself, or the path of its file."""

from __future__ import annotations

import os

from hertzchain.scene.scene import Scene

SceneLike = Scene | str | os.PathLike[str]
"""A scene, or the path of a scene file."""


def to_scene(given: SceneLike) -> Scene:
    """Return the scene, read from its file where a path is given."""
    if isinstance(given, str | os.PathLike):
        return Scene.from_toml(os.fspath(given))
    return given
