"""Arguments of public functions and classes, checked against their annotations before any work."""

from __future__ import annotations

import builtins
import collections.abc
import functools
import inspect
import os
import sys
from abc import ABC
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from types import FunctionType, NoneType, UnionType
from typing import (
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
from hertzchain.errors import SceneError, is_finite
from hertzchain.scene.keys import Key

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
