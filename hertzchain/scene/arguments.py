"""Arguments of public functions and classes, checked against their annotations before any work."""

from __future__ import annotations

import builtins
import collections.abc
import functools
import inspect
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from types import FunctionType, NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, is_finite, require
from hertzchain.scene.keys import Key

_Public = TypeVar("_Public")

_PLAIN: dict[Any, Key] = {float: Key(), int: Key(kind="int"), bool: Key(kind="bool")}
"""Keys of numbers whose annotation has no range of its own."""


class _Kind(NamedTuple):
    """An annotation: its words in a refusal, and a function that returns a value or refuses it."""

    words: str
    read: Callable[[str, Any], Any]


class _Names(dict[str, Any]):
    """Names in annotations; a name that only type checkers import is a module or anything."""

    def __missing__(self, name: str) -> Any:
        try:
            return import_module(name)
        except ImportError:
            return Any


def checked(public: _Public) -> _Public:
    """Return a public function or class that refuses arguments which its annotations exclude.

    The refusal is a SceneError that names the argument; numbers of other types, such as NumPy's,
    become Python's own. A class is changed in place, as is a class that a function returns: its
    methods, and its constructor if it has rules for its fields (``__post_init__``).
    """
    if isinstance(public, FunctionType):
        return _checked(public, {})  # type: ignore[no-any-return]
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

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        arguments = signature.bind(*given, **named)
        for name, value in arguments.arguments.items():
            if name in kinds():
                arguments.arguments[name] = kinds()[name].read(name, value)
        return function(*arguments.args, **arguments.kwargs)

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
        return _Kind("an array of numbers", _read_array)
    if origin in (Union, UnionType):
        return _either([_kind(one) for one in inner])
    if origin is Annotated:
        return _of_key(inner[1]) if isinstance(inner[1], Key) else _kind(Any)
    if origin is Literal:
        return _of_key(Key(kind="str", choices=inner))
    if annotation in _PLAIN:
        return _of_key(_PLAIN[annotation])
    if annotation in (Path, os.PathLike) or origin is os.PathLike:
        return _of_class("a path", os.PathLike)
    if inspect.isclass(origin) and issubclass(origin, Mapping):
        return _mapping(*map(_kind, inner))
    if inspect.isclass(origin) and issubclass(origin, Iterable) and origin is not np.ndarray:
        return _sequence(inner)
    if origin is collections.abc.Callable:
        return _of_class("a function", Callable)  # type: ignore[arg-type]
    if annotation in (None, NoneType):
        return _of_class("None", NoneType)
    if annotation is str:
        return _of_class("text", str)
    is_protocol = getattr(annotation, "_is_protocol", False)
    if not inspect.isclass(annotation) or annotation in (Any, object) or is_protocol:
        return _Kind("anything", lambda _, value: value)
    kinds = annotation.__subclasses__() if inspect.isabstract(annotation) else [annotation]
    words = [f"{'an' if one.__name__[0] in 'AEIOU' else 'a'} {one.__name__}" for one in kinds]
    return _of_class(_listed(words), annotation)


def _of_class(words: str, kind: type) -> _Kind:
    def read(name: str, value: Any) -> Any:
        shown = None if value is None else type(value).__name__
        require(isinstance(value, kind), name, shown, f"must be {words}")
        return value

    return _Kind(words, read)


def _of_key(key: Key) -> _Kind:
    def read(name: str, value: Any) -> Any:
        if isinstance(value, np.bool_) and key.kind == "bool":
            return bool(value)
        key.check(name, value)
        return {"float": float, "int": int}.get(key.kind, lambda same: same)(value)

    return _Kind(key.allowed.removeprefix("must be "), read)


def _read_array(name: str, value: Any) -> Any:
    try:
        array = np.asarray(value)
        if array.dtype == object and all(map(is_finite, array.flat)):
            array = value = array.astype(float)
        possible = array.dtype.kind in "iuf"
    except (TypeError, ValueError):  # rows of unlike length
        possible = False
    require(possible, name, value, "must be an array of numbers")
    return value if isinstance(value, int) else array


def _sequence(inner: tuple[Any, ...]) -> _Kind:
    is_fixed = len(inner) > 1 and inner[-1] is not Ellipsis
    kinds = [_kind(one) for one in inner if one is not Ellipsis]
    words = f"a list, each entry {kinds[0].words}"
    if is_fixed:
        words = f"{len(kinds)} values, each {kinds[0].words}"

    def read(name: str, values: Any) -> Any:
        is_one = isinstance(values, str | bytes | Mapping) or getattr(values, "shape", None) == ()
        require(isinstance(values, Iterable) and not is_one, name, values, f"must be {words}")
        if isinstance(values, Iterator):  # it may be long
            return (kinds[0].read(name, value) for value in values)
        values = tuple(values)
        require(not is_fixed or len(values) == len(kinds), name, values, f"must be {words}")
        each = kinds if is_fixed else kinds * len(values)
        return tuple(
            kind.read(f"{name} {number}", value)
            for number, (kind, value) in enumerate(zip(each, values, strict=True), start=1)
        )

    return _Kind(words, read)


def _mapping(keys: _Kind, values: _Kind) -> _Kind:
    def read(name: str, given: Any) -> Any:
        require(isinstance(given, Mapping), name, given, "must be a mapping")
        return {
            keys.read(f"a key of {name}", key): values.read(f"{name} of {key}", value)
            for key, value in given.items()
        }

    return _Kind("a mapping", read)


def _either(kinds: list[_Kind]) -> _Kind:
    several = [kind.words for kind in kinds if kind.words != "None"]

    def read(name: str, value: Any) -> Any:
        refusals = []
        for kind in kinds:
            try:
                return kind.read(name, value)
            except SceneError as refusal:
                refusals.append(refusal)
        if value is None or len(several) > 1:
            raise SceneError(name, value, f"must be {_listed(several)}")
        raise refusals[0]

    return _Kind(_listed(several), read)


def _listed(words: list[str]) -> str:
    return " or ".join([*filter(None, [", ".join(words[:-1])]), *words[-1:]])
