"""What columns of a file mean: named on the command line, or known by their usual names."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hertzchain.engines.lammps.reading.units import UNITS, Units
from hertzchain.errors import SceneError, require
from hertzchain.scene.quantities import to_si
from hertzchain.scene.scene import Scene

DIMENSIONS = {
    "contact": "", "peak_force": "N", "time": "s", "step": "", "position": "m", "velocity": "m/s",
    "net_force": "N", "contact_force": "N", "id": "",
}  # fmt: skip
"""What a column can be, with its unit in SI."""

SEVERAL = ("position", "velocity", "net_force", "contact_force")
"""What there is a column of for each granule or contact."""

STYLES = (*UNITS, "lj")
"""Styles of LAMMPS's units that numbers can be in; those of lj have no scale."""

_USUAL = {
    "contact": ("contact",), "peak_force": ("peak_force_n",),
    "time": ("time", "time_s", "t", "v_time"), "step": ("step", "timestep"),
}  # fmt: skip
_FORCE = ("f", "fx", "force")  # of granules or contacts, by their number
_PREFIXES = {
    "position": ("x", "xu", "pos", "position"),
    "velocity": ("v", "vx", "vel", "velocity"),
    "net_force": _FORCE,
    "contact_force": (*_FORCE, "fc", "contact", "contact_force"),
}
_LONGEST = 40  # characters of a name in a message (chosen)
_NUMBERED = re.compile(r"(?:[vcf]_)?([A-Za-z][A-Za-z_]*?)_?\[?(\d+)\]?(?:_[A-Za-z/]+)?")
_SPEC = re.compile(r"\s*(?P<name>.*?)\s*(?:\[(?P<unit>[^\[\]]*[^\W\d][^\[\]]*)\])?\s*")


@dataclass(frozen=True)
class Columns:
    """Columns of a table for one role, and what their numbers are worth in SI."""

    where: tuple[int, ...]
    factor: float


@dataclass(frozen=True)
class Asked:
    """What was said of a file: names of columns, which may have *, their units, and all units."""

    names: Mapping[str, str]
    factors: Mapping[str, float]
    scale: Units | None  # of columns without a unit of their own; None for lj

    def factor(self, role: str, file: str) -> float:
        """What a number is worth in SI."""
        if role in self.factors or not DIMENSIONS[role]:
            return self.factors.get(role, 1.0)
        if self.scale is None:
            allowed = (
                "units lj have no scale: give the unit of each column, such as --column"
                f" '{role}={self.names.get(role, 'NAME')} [0.5 {DIMENSIONS[role]}]'"
            )
            raise SceneError("", None, allowed, file=file)
        scale = self.scale
        return {
            "N": scale.force, "s": scale.time, "m": scale.length, "m/s": scale.velocity,
        }[DIMENSIONS[role]]  # fmt: skip


def asked_for(columns: Mapping[str, str], units: str) -> Asked:
    """Read what was said of columns, NAME or NAME [UNIT], and the style of units of the others."""
    require(units in STYLES, "units", units, f"must be one of {', '.join(STYLES)}")
    names, factors = {}, {}
    for role, spec in columns.items():
        require(role in DIMENSIONS, "column", role, f"must be one of {', '.join(DIMENSIONS)}")
        match = _SPEC.fullmatch(str(spec))
        assert match is not None  # of any text
        names[role] = match["name"]
        if match["unit"] is not None:
            allowed = "is a pure number: leave its unit out"
            require(bool(DIMENSIONS[role]), f"column {role}", spec, allowed)
            number = match["unit"] if match["unit"][:1].isdigit() else f"1 {match['unit']}"
            factors[role] = to_si(f"column {role}", number, DIMENSIONS[role])
    return Asked(names, factors, UNITS.get(units))


def columns_of(header: Sequence[str], asked: Asked, scene: Scene, file: str) -> dict[str, Columns]:
    """Return columns of a table by role; a SceneError says what has to be named."""
    at = _usual(header, scene)
    for role, name in asked.names.items():
        found = [k for k, one in enumerate(header) if one == name]
        found = found or [k for k, one in enumerate(header) if fnmatch.fnmatchcase(one, name)]
        if not found:
            allowed = f"is no column of the file, which has {listed(header)}"
            raise SceneError(f"column {role}", name, allowed, file=file)
        at[role] = sorted(found, key=lambda k: _in_order(header[k]))
    columns = {}
    for role, where in at.items():
        wanted = _numbers_of_columns(role, scene) if role in SEVERAL else (1,)
        if len(where) not in wanted:
            several = " or ".join(map(str, wanted))
            allowed = f"stands for {len(where)} columns of the file, must be {several}"
            name = asked.names.get(role, role)
            raise SceneError(f"column {role}", name, allowed, file=file)
        says_its_unit = role not in asked.names and header[where[0]] in ("peak_force_N", "time_s")
        columns[role] = Columns(tuple(where), 1.0 if says_its_unit else asked.factor(role, file))
    return columns


def _numbers_of_columns(role: str, scene: Scene) -> tuple[int, ...]:
    """Return how many columns a role may have: the force on a wall may be left out."""
    if role != "contact_force":
        return (scene.chain.granules,)
    return tuple(dict.fromkeys((scene.chain.granules - 1, scene.last_contact - 1)))


def _usual(header: Sequence[str], scene: Scene) -> dict[str, list[int]]:
    """Return columns that are known by their names, by role."""
    at: dict[str, list[int]] = {}
    for role, names in _USUAL.items():
        found = [k for k, one in enumerate(header) if one.lower() in names]
        if len(found) == 1:
            at[role] = found
    groups: dict[str, list[int]] = {}
    for k, one in enumerate(header):
        if match := _NUMBERED.fullmatch(one):
            groups.setdefault(match[1].lower(), []).append(k)
    for prefix, members in groups.items():
        for role, prefixes in _PREFIXES.items():
            if prefix in prefixes and len(members) in _numbers_of_columns(role, scene):
                at.setdefault(role, sorted(members, key=lambda k: _in_order(header[k])))
    return at


def _in_order(name: str) -> tuple[list[int], str]:
    """A key by which f2 stands before f10."""
    return [int(digits) for digits in re.findall(r"\d+", name)[-1:]], name


def listed(names: Sequence[str]) -> str:
    """The names of columns for a message: the first eight, on one line."""
    cut = [name if len(name) < _LONGEST else f"{name[:_LONGEST]}..." for name in names[:8]]
    shown = ", ".join(name if name.isprintable() else repr(name) for name in cut)
    return f"{shown}, ... ({len(names)} in all)" if len(names) > 8 else shown
