"""More mistakes, in decks of all kinds of scenes: units, values taken for others, usual slips."""

from __future__ import annotations

from tests.verdict.deck.mistakes import Mistake


def slip(deck: str, check: str, line: str, *changes: tuple[str, str], scene: str = "") -> Mistake:
    """A slip in a deck of the corpus; the line may be any where nothing is given."""
    return Mistake(check, changes, line, "", f"in.{deck}", scene or deck.split("_", maxsplit=1)[0])


DEAD = {
    "density in g/cc": slip("steel_plain", "mass", "density 7.958", ("7958", "7.958")),
    "diameter 2R twice": slip(
        "steel_plain", "radius", "diameter", ("diameter $d", "diameter $(2*v_d)")
    ),
    "wall in cm": slip(
        "striker_wall",
        "place of the wall",
        "fix w last",
        ("NULL 0.095\n", "NULL 0.0095\n"),
        scene="striker_wall",
    ),
    "wall inside": slip(
        "striker_wall",
        "place of the wall",
        "fix w last",
        ("NULL 0.095\n", "NULL 0.0905\n"),
        scene="striker_wall",
    ),
    "piston in mm/s": slip(
        "piston", "displacement of the piston", "linear 200", ("linear 0.2", "linear 200")
    ),
    "striker in mm/s": slip(
        "striker_velocity", "velocity of granule 1", "set 1000", ("set 1.0", "set 1000.0")
    ),
    "force in dyn": slip("steel_plain", "peak of the applied", "F0 equal", ("100.0", "1e7")),
    "modulus in GPa": slip("steel_plain", "force of", "hertz/material 193 ", ("193e9", "193")),
    "step in us": slip("steel_plain", "time step", "timestep 0.2", ("2e-7", "0.2")),
}
"""Slips with which granules leave the box, by name: the numbers are known before the run."""

_TSUJI = ("damping velocity", "damping tsuji")
_PISTON = (
    "fix 1 rest nve\nfix 2 p move linear 0.2 0 0",
    "velocity p set 0.2 0 0\nfix 1 all nve\nfix 2 p setforce 0 0 0",
)
_HISTORY = "pair_style gran/hertz/history 1.413919414e12 NULL 0.0 0.0 0.0 0"

