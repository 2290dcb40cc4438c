"""Known mistakes as families of peaks with one parameter, or none, and what each is called."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import METHODS
from hertzchain.observables.error_bound import stable_step
from hertzchain.scene.pulse import Pulse
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import DAMPING, DampingLaw
from hertzchain.verdict.damping_causes import contact_of, described
from hertzchain.verdict.mistaken import AREAS, OTHER_PROFILES, Mistakes, mistaken_scene
from hertzchain.verdict.slips import force_in_words, stretch_in_words

_STRETCHES = np.linspace(-3.0, 3.0, 31)  # logarithms, as all trials here
_FORCES = np.linspace(-5.0, 5.0, 31)
_DURATIONS = np.linspace(-2.0, 2.0, 9)
_STRENGTHS = np.log(np.geomspace(1e-5, 2.2, 13))
_HELD = (*range(2, 21), 25, 30, 40, 50)  # steps in a pulse; more leave 1e-4 of the peaks
_KNOWN_TO = 1e-3  # relative, of a coefficient found in a pair


@dataclass(frozen=True)
class Family:
    """A known mistake.

    Parameters
    ----------
    kinds
        Of what it is a mistake: two mistakes in one thing are one.
    trials
        Values of the parameter to begin with, increasing; one where there is nothing to fit.
    make
        Makes the mistake with a parameter, on top of others.
    words
        What it is called, from the scene with all mistakes, and those.
    step
        The change of the parameter by which a slope is measured.
    is_stepped
        Whether peaks leap with the parameter, as with whole numbers of steps.
    """

    kinds: frozenset[str]
    trials: FloatArray
    make: Callable[[Mistakes, float], Mistakes]
    words: Callable[[Scene, Mistakes], str]
    step: float = 1e-3
    is_stepped: bool = False

    @property
    def is_fitted(self) -> bool:
        """Whether there is a parameter."""
        return self.trials.size > 1


def families(scene: Scene, dt: float | None) -> list[Family]:
    """The mistakes that can be made in a plain scene; ``dt`` is the step [s], if it is known."""
    found = [
        Family(
            frozenset({"stretch"}),
            _STRETCHES,
            lambda of, x: replace(of, stretch=of.stretch * math.exp(x)),
            lambda _, made: stretch_in_words(scene, made.stretch),
        ),
        Family(
            frozenset({"force"}),
            _FORCES,
            lambda of, x: replace(of, force=math.exp(x)),
            lambda _, made: force_in_words(made.force),
        ),
        _steps(scene, dt),
        *(
            Family(
                frozenset({"damping"}),
                _STRENGTHS if law != "restitution" else _STRENGTHS[:-1],
                partial(_damped, law),
                _damping_in_words,
            )
            for law in DAMPING
        ),
    ]
    found.extend(
        Family(
            frozenset({"granules"}),
            np.zeros(1),
            lambda of, _, extra=extra: replace(of, granules=extra),  # type: ignore[misc]
            lambda _, made: granules_in_words(scene, made.granules),
        )
        for extra in (-1, 1)
    )
    if isinstance(scene.shock, Pulse):
        found += of_pulses(scene.shock)
    return found


def _damped(law: DampingLaw, of: Mistakes, x: float) -> Mistakes:
    return replace(of, law=law, strength=math.exp(x))


def _damping_in_words(wrong: Scene, made: Mistakes) -> str:
    assert made.law
    contact = contact_of(wrong, made.law, made.strength, made.pulls)
    return described(contact, _KNOWN_TO) + (", with contacts that pull" if made.pulls else "")


def _steps(scene: Scene, dt: float | None) -> Family:
    """Steps of velocity Verlet, to be found or known."""
    unit = scene.units.time
    longest = 0.8 * stable_step(scene, METHODS["velocity-verlet"].interval) / unit
    trials = np.log(longest * np.geomspace(0.02, 1.0, 14))
    if dt is not None:
        trials = np.log(np.array([dt / unit]))
    return Family(
        frozenset({"steps"}),
        trials,
        lambda of, x: replace(of, dt=math.exp(x)),
        lambda wrong, made: steps_in_words(made.dt * wrong.units.time),
        step=0.03,
        is_stepped=True,
    )


def steps_in_words(dt: float) -> str:
    """What velocity Verlet with such a step is called."""
    return f"velocity Verlet with steps of about {dt:.3g} s"


def granules_in_words(scene: Scene, extra: int) -> str:
    """What a chain with more granules is called."""
    granules = scene.chain.granules
    return f"a chain of {granules + extra} granules, not {granules}"


def of_pulses(pulse: Pulse) -> Iterator[Family]:
    """Mistakes in one of the three pulses."""
    n = pulse.duration_ratio

    def words(_: Scene, made: Mistakes, whole: str) -> str:
        ratio = 1 + made.duration * (n - 1)
        return f"duration ratio {ratio:.4g} in place of {n:g}, {whole}"

    yield Family(
        frozenset({"duration"}),
        _DURATIONS,
        lambda of, x: replace(of, duration=math.exp(x)),
        partial(words, whole="at the same rise time"),
    )
    yield Family(
        frozenset({"duration", "stretch"}),
        _DURATIONS,
        lambda of, x: replace(
            of, duration=math.exp(x), stretch=of.stretch * n / (1 + math.exp(x) * (n - 1))
        ),
        partial(words, whole="in a pulse that lasts as long"),
    )
    for profile in OTHER_PROFILES:
        if profile == pulse.profile:
            continue
        yield Family(
            frozenset({"profile"}),
            np.zeros(1),
            lambda of, _, profile=profile: replace(of, profile=profile),  # type: ignore[misc]
            lambda _, made: profile_in_words(pulse, made.profile),
        )
        if profile in AREAS:
            shorter = 0.5 / AREAS[profile]
            yield Family(
                frozenset({"profile", "stretch"}),
                np.zeros(1),
                lambda of, _, profile=profile, shorter=shorter: replace(  # type: ignore[misc]
                    of, profile=profile, stretch=of.stretch * shorter
                ),
                lambda _, made: profile_in_words(pulse, made.profile) + ", of the same impulse",
            )
    for held in _HELD:
        yield Family(
            frozenset({"profile", "held"}),
            np.zeros(1),
            lambda of, _, held=held: replace(of, held=held),  # type: ignore[misc]
            lambda _, made: f"force held constant in {made.held} steps of the pulse",
        )


def profile_in_words(pulse: Pulse, profile: str) -> str:
    """What another profile is called."""
    return f"profile {profile} in place of {pulse.profile}"


def words_of(scene: Scene, family: Family, made: Mistakes) -> str:
    """What a mistake is called, made together with others."""
    return family.words(mistaken_scene(scene, replace(made, law="")), made)
