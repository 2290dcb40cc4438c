"""Right decks of scenes with terms, as texts; ``made.found`` has their numbers."""

from __future__ import annotations

from hertzchain.engines.lammps.reading.found import FoundDeck
from hertzchain.scene.scene import Scene
from tests.verdict.deck.made import found

_FRICTION = "tangential linear_nohistory 0.0 0.0"
_DAMPER = f"{_FRICTION} damping viscoelastic"

DECKS: dict[str, tuple[str, ...]] = {
    "wall": (
        "units si",
        "set group all diameter 0.01",
        "set group all density 2700",
        "pair_style granular",
        f"pair_coeff * * hertz/material 7e10 0.0 0.33 {_FRICTION}",
        "group first id 1",
        (
            f"fix w all wall/gran granular hertz 1.047394606e+11 1e-300 {_FRICTION}"
            " damping velocity xplane NULL 0.095"
        ),
        "velocity first set 0.5 0.0 0.0 units box",
        "fix 1 all nve",
        "timestep 2e-7",
        "run 3000",
    ),
    "column": (
        "units si",
        "set group all diameter 0.02",
        "set group all density 1100",
        "pair_style granular",
        f"pair_coeff * * hertz/material 5e6 0.0 0.45 {_FRICTION}",
        "group first id 1",
        f"fix w all wall/gran granular hertz 8359456.635 1e-300 {_FRICTION} xplane NULL 0.18",
        "fix g all gravity 9.81 vector 1 0.0 0.0",
        "fix 1 all nve",
        "variable F equal 2*(time/2e-3*(time<2e-3)+(4e-3-time)/2e-3*(time>=2e-3)*(time<4e-3))",
        "fix 2 first addforce v_F 0.0 0.0",
        "timestep 1e-5",
        "run 4000",
    ),
    "precompressed": (
        "units si",
        "set group all diameter 0.008",
        "set group all density 7800",
        "pair_style granular",
        f"pair_coeff * * hertz/material 2e11 0.0 0.29 {_FRICTION}",
        "group first id 1",
        "group last id 14",
        "fix p first addforce 20 0.0 0.0",
        "fix q last addforce -20 0.0 0.0",
        "fix 1 all nve",
        "variable F equal 40*sin(PI*time/40e-6)^2*(time<40e-6)",
        "fix 2 first addforce v_F 0.0 0.0",
        "timestep 1e-7",
        "run 2500",
    ),
    "piston": (
        "units si",
        "set group all diameter 0.0095",
        "set group all density 7958",
        "pair_style granular",
        f"pair_coeff * * hertz/material 1.93e11 0.0 0.3 {_FRICTION}",
        "group first id 1",
        "fix m first move linear 0.2 0.0 0.0",
        "group rest subtract all first",
        "fix 1 rest nve",
        "timestep 2e-7",
        "run 1500",
    ),
    "fixed": (
        "units si",
        "set group all diameter 0.008",
        "set group all density 2700",
        "pair_style granular",
        f"pair_coeff * * hertz/material 7e10 0.0 0.34 {_FRICTION}",
        "group first id 1",
        "group clamped id 9",
        "group free subtract all clamped",
        "velocity first set 0.3 0.0 0.0 units box",
        "fix 1 free nve",
        "timestep 2e-7",
        "run 1500",
    ),
    "dimer": (
        "units si",
        "set type 1 diameter 0.012",
        "set type 2 diameter 0.006",
        "set type 1 density 7800",
        "set type 2 density 2700",
        "pair_style granular",
        f"pair_coeff 1 1 hertz/material 2e11 0.0 0.3 {_FRICTION}",
        f"pair_coeff 2 2 hertz/material 7e10 0.0 0.34 {_FRICTION}",
        "group first id 1",
        "fix 1 all nve",
        "variable F equal 150*(time/25e-6*(time<25e-6)+(2-time/25e-6)*(time>=25e-6)*(time<50e-6))",
        "fix 2 first addforce v_F 0.0 0.0",
        "timestep 1e-7",
        "run 4000",
    ),
    "viscoelastic": (
        "units si",
        "set group all diameter 0.0095",
        "set group all density 7958",
        "pair_style granular",
        f"pair_coeff * * hertz 1.413919414e+11 59366650.12 {_DAMPER}",
        "group first id 1",
        "fix 1 all nve",
        "variable F equal 100*sin(PI*time/60e-6)^2*(time<60e-6)",
        "fix 2 first addforce v_F 0.0 0.0",
        "timestep 2e-8",
        "run 17500",
    ),
}
"""By the name of the scene."""


def deck_of(name: str, scene: Scene, old: str = "", new: str = "") -> FoundDeck:
    """The numbers of a scene in the deck of one, with another text in its commands."""
    texts = DECKS[name]
    if old:
        assert any(old in text for text in texts)
        texts = tuple(text.replace(old, new) for text in texts)
    return found(scene, texts)