ALIVE = {
    "tsuji with e = 1": slip("steel_plain", "damping", "tsuji", _TSUJI, ("193e9 0.0", "193e9 1.0")),
    "modulus of type 1": slip("dimer", "stiffness", "pair_coeff 1 1", ("200e9", "210e9")),
    "modulus of type 2": slip("dimer", "stiffness", "pair_coeff 2 2", ("70e9", "72e9")),
    "Poisson of type 2": slip("dimer", "stiffness", "pair_coeff 2 2", ("0.34", "0.3")),
    "diameter of type 2": slip("dimer", "radius", "type 2 diameter", ("0.006", "0.0062")),
    "E for E*": slip(
        "dimer_pairs",
        "stiffness",
        "k12",
        ("200e9/(1-0.3^2)", "200e9"),
        ("70e9/(1-0.34^2)", "70e9"),
        scene="dimer",
    ),
    "4/3 missing": slip("dimer_pairs", "stiffness", "k12", ("4/3*v_e1", "v_e1"), scene="dimer"),
    "2/3 missing": slip("steel_history", "stiffness", "kn equal", ("2*${E}/3/", "${E}/")),
    "cut pulse": slip("steel_plain", "", "F equal", ("(time<2*v_t0)", "(time<v_t0)")),
    "striker without speed": slip(
        "striker_velocity",
        "velocity of granule 1",
        "velocity",
        ("velocity striker set 1.0 0 0", "velocity striker set 0 0 0"),
    ),
    "all fly": slip(
        "striker_velocity", "velocity of granule", "velocity", ("velocity striker", "velocity all")
    ),
    "moves twice": slip("piston", "integrators", "nve", ("fix 1 rest nve", "fix 1 all nve")),
    "gravity upwards": slip(
        "column", "constant force", "gravity", ("vector 0 0 -1", "vector 0 0 1")
    ),
    "force at the wrong end": slip(
        "steel_plain", "peak of the applied", "hit id 20", ("hit id 1\n", "hit id 20\n")
    ),
    "load pulls": slip(
        "precompressed",
        "constant force",
        "fix p",
        ("pa a addforce ${F0}", "pa a addforce -${F0}"),
        ("z addforce -${F0}", "z addforce ${F0}"),
    ),
    "no hold": slip("precompressed", "constant force", "", ("fix pz z addforce -${F0} 0 0\n", "")),
    "box ends at the last centre": slip(
        "steel_plain", "contacts", "region", ("-0.02 0.21 ", "-0.02 0.1805 ")
    ),
    "neighbours too few": slip(
        "steel_plain",
        "neighbours",
        "",
        ("0.002 bin", "0.0 bin"),
        ("delay 0 every 1 check yes", "delay 100000 every 100000 check no"),
    ),
    "piston too fast": slip(
        "piston", "displacement of the piston", "velocity p set", _PISTON, ("set 0.2", "set 0.21")
    ),
    "piston too slow": slip(
        "piston", "displacement of the piston", "linear 0.18", ("linear 0.2", "linear 0.18")
    ),
    "wall too soft": slip(
        "striker_wall", "stiffness of the wall", "", ("4/3*${E}", "2/3*${E}"), scene="striker_wall"
    ),
    "wall of the material": slip(
        "striker_wall",
        "stiffness of the wall",
        "fix w",
        (
            "hertz ${kw} 1e-300 tangential linear_nohistory 0 0 damping velocity",
            "hertz/material ${E} 0 ${nu} tangential linear_nohistory 0 0 damping velocity",
        ),
        scene="striker_wall",
    ),
    "wall too far": slip(
        "striker_wall",
        "place of the wall",
        "fix w",
        ("NULL 0.095\n", "NULL 0.0951\n"),
        scene="striker_wall",
    ),
    "no wall": slip(
        "striker_wall", "wall", "", ("fix w last", "# fix w last"), scene="striker_wall"
    ),
    "heavy striker": slip(
        "striker_wall",
        "mass of granule 1",
        "density",
        ("velocity all set", "set atom 1 density 2800\nvelocity all set"),
        scene="striker_wall",
    ),
    "cgs modulus": slip("steel_cgs", "stiffness", "193e9", ("193e10", "193e9")),
    "cgs density": slip("steel_cgs", "mass", "density", ("7.958", "7.598")),
    "cgs force": slip("steel_cgs", "peak of the applied", "1e6", ("1e7", "1e6")),
    "cgs pulse": slip("steel_cgs", "", "f equal", ("60e-6", "30e-6")),
    "micro density": slip("steel_micro", "mass", "density", ("7.958", "7.598")),
    "micro pulse": slip(
        "steel_micro", "duration", "pulse", ("time/30)", "time/32)"), ("time<60", "time<64")
    ),
    "nano force": slip("steel_nano", "peak of the applied", "pulse", ("1e14", "1.1e14")),
    "lj force": slip("steel_lj", "peak of the applied", "F0", ("7.83660816", "8.2")),
    "lj pulse": slip("steel_lj", "duration", "t0", ("0.01839538", "0.0199")),
    "lj one radius": slip(
        "steel_lj",
        "radius of granule 7",
        "atom 7",
        ("set group all density", "set atom 7 diameter 1.02\nset group all density"),
    ),
    "glass modulus": slip("glass_ramps", "stiffness", "60e9", ("60e9", "70e9")),
    "glass steps": slip("glass_ramps", "", "run 300", ("run 400", "run 300")),
    "table row": slip(
        "table_formula", "", "F equal", ("(80+3*(v_t-20))", "(80+2*(v_t-20))"), scene="table"
    ),
    "restitution": slip("restitution", "damping", "0.95", ("10e9 0.9", "10e9 0.95")),
    "relaxation": slip("viscoelastic", "damping", "", ("2*0.5e-6", "0.5e-6")),
    "striker upwards": slip(
        "striker_set", "velocity of granule 1", "", ("vy -100.0", "vy -90.0"), scene="striker"
    ),
    "stiff history": slip(
        "striker_set", "stiffness", "gran/hertz", ("1.413919414e12", "2.1208e12"), scene="striker"
    ),
    "gap closed": slip("gapped", "distance of granules", "0.01", ("v_i*0.010005", "v_i*0.01")),
    "no fix at all": slip("steel_plain", "integrators", "", ("fix             1 all nve\n", "")),
    "reversed push": slip("steel_reversed", "peak of the applied", "", ("-100*sin", "100*sin")),
    "two in one line": slip(
        "steel_plain", "stiffness", "hertz/material", ("193e9 0.0 0.3", "203e9 0.5 0.3")
    ),
    "compensating": slip(
        "steel_plain", "stiffness", "203e9", ("193e9", "203e9"), ("density 7958", "density 8370")
    ),
    "doubled": slip(
        "steel_plain",
        "",
        "addforce",
        ("fix             2 hit", "fix 3 hit addforce v_F 0 0\nfix             2 hit"),
    ),
}
"""Slips with which a deck comes to its end, by name."""
