"""Mistakes planted in decks of the corpus: change, expected message and its line."""

from __future__ import annotations

from dataclasses import dataclass

LOOP = "set             type 1 density 7958\n"


@dataclass(frozen=True)
class Mistake:
    """Texts of a deck's file and their replacements; start of the name of the check that must fail.

    ``line`` is part of the line that must be named, ``right`` part of the command that is shown.
    """

    check: str
    change: tuple[tuple[str, str], ...]
    line: str
    right: str
    deck: str = "in.steel_plain"
    scene: str = "steel"
    file: str = ""  # where the change is, if not in the deck itself

    @property
    def name(self) -> str:
        """For tests."""
        return f"{self.check}: {self.line}".replace(" ", "_")


def one(check: str, old: str, new: str, line: str, right: str, **others: str) -> Mistake:
    """A mistake in one place."""
    return Mistake(check, ((old, new),), line, right, **others)


def after_density(check: str, added: str, right: str) -> Mistake:
    """A command too many in the plain deck; the last of some lines is the one to be named."""
    return one(check, LOOP, f"{LOOP}{added}\n", added.splitlines()[-1], right)


PLAIN = {
    "mass": one("mass of all", "density 7958", "density 7598", "density 7598", "density 7958"),
    "peak": one("peak of the applied", "F0 equal 100.0", "F0 equal 90.0", "F0 equal 90.0",
                "F0 equal 100"),
    "rise": one("duration of the pulse", "t0 equal 30e-6", "t0 equal 25e-6", "t0 equal 25e-6",
                "t0 equal 3e-05"),
    "step": Mistake("time step", (("timestep        2e-7", "timestep 4e-6"),
                                  ("run             2500", "run 125")), "timestep 4e-6",
                    "timestep "),
    "modulus": one("stiffness", "193e9", "210e9", "hertz/material 210e9",
                   "hertz/material 1.93e+11"),
    "poisson": one("stiffness", " 0.3 tang", " 0.03 tang", "0.03 tangential", " 0.3 "),
    "gravity": after_density("constant force", "fix g all gravity 9.81 vector 1 0 0", "without"),
    "across": after_density("constant force across", "fix g all gravity 9.81 vector 0 0 -1",
                            "without"),
    "friction": one("friction", "linear_nohistory 0.0 0.0", "mindlin NULL 1.0 0.5",
                    "mindlin NULL 1.0 0.5", "linear_nohistory 0.0 0.0"),
    "damping": one("damping", "193e9 0.0 0.3", "193e9 50.0 0.3", "hertz/material 193e9 50.0",
                   "hertz/material 193e9 0.0"),
    "thermal": after_density("velocity of granule", "velocity all create 1e16 87287",
                             "velocity all set 0"),
    "drag": after_density("drag", "fix d all viscous 0.5", "without"),
    "spin": after_density("spin", "set type 1 omega 0 0 100", "omega 0"),
    "wall": after_density("wall at the far end", "fix w all wall/gran granular hertz 1e11 1e-300 "
                          "tangential linear_nohistory 0 0 damping velocity xplane NULL 0.18525",
                          "without the fix w"),
    "count": one("number of granules", "i loop 20", "i loop 19", "variable i loop 19",
                 "i loop 20"),
    "radius": one("radius of granule 7", LOOP,
                  f"set atom 7 diameter 0.0096\n{LOOP}", "set atom 7 diameter 0.0096",
                  "set atom 7 diameter 0.0095"),
    "end": one("end of the run", "run             2500", "run 900", "run 900", "run 2500"),
    "twice": one("integrators", "fix             1 all nve\n",
                 "fix             1 all nve\nfix again all nve/sphere\n",
                 "fix again all nve/sphere", "without"),
    "group": one("granules that are pushed", "hit id 1\n", "hit id 1:2\n", "hit id 1:2",
                 "id 1"),
    "middle": one("granules that are pushed", "hit id 1\n", "hit id 10\n", "hit id 10", "id 1"),
    "profile": one("", "sin(PI*time/(2*v_t0))^2", "sin(PI*time/(2*v_t0))", "sin(PI*time/(2*v_t0))*",
                   "sin(PI/2*"),
    "image": Mistake("contacts across", (
        ("boundary        f f f", "boundary p f f"),
        ("block -0.02 0.21", "block -0.00475 0.18525")), "boundary p f f", "boundary f"),
    "off axis": one("distance from the axis", LOOP, f"{LOOP}set atom 5 y 2e-5\n",
                    "set atom 5 y 2e-5", ""),
    "no motion of the last": Mistake("integrators", (("1 all nve", "1 most nve"),
        ("hit id 1\n", "hit id 1\ngroup most id 1:19\n")), "most nve", "all nve"),
    "seldom": one("applied force over time", "v_F 0.0 0.0", "v_F 0.0 0.0 every 5", "every 5",
                  "addforce v_F 0.0 0.0"),
    "second": one("force after the pulse", "(time<2*v_t0)", "((time<2*v_t0)+(time>2e-4))",
                  "time>2e-4", "time<6e-05"),
    "stopped": one("motion, by velocities", "run             2500",
                   "run 500\nvelocity all zero linear\nrun 2000", "zero linear", "without"),
    "limited": one("motion, by velocities", "1 all nve", "1 all nve/limit 1e-7", "nve/limit",
                   "fix motion all nve"),
    "softer later": one("motion", "run             2500", "run 500\npair_coeff * * hertz/material"
                        " 150e9 0.0 0.3 tangential linear_nohistory 0.0 0.0\nrun 2000",
                        "hertz/material 150e9", "without"),
    "moved later": one("motion", "run             2500", "run 500\ngroup tail id 15:20\n"
                       "displace_atoms tail move 3e-6 0 0\nrun 2000", "tail move", "without"),
    "neighbours": Mistake("neighbours", (("0.002 bin", "0.0 bin"),
        ("delay 0 every 1 check yes", "delay 100000 every 100000 check no")), "check no",
        "check yes"),
    "adhesive": one("force of contact", "hertz/material 193e9 0.0 0.3", "jkr 193e9 0.0 0.3 10.0",
                    "jkr", "hertz/material"),
    "held": after_density("force of fix setforce along", "group e id 20\nfix s e setforce 0 0 0",
                          "without"),
    "shared": after_density("force of fix aveforce along",
                            "group e id 9:20\nfix s e aveforce 0 0 0", "without"),
    "tied": after_density("force of fix spring/self along", "fix s all spring/self 1e3", "without"),
    "braked": after_density("drag", "variable b atom -0.5*vx\nfix s all addforce v_b 0 0",
                            "without"),
    "braked later": one("force of fix viscous along", "run             2500",
                        "run 500\nfix s all viscous 0.5\nrun 2000", "fix s all", "without"),
    "lifted": after_density("force of fix addforce across",
                            "variable b atom 0.5*vx\nfix s all addforce 0 v_b 0", "without"),
    "excluded": after_density("force of contact", "group a id 15\ngroup b id 16\n"
                              "neigh_modify exclude group a b", "without exclude"),
    "channel": after_density("force of fix wall/gran across", "fix w all wall/gran granular"
                             " hertz/material 193e9 0 0.3 tangential linear_nohistory 0 0 yplane"
                             " -0.004751 0.004749", "without"),
    "here alone": Mistake("motion, by the peak", (
        ("addforce v_F 0.0 0.0", "addforce v_F 0.0 0.0 region r"),
        ("hit id 1\n", "hit id 1\nregion r block -1 5e-6 -1 1 -1 1 units box\n")),
        "F equal", "sin(PI/2*"),
    "between readings": one("motion, by velocities", "*(time<2*v_t0)",
        "*(time<2*v_t0)+5000*(abs(time-2e-4)<1e-7)", "F equal", "sin(PI/2*"),
    "halted": one("end of the run", LOOP, f"{LOOP}variable t equal time\n"
                  "fix h all halt 10 v_t > 3e-4 error soft\n", "run", "run 2500"),
    "pulled aside": after_density("constant force across",
                                  "group e id 20\nfix s e spring tether 1e4 NULL 1e-3 0 0",
                                  "without"),
    "random": after_density("random forces", "fix l all langevin 1e16 1e16 1e-3 4711", "without"),
}  # fmt: skip
"""Mistakes in the plain deck, by name: they can be planted together."""

