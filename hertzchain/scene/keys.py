"""Keys of scene files as data: unit, range, usual values and label of each field.

A field of a part of a scene that is a key has ``metadata=key(...)``. Checks, reading, remarks on
units, and the columns of sweeps follow from that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from numbers import Integral, Real
from typing import Annotated, Any, Literal

from hertzchain.errors import is_finite, require
from hertzchain.scene.quantities import to_si


@dataclass(frozen=True)
class Key:
    """A key of a section.

    Parameters
    ----------
    unit
        The SI unit; "" for a pure number.
    label
        The label on an axis, without the unit; "" for what cannot vary.
    above, least, below, most
        Bounds of the range: excluded, included, excluded, included; None for no bound.
    usual
        The range without a remark on the unit; None for no remarks.
    kind
        Type of its values.
    choices
        All possible texts.
    advice
        The end of a refusal.
    """

    unit: str = ""
    label: str = ""
    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    usual: tuple[float, float] | None = None
    kind: Literal["float", "int", "str", "bool"] = "float"
    choices: tuple[str, ...] = ()
    advice: str = ""

    @property
    def bounds(self) -> dict[str, float]:
        """The words for each bound, and the bound."""
        known = {
            "above": self.above, "at least": self.least, "below": self.below, "at most": self.most,
        }  # fmt: skip
        return {words: bound for words, bound in known.items() if bound is not None}

    @property
    def is_one_of(self) -> str:
        """The choices, as the end of a sentence; "" without choices."""
        return f"must be one of {', '.join(self.choices)}" if self.choices else ""

    @property
    def allowed(self) -> str:
        """The allowed values, as the end of a sentence."""
        if self.choices:
            return self.is_one_of
        if self.kind == "bool":
            return "must be true or false"
        kind = "a finite number"
        if self.kind == "int":
            kind = "an integer"
            if self.most:
                return f"must be an integer from {self.least} to {self.most}"
        words = " and ".join(f"{words} {bound:g}" for words, bound in self.bounds.items())
        of = " of" if words.startswith("at") else ""
        unit = f" [{self.unit}]" if self.unit else ""
        return f"must be {kind}{of}{words and ' '}{words}{unit}{self.advice}"

    def check(self, name: str, value: object) -> None:
        """Raise a SceneError for a value that is not allowed."""
        require(self._allows(value), name, value, self.allowed)

    def _allows(self, value: Any) -> bool:
        if self.kind == "str":
            return isinstance(value, str) and value in self.choices
        if self.kind == "bool":
            return isinstance(value, bool)
        return (
            is_finite(value)
            and (self.kind == "float" or isinstance(value, Integral))
            and (self.above is None or value > self.above)
            and (self.least is None or value >= self.least)
            and (self.below is None or value < self.below)
            and (self.most is None or value <= self.most)
        )

    def read(self, name: str, value: object) -> Any:
        """Return a value of a scene file in SI; a SceneError names the key."""
        return to_si(name, value, self.unit) if self.kind == "float" else value

    @property
    def axis(self) -> str:
        """The label on an axis, with the unit."""
        unit = self.unit.replace("^3", "³").replace("^2", "²")
        return f"{self.label} [{unit}]" if unit else self.label


Positive = Annotated[float, Key(above=0)]
NotNegative = Annotated[float, Key(least=0)]
Count = Annotated[int, Key(least=1, kind="int")]
Seed = Annotated[int, Key(least=0, most=2**32 - 1, kind="int")]
"""Annotations of arguments that have a range; see ``arguments``."""


def key(*args: Any, **more: Any) -> dict[str, Key]:
    """Return the metadata of a field that is a key; arguments are those of ``Key``."""
    return {"key": Key(*args, **more)}


def of_granule(key: Key, label: str = "") -> Any:
    """A field that is a key of a granule, for a wall or a striker; None by default."""
    return field(default=None, metadata={"key": replace(key, label=label)})


def keys_of(kind: type) -> Mapping[str, Key]:
    """The fields of a part of a scene that are keys; one with a default may be left out."""
    return {one.name: one.metadata["key"] for one in fields(kind) if one.metadata}


def check(part: Any) -> None:
    """Raise a SceneError for the first value of a frozen part that its key does not allow.

    None is allowed where it is the default, and a tuple with a value per granule is checked
    elsewhere. Numbers become Python's own, as files and decks show them.
    """
    keys = keys_of(type(part))
    for one in fields(part):
        value = getattr(part, one.name)
        is_each = isinstance(value, tuple) and str(one.type).startswith("PerGranule")
        is_checked = is_each or (value is None and one.default is None)
        if one.name in keys and not is_checked:
            keys[one.name].check(one.name, value)
        if isinstance(value, Real) and not isinstance(value, bool):
            plain = int(value) if isinstance(value, Integral) else float(value)
            object.__setattr__(part, one.name, plain)
