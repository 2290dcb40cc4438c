"""A scene: a chain, a shock and how long to watch; read from TOML and written to it."""

from __future__ import annotations

import functools
import math
import sys
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import POSITIVE, SceneError, is_positive, require
from hertzchain.files import read_bytes
from hertzchain.scene.chain import Chain, to_plain_numbers
from hertzchain.scene.natural_units import NaturalUnits, natural_units, unit_ratio_momentum
from hertzchain.scene.pulse import Pulse, PulseTable, Ramp, read_pulse_table
from hertzchain.scene.quantities import to_si
from hertzchain.scene.schedule import Leg, lay_steps

_Kind = TypeVar("_Kind")

# The SI unit of each quantity of the scene file; keys that are not here take no unit.
UNITS = {
    "radius": "m",
    "young_modulus": "Pa",
    "poisson_ratio": "",
    "density": "kg/m^3",
    "peak_force": "N",
    "duration_ratio": "",
    "momentum_ratio": "",
    "rise_time": "s",
    "end_time": "s",
}
_OPTIONAL = {"momentum_ratio", "rise_time", "end_time"}
_MOST_BYTES = 100_000
"""Of a scene file; that of `make demo` has 500."""
_MOST_DOTS = 200
"""In a line: a dotted key costs tomllib the square of its dots, 35 s where it has 32,000."""
_WAVE_SPEED = 0.9055
"""Granules per natural time unit of a wave of height 1; it only decides how long to watch."""


@dataclass(frozen=True)
class Run:
    """How long to watch.

    Parameters
    ----------
    end_time
        End of the run [s]; None for the default, long enough for every contact to peak.

    Raises
    ------
    SceneError
        If the end time is not a finite number above 0.
    """

    end_time: float | None = None

    def __post_init__(self) -> None:
        if self.end_time is not None:
            require(is_positive(self.end_time), "end_time", self.end_time, f"{POSITIVE} [s]")
            to_plain_numbers(self)