ELSEWHERE = {
    "order": Mistake("mass of all", (("set group all diameter 0.95\n", ""),
        ("density 7.958\n", "density 7.958\nset group all diameter 0.95\n")),
        "set group all density 7.958", "7.958, below the line that sets the diameter",
        "in.steel_cgs"),
    "two thirds": one("stiffness", "1.413919414e11", "0.942612943e11", "hertz 0.942612943e11",
        "hertz 1.41391", deck="in.steel_hybrid"),
    "included": one("stiffness", "193e9", "203e9", "hertz/material 203e9", "1.93e+11",
        deck="in.steel_data", file="material.inc"),
    "half sine": one("", "60e-6)^2", "60e-6)", "variable f equal 1e7*sin(PI*time/60e-6)", "sin",
        deck="in.steel_cgs"),
    "wrong axis": one("applied force across", "addforce 0 v_f 0", "addforce v_f 0 0",
        "addforce v_f 0 0", "addforce 0.0 v_f 0.0", deck="in.steel_cgs"),
    "units": one("stiffness", "193e10", "193e9", "hertz/material 193e9", "1.93e+12",
        deck="in.steel_cgs"),
    "wall": one("stiffness of the wall", "kw equal 4/3", "kw equal 2/3", "fix w last", "hertz",
        deck="in.striker_wall", scene="striker_wall"),
    "wall place": one("place of the wall", "NULL 0.095\n", "NULL 0.09501\n", "fix w last", "xplane",
        deck="in.striker_wall", scene="striker_wall"),
    "moving wall": one("wall in motion", "NULL 0.095\n", "NULL 0.095 wiggle x 1e-6 1e-4\n",
        "fix w last", "xplane NULL 0.095", deck="in.striker_wall", scene="striker_wall"),
    "striker": one("velocity of granule 1", "set 1.0 0 0", "set 0.95 0 0", "set 0.95 0 0",
        "set 1 0 0", deck="in.striker_velocity", scene="striker"),
    "gap": one("distance of granules", "0.010005", "0.010007", "v_i*0.010007", "0.010005",
        deck="in.gapped", scene="gapped"),
    "swiggle": one("", "cwiggle", "swiggle", "swiggle(0,50,60e-6)", "sin", deck="in.steel_cwiggle"),
    "load": one("constant force", "F0 equal 20.0", "F0 equal 22.0", "F0 equal 22.0", "F0 equal 20",
        deck="in.precompressed", scene="precompressed"),
    "gravity": one("constant force", "g equal 9.81", "g equal 1.62", "g equal 1.62", "9.81",
        deck="in.column", scene="column"),
    "restitution": one("damping", "10e9 0.9 0.3", "10e9 0.8 0.3", "10e9 0.8 0.3", "10e9 0.9 0.3",
        deck="in.restitution", scene="restitution"),
    "attraction": one("damping", " limit_damping", "", "coeff_restitution", "limit_damping",
        deck="in.restitution", scene="restitution"),
    "light": one("mass of granules 2, 4", "density 2700", "density 2800", "density 2800",
        "density 2700", deck="in.dimer", scene="dimer"),
    "piston": one("displacement of the piston", "linear 0.2", "linear 0.19", "linear 0.19",
        "linear 0.2", deck="in.piston", scene="piston"),
    "hooke": Mistake("exponent", (("pair_style gran/hertz/history ${kn} NULL 0.0 0.0 0.0 0",
        "pair_style gran/hooke/history 2e7 NULL 0.0 0.0 0.0 0"),), "gran/hooke", "gran/hertz",
        "in.steel_history"),
    "pushed too": one("applied force", "vy -100.0", "vy -100.0\ngroup s id 1\n"
        "variable q equal -1e6*(time<5e-5)\nfix p s addforce 0 v_q 0", "fix p s addforce",
        "without", deck="in.striker_set", scene="striker"),
    "no gravity": one("constant force", "fix grav all gravity ${g} vector 0 0 -1\n", "",
        "run 4000", "gravity 9.81", deck="in.column", scene="column"),
    "no floor": one("wall", "fix floor all", "#", "run 4000", "wall/gran", deck="in.column",
        scene="column"),
    "data": one("mass of granule 4", "\n4 1 0.0095 7958", "\n4 1 0.0095 8958", "read_data", "",
        deck="in.steel_data", file="chain.data"),
    "corner": one("", "run 400\n", "run 500\n", "run 500", "run 400", deck="in.glass_ramps",
        scene="glass"),
}  # fmt: skip
"""Mistakes in other decks, by name."""

PAIRS = (
    ("mass", "peak"), ("mass", "rise"), ("mass", "step"), ("peak", "modulus"), ("rise", "step"),
    ("modulus", "gravity"), ("friction", "peak"), ("damping", "mass"), ("thermal", "rise"),
    ("drag", "modulus"), ("wall", "mass"), ("radius", "peak"), ("twice", "modulus"),
    ("group", "mass"), ("count", "modulus"), ("image", "step"), ("damping", "poisson"),
)  # fmt: skip
"""Planted together in the plain deck."""
