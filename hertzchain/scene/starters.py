"""Commented scene files to start from, by name."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from hertzchain.errors import OutputError
from hertzchain.files import write_texts

_CHAIN = """\
# Bare numbers are SI units; a string carries its unit.
[chain]
granules = {granules}
radius = "4.75 mm"
young_modulus = "193 GPa"
poisson_ratio = 0.3
density = "7958 kg/m^3"{more}
"""

_COSINE_PULSE = """
[shock]                      # the force on granule 1
profile = "cosine"           # 1 - cos, no half sine; or triangular, cosine-triangular
peak_force = "100 N"
duration_ratio = 2           # the pulse lasts this many rise times
momentum_ratio = 1.0         # LM_ratio: 1 gives the momentum of one solitary wave of 100 N;
                             # or rise_time = "30 us" instead
"""

_HALF_SINE_PULSE = """
[shock]                      # the force on granule 1
profile = "half-sine"        # or "sawtooth": it rises in a line, and ends at its peak; or
                             # "trapezoid": a line up, a constant force, a line down
peak_force = "200 N"
duration = "40 us"           # of the whole pulse
# rise_time = "10 us"        # of a trapezoid
# fall_time = "10 us"
"""

_SOFT_PULSE = _COSINE_PULSE.replace("100 N", "20 N")  # 100 N: too deep for Hertz's law

_STRIKER = """
[striker]                    # instead of [shock]: granule 1 flies into the others
velocity = "1 m/s"
radius = "6 mm"              # what differs in granule 1; leave it out for an equal granule
"""

_RIGID_WALL = """
[wall]                       # at the far end
kind = "rigid"               # or "same": the material of the last granule; or "elastic": with
                             # young_modulus and poisson_ratio of its own
"""

_LOAD = """
[precompression]
force = "20 N"               # all the time, on granule 1, or on granule 2 ahead of a striker;
                             # an equal force holds the last granule
# gravity = "9.81 m/s^2"     # along the chain, towards the far end; needs a [wall]
"""

_RUN = """
# [run]
# end_time = "1 ms"          # by default long enough for the wave to pass every contact
"""

_SEGMENTS = """

[[chain.segments]]           # in order; their granules sum to those of [chain]
granules = 40
# The cell is repeated: {} is a granule as in [chain], then one of PTFE.
cell = [{}, { young_modulus = "1.46 GPa", poisson_ratio = 0.46, density = "2.2 g/cm^3" }]"""

_TABLE = """\
time_s,force_N
0,0
1e-05,12
2e-05,55
3e-05,92
3.5e-05,100
4e-05,95
5e-05,68
6e-05,33
7e-05,10
8e-05,0
"""


@dataclass(frozen=True)
class Starter:
    """A scene file to start from.

    Parameters
    ----------
    title
        What the file describes, its first line.
    text
        The other lines.
    granules
        N.
    more
        The end of the section chain.
    table
        The pulse table that the file needs, if any.
    """

    title: str
    text: str
    granules: int = 20
    more: str = ""
    table: str | None = None

    def toml(self, table_name: str) -> str:
        """The text of the file; a pulse table is called ``table_name``."""
        chain = _CHAIN.format(granules=self.granules, more=self.more)
        text = self.text.replace("TABLE_NAME", json.dumps(table_name, ensure_ascii=False))
        return f"# {self.title}\n{chain}{text}{_RUN}"


STARTERS = {
    "pulse": Starter("A uniform chain of steel spheres under a short pulse.", _COSINE_PULSE, 60),
    "half-sine": Starter("A uniform chain of steel spheres under a half sine.", _HALF_SINE_PULSE),
    "pulse-table": Starter(
        "A uniform chain of steel spheres under a measured pulse.",
        """
