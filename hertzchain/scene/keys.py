"""Numbers with units; keys of scene files as data: unit, range, usual values, label; arguments."""

from __future__ import annotations

import builtins
import collections.abc
import functools
import inspect
import os
import re
import sys
from abc import ABC
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from importlib import import_module
from numbers import Integral, Real
from pathlib import Path
from types import FunctionType, NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Literal,
    NamedTuple,
    NoReturn,
    TypeVar,
    Union,
    get_args,
    get_origin,
)

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, did_you_mean, is_finite

if TYPE_CHECKING:
    import pint


Section = Mapping[str, Any]
"""Values by keys: of a section or a whole scene file, of a part of a scene, or of a manifest."""

# A number, then names with small powers, which may end in .5, multiplied and divided. Pint would
# also evaluate arithmetic, which a scene does not need and which can be made to run without end.
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:inf|nan)"
_FACTOR = r"[^\W\d_][^\W\d]*(?:\s*(?:\*\*|\^)\s*-?\d{1,2}(?:\.5)?)?"
_QUANTITY = re.compile(
    rf"\s*(?P<number>{_NUMBER})\s*(?P<unit>{_FACTOR}(?:\s*[*/]\s*{_FACTOR}|\s+{_FACTOR})*)?\s*"
)


def to_si(key: str, value: object, unit: str) -> float:
    """Convert a number in SI, or a string of number and unit, to ``unit`` ("" for a pure number).

    A SceneError names the ``key`` if the value is neither, or has a unit of another dimension.
    """
    example = f"a number [{unit}] or a string such as '1 {unit}'" if unit else "a number"
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            raise SceneError(key, value, f"must be finite: {example}") from None
    is_short = isinstance(value, str) and len(value) <= 80  # chosen: long texts take long to match
    match = _QUANTITY.fullmatch(str(value)) if is_short else None
    if match is None:
        raise SceneError(key, value, f"must be {example}")
    number = float(match["number"])
    if match["unit"] is None:
        return number
    if (factor := _UNITS.get(unit, {}).get(match["unit"])) is not None:
        converted = number * factor
    else:
        converted = _by_pint(key, value, number, match["unit"], unit, example)
    # 8.5 g/cm^3 is 8500 kg/m^3, not 8499.999999999998; a value in SI is not changed.
    return number if converted == number else float(f"{converted:.15g}")


# Pint knows these units too, but loading it takes half a second, a thousand times as long as a run.
_UNITS = {
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "nm": 1e-9},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "TPa": 1e12, "N/m^2": 1.0},
    "m/s": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "km/s": 1e3},
    "kg/m^3": {"kg/m^3": 1.0, "kg/m**3": 1.0, "g/cm^3": 1e3, "g/cm**3": 1e3},
    "N": {"N": 1.0, "kN": 1e3, "MN": 1e6, "mN": 1e-3, "uN": 1e-6, "µN": 1e-6},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
}
"""SI units, each with other units and their value in it."""


def _by_pint(key: str, value: object, number: float, given: str, unit: str, example: str) -> float:
    import pint

    registry = _registry()
    try:
        wanted = registry.Unit(unit or "dimensionless")
        return float(registry.Quantity(number, given).to(wanted).magnitude)
    except pint.DimensionalityError as problem:
        wrong = f"has the wrong dimension ({problem.dim1 or given}), must be {example}"
        alike = [name for name in _UNITS.get(unit, {}) if name.lower() == given.lower()]
        raise SceneError(key, value, wrong + did_you_mean(given, alike)) from None
    except pint.UndefinedUnitError:
        meant = did_you_mean(given, _UNITS.get(unit, {}))
        raise SceneError(key, value, f"unknown unit {given!r}, must be {example}{meant}") from None
    except Exception:
        # Pint raises many kinds of error for text that is not a unit, tokenizer errors among them.
        raise SceneError(key, value, f"cannot be understood, must be {example}") from None


@functools.cache
def _registry() -> pint.UnitRegistry[float]:
    import pint

    return pint.UnitRegistry()


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
        """The bounds that are given, by their words in messages, such as "at least"."""
        limits = {
            "above": self.above, "at least": self.least, "below": self.below, "at most": self.most,
        }  # fmt: skip
        return {words: bound for words, bound in limits.items() if bound is not None}

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
        words = " and ".join(f"{words} {bound:.15g}" for words, bound in self.bounds.items())
        of = " of" if words.startswith("at") else ""
        unit = f" [{self.unit}]" if self.unit else ""
        return f"must be {kind}{of}{words and ' '}{words}{unit}{self.advice}"

    def check(self, name: str, value: object) -> None:
        """Raise a SceneError for a value that is not allowed."""
        if not self._allows(value):  # the words take longer than the check
            raise SceneError(name, value, self.allowed)

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
"""Annotations of arguments that have a range; see ``checked``."""


