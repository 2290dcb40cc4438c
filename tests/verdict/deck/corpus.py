"""Decks as users write them, and their expected results; scenes are in the same folder."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, field
from pathlib import Path

import hertzchain as hc
from hertzchain.engines.lammps.engine import engine
from tests.places import ROOT

FOLDER = ROOT / "tests" / "decks" / "user"


@dataclass(frozen=True)
class Deck:
    """A deck, its scene, variables of its command line, and how it differs where it should."""

    scene: str
    name: str
    variables: dict[str, str] = field(default_factory=dict)
    right: bool = True


VARIABLES = {"n": "20", "F0": "100", "dt": "2e-7"}

DECKS = (
    Deck("steel", "in.steel_plain"),  # a loop of create_atoms, a formula of time
    Deck("steel", "in.steel_history"),  # lattice, gran/hertz/history, nve/sphere, two runs
    Deck("steel", "in.steel_cgs"),  # along y
    Deck("steel", "in.steel_micro"),  # along z
    Deck("steel", "in.steel_nano"),
    Deck("steel", "in.steel_lj"),  # ratios alone are judged
    Deck("steel", "in.steel_reversed"),  # pushed at the upper end
    Deck("steel", "in.steel_data"),  # read_data, include, step*dt
    Deck("steel", "in.steel_restart"),  # read_restart
    Deck("steel", "in.steel_variables", VARIABLES),  # index variables, run upto
    Deck("steel", "in.steel_variables", right=False),  # and their defaults, which are others
    Deck("steel", "in.steel_if"),  # if then else, dump, write_data and shell, which are left out
    Deck("steel", "in.steel_if", {"style": "history"}),
    Deck("steel", "in.steel_hybrid"),  # pair_style hybrid, a fix given a second time
    Deck("steel", "in.steel_cwiggle"),
    Deck("steel", "in.random_places", right=False),  # no chain at all
    Deck("glass", "in.glass_ramps"),  # ramp() in two runs
    Deck("glass", "in.glass_random_order"),  # ids in no order, along z
    Deck("glass", "in.glass_every"),  # variable file: a force held for two steps
    Deck("striker", "in.striker_velocity"),  # region groups
    Deck("striker", "in.striker_set"),  # set vy, downwards, cgs
    Deck("striker_wall", "in.striker_wall"),  # wall/gran granular
    Deck("table", "in.table_vector"),  # pieces of index variables
    Deck("table", "in.table_formula"),  # all pieces in one formula, continued with &
    Deck("dimer", "in.dimer"),  # two materials, mixed by LAMMPS
    Deck("dimer", "in.dimer_pairs"),  # granular hertz
    Deck("precompressed", "in.precompressed"),
    Deck("column", "in.column"),  # gravity on purpose, a floor
    Deck("viscoelastic", "in.viscoelastic"),
    Deck("restitution", "in.restitution"),
    Deck("gapped", "in.gapped"),
    Deck("piston", "in.piston"),
    Deck("striker", "in.piston", right=False),  # moved, where it should fly
)


def scene_of(name: str) -> hc.Scene:
    """A scene of the corpus."""
    return hc.Scene.from_toml(FOLDER / f"{name}.toml")


def copied(folder: Path, deck: Deck) -> Path:
    """A deck in a folder of its own, with all that it reads."""
    shutil.copytree(FOLDER, folder, dirs_exist_ok=True)
    if deck.name == "in.steel_restart":
        with engine() as lammps:
            commands = (folder / "in.make_restart").read_text(encoding="utf-8")
            for name in ("chain.data", "material.inc", "chain.restart"):
                commands = commands.replace(name, str(folder / name))
            lammps.commands_string(commands)
    return folder / deck.name