[shock]                      # the force on granule 1
# CSV with the header time_s,force_N, next to this file; "hertzchain pulse" writes one from
# a file of an oscilloscope.
profile = "table"
file = TABLE_NAME
""",
        60,
        table=_TABLE,
    ),
    "striker": Starter("A striker hits a chain of steel spheres.", _STRIKER),
    "wall": Starter("A striker hits a chain that ends at a rigid wall.", _STRIKER + _RIGID_WALL),
    "dimer": Starter("Steel and PTFE by turns, under a short pulse.", _SOFT_PULSE, 40, _SEGMENTS),
    "cradle": Starter(
        "Newton's cradle: two spheres fly into three.",
        "",
        5,
        """

[[chain.segments]]           # in order; their granules sum to those of [chain]
granules = 2
velocity = "1 m/s"           # at the start; negative towards granule 1

[[chain.segments]]
granules = 3                 # at rest""",
    ),
    "precompressed": Starter(
        "A chain under a static load, and a short pulse.",
        _COSINE_PULSE + _LOAD,
        30,
    ),
    "free-striker": Starter(
        "A striker flies onto a chain under a static load.",
        _STRIKER
        + "# loaded = true             # if the load is on the striker, and presses contact 1\n"
        + _LOAD,
        30,
    ),
    "damped": Starter(
        "A striker hits a damped chain that ends at a rigid wall.",
        _STRIKER
        + _RIGID_WALL
        + """
[contact]                    # damping of every contact, the wall's too
damping = "restitution"      # or "viscoelastic" with relaxation_time, "dashpot" with coefficient
restitution = 0.8
""",
    ),
    "piston": Starter(
        "A piston pushes a chain of steel spheres.",
        """
[shock]
profile = "piston"           # granule 1 moves as stated, whatever presses it
velocity = "0.1 m/s"         # constant; or file = "motion.csv", header time_s,displacement_m
""",
    ),
    "sine": Starter(
        "A sine shakes a chain under a static load.",
        """
[precompression]
force = "10 N"               # at least the amplitude: an actuator cannot pull

[shock]
profile = "sine"
amplitude = "5 N"            # of a force on granule 1, on top of the static load
frequency = "8 kHz"
cycles = 4
""",
    ),
    "local": Starter(
        "A pulse on a granule within a chain under a static load.",
        _COSINE_PULSE.replace("the force on granule 1", "the force on granule 10")
        + """granule = 10                 # waves run from it to both ends
"""
        + _LOAD,
        30,
    ),
    "clamped": Starter(
        "A striker hits a chain whose last granule is clamped.",
        """
[[chain.segments]]
granules = 29

[[chain.segments]]
granules = 1
fixed = true                 # it never moves; its contact is that of two spheres
"""
        + _STRIKER,
        30,
    ),
    "two-walls": Starter(
        "Spheres are thrown at a near wall; a chain between two walls.",
        """
[[chain.segments]]           # in order; their granules sum to those of [chain]
granules = 3
velocity = "-1 m/s"          # towards the near end

[[chain.segments]]
granules = 17                # at rest

[near_wall]                  # before granule 1; its contact is contact 1
kind = "rigid"
"""
        + _RIGID_WALL,
    ),
}
"""Starters by name, in the order in which they are listed."""


def write_starter(name: str, path: Path) -> list[Path]:
    """Write a scene file to start from and its pulse table, if any; return the files in order.

    The table is named as the scene file, with the suffix .csv. An OutputError says what cannot be
    written; then no file is.
    """
    starter, files = STARTERS[name], files_of(name, path)
    texts = [starter.toml(files[-1].name), *filter(None, [starter.table])]
    write_texts(dict(zip(files, texts, strict=True)))
    return files


def files_of(name: str, path: Path) -> list[Path]:
    """Return the files that ``write_starter`` writes; an OutputError if two have the same name."""
    if STARTERS[name].table is None:
        return [path]
    table = path.with_suffix(".csv")
    if table == path:
        raise OutputError(
            f"{path}: is the name of the pulse table, which is named as the scene: name the scene"
            f" {path.with_suffix('.toml')}"
        )
    return [path, table]