def key(*args: Any, **more: Any) -> dict[str, Key]:
    """Return the metadata of a field that is a key; for arguments see ``Key``."""
    return {"key": Key(*args, **more)}


def optional(*args: Any, **more: Any) -> Any:
    """A field that is a key, None by default; for arguments see ``Key``."""
    return field(default=None, metadata=key(*args, **more))


def alike(part: type, name: str, label: str = "") -> Any:
    """A field with the key of another part, such as a granule's for a wall; None by default."""
    return field(default=None, metadata={"key": replace(keys_of(part)[name], label=label)})


def keys_of(kind: type) -> Mapping[str, Key]:
    """The fields of a part of a scene that are keys; one with a default may be left out."""
    return {field.name: field.metadata["key"] for field in fields(kind) if field.metadata}


def check(part: Any) -> None:
    """Raise a SceneError for the first value of a frozen part that its key does not allow.

    None is allowed where it is the default, and a tuple with a value per granule is checked
    elsewhere. Numbers become Python's own, as files and decks show them.
    """
    for item in fields(part):
        value = getattr(part, item.name)
        is_each = isinstance(value, tuple) and str(item.type).startswith("PerGranule")
        is_checked = is_each or (value is None and item.default is None)
        if item.metadata and not is_checked:
            item.metadata["key"].check(item.name, value)
        if isinstance(value, Real) and not isinstance(value, bool):
            plain = int(value) if isinstance(value, Integral) else float(value)
            object.__setattr__(part, item.name, plain)


# Arguments of public functions and classes, checked against their annotations before any work

_Public = TypeVar("_Public")

_NUMBER_KEYS: dict[Any, Key] = {float: Key(), int: Key(kind="int"), bool: Key(kind="bool")}
"""Keys of numbers whose annotation has no range of its own."""

_CLASSES: dict[Any, tuple[str, Any]] = {
    str: ("text", str),
    Path: ("a path", os.PathLike),
    os.PathLike: ("a path", os.PathLike),
    NoneType: ("None", NoneType),
    collections.abc.Callable: ("a function", collections.abc.Callable),
}
"""Words for classes whose name is not public, and the class of their values."""


class _Kind(NamedTuple):
    """An annotation: its words in a refusal, and a function that returns a value or raises."""

    words: str
    read: Callable[[Any], Any]


_ANY_KIND = _Kind("anything", lambda value: value)
_READING_ERRORS = (AttributeError, TypeError, ValueError, OverflowError)


class _Names(dict[str, Any]):
    """Names in annotations; a name that only type checkers import is pandas or anything."""

    def __missing__(self, name: str) -> Any:
        return import_module(name) if name == "pandas" else Any


def checked(public: _Public) -> _Public:
    """Return a public function or class that refuses arguments which its annotations exclude.

    The refusal is a SceneError that names the argument; numbers of other types, such as NumPy's,
    become Python's own. A class is changed in place, as is a class that a function returns: its
    methods, and its constructor if it has rules for its fields (``__post_init__``).
    """
    if isinstance(public, FunctionType):
        function: Any = public
        wrapped, home = _checked(function, {}), sys.modules[function.__module__]
        if getattr(home, function.__name__, None) is public:  # pickle finds a function there
            setattr(home, function.__name__, wrapped)
        return wrapped  # type: ignore[no-any-return]
    if not inspect.isclass(public):
        return public
    bases = [base for base in public.__mro__ if base.__module__.startswith("hertzchain.")]
    for base in bases:
        for name, member in list(vars(base).items()):
            function = member.__func__ if isinstance(member, classmethod) else member
            is_public = not name.startswith("_")
            is_public |= name == "__init__" and hasattr(public, "__post_init__")
            if is_public and isinstance(function, FunctionType):
                fields = getattr(base, "__dataclass_fields__", {}) if name == "__init__" else {}
                wrapped = _checked(function, fields)
                setattr(base, name, type(member)(wrapped) if function is not member else wrapped)
    return public


def _checked(function: Any, fields: Mapping[str, Any]) -> Any:
    if hasattr(function, "__wrapped__"):
        return function
    signature = inspect.signature(function)

    @functools.cache
    def kinds() -> dict[str, _Kind]:
        names = _Names(vars(builtins) | vars(import_module(function.__module__)))
        checked(_evaluated(signature.return_annotation, names))
        return {
            name: _kind(_evaluated(parameter.annotation, names))
            for name, parameter in signature.parameters.items()
            if parameter.annotation is not parameter.empty
            and not (name in fields and fields[name].metadata)  # checked as keys of a scene
        }

    names = tuple(signature.parameters)

    def read(name: str, value: Any) -> Any:
        kind = kinds().get(name)
        if kind is None:
            return value
        try:
            return kind.read(value)
        except _READING_ERRORS:
            raise SceneError(name, value, f"must be {kind.words}") from None

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        # Quicker than binding them to the signature, and the function refuses what is too much.
        first = [*map(read, names, given), *given[len(names) :]]
        return function(*first, **{name: read(name, value) for name, value in named.items()})

    return call