@dataclass(frozen=True)
class Scene:
    """One shock on one chain.

    Parameters
    ----------
    chain
        The granules.
    shock
        The force on the first of them.
    run
        How long to watch.
    terms
        What the scene has beyond a uniform chain with free ends, at rest before its shock; no such
        term is known yet.

    Raises
    ------
    SceneError
        If a part is of another type, or the numbers, each possible in itself, together leave the
        range of floating point or lose digits there.
    """

    chain: Chain
    shock: Pulse | PulseTable
    run: Run = Run()
    terms: tuple[Any, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        require(isinstance(self.chain, Chain), "chain", self.chain, "must be a Chain")
        allowed = "must be a Pulse or a PulseTable"
        require(isinstance(self.shock, Pulse | PulseTable), "shock", self.shock, allowed)
        require(isinstance(self.run, Run), "run", self.run, "must be a Run")
        require(self.terms == (), "terms", self.terms, "must be (): no term is known")
        try:
            representable = _is_representable(self)
        except (OverflowError, ZeroDivisionError):
            representable = False
        if not representable:
            raise SceneError(
                "scene",
                None,
                "its mass, contact time or duration is too large or too small to be"
                " represented; check the units of chain and shock",
            )

    @classmethod
    def from_toml(cls, path: Path | str) -> Scene:
        """Read a scene file.

        Parameters
        ----------
        path
            A TOML file with the sections chain, shock and, optionally, run. Bare numbers are SI,
            strings carry units.

        Raises
        ------
        SceneError
            If the file cannot be read, is not TOML, or does not describe a possible scene; it
            names file, key, value and what is allowed.
        """
        path = Path(path)
        document = _load(path)
        try:
            return _scene(document, path.parent)
        except SceneError as problem:
            raise SceneError(
                problem.key, problem.value, problem.allowed, problem.file or path
            ) from None

    def to_toml(self, path: Path | str) -> None:
        """Write a scene file that reads back as an equal scene; a pulse table goes beside it.

        Parameters
        ----------
        path
            The TOML file. A table is written next to it as ``<name of the scene>.csv``.

        Raises
        ------
        OutputError
            If a file cannot be written; neither is then.
        """
        from hertzchain.files import write_texts

        write_texts(self.to_texts(path))

    def to_texts(self, path: Path | str) -> dict[Path, str]:
        """What ``to_toml`` writes, by where to: the pulse table, if there is one, then the TOML."""
        import tomli_w

        path = Path(path)
        texts: dict[Path, str] = {}
        shock: dict[str, object] = {}
        if isinstance(self.shock, PulseTable):
            table = path.with_suffix(".csv")
            allowed = "must not end in .csv: the pulse table is written under that name"
            require(table != path, "path", str(path), allowed)
            rows = zip(self.shock.time, self.shock.force, strict=True)
            lines = ["time_s,force_N", *(f"{time!r},{force!r}" for time, force in rows)]
            texts[table] = "\n".join(lines) + "\n"
            shock = {"profile": "table", "file": table.name}
        else:
            shock = _given(self.shock)
        document: dict[str, object] = {"chain": _given(self.chain), "shock": shock}
        if self.run.end_time is not None:
            document["run"] = {"end_time": self.run.end_time}
        return {**texts, path: tomli_w.dumps(document)}

    @property
    def is_plain(self) -> bool:
        """Whether there are no terms; what was calibrated holds for such scenes alone."""
        return not self.terms

    @functools.cached_property
    def units(self) -> NaturalUnits:
        """The natural units of this scene."""
        return natural_units(self.chain, self.shock.peak_force)

    @property
    def rise_time(self) -> float | None:
        """t0 [s]; None for a pulse table, which has none."""
        if isinstance(self.shock, PulseTable):
            return None
        if self.shock.rise_time is not None:
            return self.shock.rise_time
        assert self.shock.momentum_ratio is not None
        return self.shock.momentum_ratio * self._unit_rise_time(self.shock)

    @property
    def momentum_ratio(self) -> float:
        """LM_ratio, the impulse over L_SW(F0), always with the paper's 139/32."""
        if isinstance(self.shock, PulseTable):
            return self.impulse / unit_ratio_momentum(self.chain, self.shock.peak_force)
        if self.shock.momentum_ratio is not None:
            return self.shock.momentum_ratio
        assert self.shock.rise_time is not None
        return self.shock.rise_time / self._unit_rise_time(self.shock)

    def _unit_rise_time(self, pulse: Pulse) -> float:
        """t0_hat [s]: the rise time at which the impulse is L_SW(F0). The area is F0 n t0 / 2."""
        momentum = unit_ratio_momentum(self.chain, pulse.peak_force)
        return 2 * momentum / (pulse.duration_ratio * pulse.peak_force)

    @functools.cached_property
    def ramps(self) -> tuple[Ramp, ...]:
        """The applied force as ramps between its corners [s, N]."""
        if isinstance(self.shock, PulseTable):
            return self.shock.ramps()
        assert self.rise_time is not None
        return self.shock.ramps(self.rise_time)

    @property
    def impulse(self) -> float:
        """Integral of the whole applied force over time [N s]."""
        return math.fsum(ramp.impulse for ramp in self.ramps)

    @property
    def applied_impulse(self) -> float:
        """Integral of the applied force up to the end of the run [N s]."""
        end = self.end_time  # of all ramps of a table, so not to be asked for each
        return math.fsum(
            ramp.impulse if ramp.end <= end else ramp.impulse_until(end)
            for ramp in self.ramps
            if ramp.start < end
        )

    @property
    def end_time(self) -> float:
        """End of the run [s], as given, or long enough for the wave to pass every contact."""
        if self.run.end_time is not None:
            return self.run.end_time
        watched = watched_time(self.chain.granules, self.momentum_ratio)
        return self.ramps[-1].end + float(watched) * self.units.time

    def applied_force(self, time: FloatArray) -> FloatArray:
        """F(t) [N] at any times [s], before and after the pulse too, of the shape of ``time``."""
        if isinstance(self.shock, PulseTable):
            return np.interp(time, self.shock.time, self.shock.force, left=0.0, right=0.0)
        force = np.zeros_like(time, np.float64)
        for ramp in self.ramps:
            inside = (time >= ramp.start) & (time < ramp.end)
            force = np.where(inside, ramp.force(time), force)
        return force

    def schedule(self, dt: float) -> tuple[Leg, ...]:
        """The steps of a run with steps of at most ``dt`` [s], ending at the pulse's corners."""
        return lay_steps(self.ramps, self.end_time, dt)


def _is_representable(scene: Scene) -> bool:
    """Whether a scene's quantities, and all numbers on the way to them, are normal: no digit lost.

    Nothing divides here by a number that was not checked.
    """
    chain, force = scene.chain, scene.shock.peak_force
    mass, stiffness = chain.granule_mass, chain.contact_stiffness
    of_chain = (chain.radius**3, mass, chain.young_modulus / 3, stiffness, force)
    if not all(map(_is_normal, of_chain)) or not _is_normal(force / stiffness):
        return False
    units = scene.units
    of_units = (units.length, mass * units.length, units.time**2, units.velocity)
    if not all(map(_is_normal, (*of_units, units.momentum, units.energy))):
        return False
    return _is_normal(scene.momentum_ratio) and all(
        map(_is_normal, (scene.ramps[0].end, scene.end_time))
    )


def _is_normal(value: float) -> bool:
    return sys.float_info.min <= value < math.inf


def require_scene(scene: object) -> None:
    """Raise a SceneError for what is no scene, such as the name of its file."""
    allowed = "must be a Scene, as Scene.from_toml reads it"
    require(isinstance(scene, Scene), "scene", scene, allowed)


def watched_time(granules: Any, momentum_ratio: Any) -> Any:
    """How long a chain is watched after its pulse, where nothing is said [natural time units]."""
    speed = _WAVE_SPEED * np.minimum(1.0, momentum_ratio) ** 0.2
    return 1.2 * (granules + 5) / speed


def _load(path: Path) -> dict[str, Any]:
    try:
        content = read_bytes(path, _MOST_BYTES)
    except IsADirectoryError:
        raise SceneError("", None, "is a directory, must be a TOML file", path) from None
    except (OSError, ValueError) as problem:  # ValueError: a null in the name
        reason = getattr(problem, "strerror", None) or problem
        raise SceneError(
            "", None, f"cannot be read ({reason}), must be a TOML file", path
        ) from None
    try:
        text = content.decode()
        if any(line.count(".") > _MOST_DOTS for line in text.split("\n")):
            raise ValueError(f"a line with more than {_MOST_DOTS} dots")  # noqa: TRY301
        return tomllib.loads(text)
    except (ValueError, RecursionError) as problem:  # not UTF-8, not TOML, or not to be counted
        hint = '; a value with a unit stands in quotes, "103 GPa"'
        raise SceneError("", None, f"is not TOML: {problem!s:.200}{hint}", path) from None


def _scene(document: Mapping[str, Any], folder: Path) -> Scene:
    sections = {"chain", "shock", "run"}
    for key, value in document.items():
        allowed = f"unknown key, allowed are the sections {', '.join(sorted(sections))}"
        require(key in sections, key, value, allowed)
        require(isinstance(value, dict), key, value, f"must be a section, [{key}]")
    for key in ("chain", "shock"):
        require(key in document, f"[{key}]", None, "missing section")
    return Scene(
        _section("chain", document["chain"], Chain),
        _shock(document["shock"], folder),
        _section("run", document.get("run", {}), Run),
    )


def _shock(section: Mapping[str, Any], folder: Path) -> Pulse | PulseTable:
    if section.get("profile") != "table":
        return _section("shock", section, Pulse)
    for key, value in section.items():
        require(
            key in ("profile", "file"),
            f"shock.{key}",
            value,
            'not allowed with profile = "table", which takes only file',
        )
    name = section.get("file")
    require("file" in section, "shock.file", None, 'missing, profile = "table" needs it')
    require(isinstance(name, str), "shock.file", name, "must be the name of a CSV file")
    return read_pulse_table(folder / str(name), str(name))


def _section(name: str, section: Mapping[str, Any], kind: Callable[..., _Kind]) -> _Kind:
    """Build one frozen object from its section; errors name the key with its section."""
    known = [item.name for item in fields(kind)]  # type: ignore[arg-type]
    values: dict[str, object] = {}
    for key, value in section.items():
        full = f"{name}.{key}"
        require(key in known, full, value, f"unknown key, allowed are {', '.join(known)}")
        values[key] = to_si(full, value, UNITS[key]) if key in UNITS else value
    for key in known:
        require(key in values or key in _OPTIONAL, f"{name}.{key}", None, "missing")
    try:
        return kind(**values)
    except SceneError as problem:
        given = section.get(problem.key, problem.value)
        raise SceneError(f"{name}.{problem.key}", given, problem.allowed) from None


def _given(part: Chain | Pulse) -> dict[str, object]:
    """The fields of a frozen object that are not left to their default."""
    values = {item.name: getattr(part, item.name) for item in fields(part)}
    return {key: value for key, value in values.items() if value is not None}
