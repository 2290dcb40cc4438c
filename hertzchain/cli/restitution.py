"""hertzchain restitution: the restitution that damping options of other codes give."""

from __future__ import annotations

from pathlib import Path

import typer

from hertzchain.cli.options import AsJson, load_scene, refuse_without_need
from hertzchain.cli.output import show


def restitution(
    wanted: float = typer.Argument(
        ..., metavar="E", help="Wanted coefficient of restitution, 0.001 to 1."
    ),
    scene: Path | None = typer.Option(
        None,
        metavar="SCENE",
        help="Scene file with a striker, for options whose restitution depends on the velocity:"
        " the striker meets granule 2.",
    ),
    coefficient: float | None = typer.Option(
        None, help="A coefficient of damping; the restitution that it gives is listed (--scene)."
    ),
    as_json: AsJson = False,
) -> None:
    """List what restitution damping options of LAMMPS, LIGGGHTS and Yade give, and what to write.

    "hertzchain restitution 0.8" lists what 0.8 in a deck really gives, and the number that gives
    0.8. The column "pulls" says whether contacts pull as they open.

    "hertzchain restitution 0.8 --scene striker.toml" lists coefficients of damping, too.
    """
    refuse_without_need(scene is not None, coefficient=coefficient is not None)
    from hertzchain.decks.restitution import answers
    from hertzchain.errors import is_finite, require
    from hertzchain.report.restitution import print_restitution
    from hertzchain.scene.terms import NOT_NEGATIVE
    from hertzchain.theory.restitution import collision_of

    if coefficient is not None:
        right = is_finite(coefficient) and coefficient >= 0
        require(right, "--coefficient", coefficient, NOT_NEGATIVE)
    collision = None if scene is None else collision_of(load_scene(scene))
    found = answers(wanted, collision, coefficient)
    show(
        as_json,
        lambda: {"restitution": wanted, "options": [answer.to_dict() for answer in found]},
        lambda console: print_restitution(console, wanted, found),
    )