def _evaluated(annotation: Any, names: _Names) -> Any:
    try:
        return eval(annotation, {}, names) if isinstance(annotation, str) else annotation  # noqa: S307
    except (AttributeError, TypeError):  # of a name that only type checkers have
        return Any


def _kind(annotation: Any) -> _Kind:  # noqa: PLR0911 - one for each kind of annotation
    """Return how values of an annotation are read."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if annotation in (ArrayLike, FloatArray):
        return _Kind("an array of numbers", _to_array)
    if origin in (Union, UnionType):
        kinds = [_kind(hint) for hint in inner if hint is not NoneType]
        words, optional = _listed([kind.words for kind in kinds]), NoneType in inner
        return _Kind(
            words, lambda value: None if optional and value is None else _first(kinds, value)
        )
    if origin is Annotated:
        return _of_key(inner[1]) if isinstance(inner[1], Key) else _ANY_KIND
    if origin is Literal:
        return _of_key(Key(kind="str", choices=inner))
    if annotation in _NUMBER_KEYS:
        return _of_key(_NUMBER_KEYS[annotation])
    if annotation in _CLASSES or origin in _CLASSES:
        return _of_class(*_CLASSES[origin or annotation])
    if inspect.isclass(origin) and issubclass(origin, Mapping):
        keys, values = map(_kind, inner)
        return _Kind(
            "a mapping",
            lambda given: {keys.read(key): values.read(value) for key, value in given.items()},
        )
    if inspect.isclass(origin) and issubclass(origin, Iterable) and origin is not np.ndarray:
        kinds = [_kind(hint) for hint in inner if hint is not Ellipsis]
        count = len(kinds) if len(inner) > 1 and inner[-1] is not Ellipsis else None
        words = "a list, each entry" if count is None else f"{count} values, each"
        return _Kind(f"{words} {kinds[0].words}", lambda given: _to_list(kinds, count, given))
    is_protocol = getattr(annotation, "_is_protocol", False)
    if not inspect.isclass(annotation) or annotation in (Any, object) or is_protocol:
        return _ANY_KIND
    names = [cls.__name__ for cls in _concrete(annotation)]
    words = _listed([f"{'an' if name[0] in 'AEIOU' else 'a'} {name}" for name in names])
    return _of_class(words, annotation)


def _concrete(kind: type) -> list[type]:
    """Return the classes derived from an abstract one that are not abstract; else the class."""
    if ABC not in kind.__bases__ and not inspect.isabstract(kind):
        return [kind]
    derived: list[type] = kind.__subclasses__()
    return [leaf for each in derived for leaf in _concrete(each)]


def _of_class(words: str, kind: type) -> _Kind:
    return _Kind(words, lambda value: value if isinstance(value, kind) else _refuse())


def _of_key(key: Key) -> _Kind:
    def read(value: Any) -> Any:
        if isinstance(value, np.bool_) and key.kind == "bool":
            return bool(value)
        key.check("", value)
        return {"float": float, "int": int}.get(key.kind, lambda same: same)(value)

    return _Kind(key.allowed.removeprefix("must be "), read)


def _refuse() -> NoReturn:
    raise ValueError


def _first(kinds: list[_Kind], value: Any) -> Any:
    for kind in kinds:
        with suppress(*_READING_ERRORS):
            return kind.read(value)
    return _refuse()


def _to_array(value: Any) -> Any:
    array = np.asarray(value)
    if array.dtype == object and all(map(is_finite, array.flat)):
        array = value = array.astype(float)
    if array.dtype.kind not in "iuf":
        _refuse()
    return value if isinstance(value, int) else array


def _to_list(kinds: list[_Kind], count: int | None, values: Any) -> Any:
    if isinstance(values, str | bytes | Mapping):
        _refuse()
    if isinstance(values, Iterator):  # it may be long: each entry is checked where it is used
        return values
    given = tuple(values)
    if count not in (None, len(given)):
        _refuse()
    each = kinds if count is not None else kinds * len(given)
    return tuple(kind.read(value) for kind, value in zip(each, given, strict=True))


def _listed(words: list[str]) -> str:
    return " or ".join([*filter(None, [", ".join(words[:-1])]), *words[-1:]])
