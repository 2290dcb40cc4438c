"""The spread of results: a scene with uncertain values, run many times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from statistics import NormalDist
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.backend import Native, with_end
from hertzchain.engines.native.batch import run_each
from hertzchain.errors import SceneError, require
from hertzchain.limits import TIME_LIMIT, Deadline
from hertzchain.observables.result import Result, context_of
from hertzchain.progress import ShowProgress, telling
from hertzchain.report.document import describe, in_prefixed
from hertzchain.scene.chain import Chain
from hertzchain.scene.keys import Key, Seed
from hertzchain.scene.scene import Scene, SceneLike, to_scene
from hertzchain.scene.schedule import Run
from hertzchain.scene.terms import Gauge, Uncertain
from hertzchain.sweeps.columns import base_values, changed, full_key, is_whole
from hertzchain.sweeps.design import sobol_points

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure
    from rich.console import Console

    from hertzchain.report.picture import Picture


MOST_DRAWN = 21_201
"""Most independent values of a realisation: dimensions of SciPy's Sobol sequences."""


class Realisations:
    """Scenes with drawn values, as many as a power of 2, by a scrambled Sobol sequence.

    SceneError if nothing is uncertain, for keys that cannot vary, and for a share of a value that
    is 0.
    """

    def __init__(self, scene: Scene, count: int, seed: int) -> None:
        allowed = "nothing is uncertain: add [uncertainty] or [scatter] to the scene"
        require(len(scene.uncertain) > 0, "scene", None, allowed)
        self._base = replace(scene, uncertain=())
        self.inputs = [entry for entry in scene.uncertain if not entry.each]
        self._scatter = [entry for entry in scene.uncertain if entry.each]
        self._middle = dict(self._middle_of(entry) for entry in self.inputs)
        granules, size = scene.chain.granules, len(self.inputs)
        drawn = size + granules * len(self._scatter)
        allowed = f"must be at most {MOST_DRAWN}, those of all granules counted"
        require(drawn <= MOST_DRAWN, "uncertain values", drawn, allowed)
        unit = sobol_points(drawn, seed, np.arange(count))
        unit = np.clip(unit, 1e-12, 1 - 1e-12)  # a normal value at 0 is infinite
        self.drawn = unit[:, :size]
        """Places in the distributions of the inputs, 0 to 1, shape (count, inputs)."""
        self._of_granules = unit[:, size:].reshape(count, len(self._scatter), granules)

    def __iter__(self) -> Iterator[Scene]:
        """Yield the scene of each realisation; a SceneError says which values it cannot have."""
        for places, of_granules in zip(self.drawn, self._of_granules, strict=True):
            drawn = zip(self._middle.items(), self.inputs, places, strict=True)
            values = {key: float(_drawn(of, key, middle, at)) for (key, middle), of, at in drawn}
            try:
                yield changed(self._base, values, partial(self._scattered, places=of_granules))
            except SceneError as problem:
                allowed = f"{problem.allowed}; what is drawn is not: lower its uncertainty"
                raise SceneError(problem.key, problem.value, allowed) from None

    def _middle_of(self, entry: Uncertain) -> tuple[str, float]:
        """Return the full name of an input, and its value in the scene."""
        key = full_key(entry.key, self._base)
        allowed = "is not a quantity of the experiment, and cannot be uncertain"
        require(not (is_whole(key) or key.startswith("run.")), key, None, allowed)
        value = base_values(self._base, [key])[key]
        is_number = isinstance(value, float) and np.isfinite(value)
        require(
            is_number, entry.key, value, "has no value of its own in this scene: write it there"
        )
        allowed = "is 0, of which there is no share: give its uncertainty in its unit"
        require(not entry.relative or value != 0, entry.key, None, allowed)
        return key, float(value)

    def _scattered(self, chain: Chain, places: FloatArray) -> Chain:
        """Return a chain whose granules differ; fixed ones rest."""
        columns: dict[str, Any] = {}
        for entry, place in zip(self._scatter, places, strict=True):
            key = entry.key.partition(".")[2]
            middle = np.broadcast_to(getattr(chain, key), chain.granules)
            values = _drawn(entry, key, middle, place)
            if key == "velocity":
                values = np.where(chain.fixed, 0.0, values)
            columns[key] = tuple(values)
        return replace(chain, **columns) if columns else chain


def standard(entry: Uncertain, place: FloatArray) -> FloatArray:
    """Deviations from the middle, over ``size``, at quantiles from 0 to 1."""
    if entry.uniform:
        return np.asarray(2 * place - 1)
    normal = np.vectorize(NormalDist().inv_cdf, otypes=[float])
    return np.asarray(normal(np.clip(place, 2.0**-31, 1 - 2.0**-31)))  # 0 and 1 have no quantile


def _drawn(entry: Uncertain, key: str, middle: FloatArray | float, place: FloatArray) -> FloatArray:
    """Return values at places in the distribution; a gap below 0 becomes 0."""
    size = entry.size * np.abs(middle) if entry.relative else entry.size
    values = np.asarray(middle + size * standard(entry, place))
    return np.maximum(values, 0.0) if key.endswith("gap") else values


_DEGREE = 8
"""Degree of the polynomials of an input's place in its distribution: their residual for 7 sin^2 of
Ishigami's function, two periods, is 2e-3 (measured)."""

FOR_SHARES = 32
"""Least number of realisations for each input: the error of a share is then about 0.05
(measured)."""

_SAMPLES_PER_TERM = 8
"""Least realisations for each term of the regression."""


def first_order(inputs: Sequence[Uncertain], places: FloatArray, values: FloatArray) -> FloatArray:
    """Return first-order Sobol indices of results, shape (inputs, results).

    They are the parts of the variance that functions of single inputs explain: a line, and Legendre
    polynomials of the input's place in its distribution, 0 to 1, fitted by least squares to the
    realisations, without further runs. The rest up to 1 is due to scatter and to inputs acting
    together. ``places`` has shape (realisations, inputs), ``values`` (realisations, results). NaN
    where all are the same, and for all if there are fewer than ``FOR_SHARES`` realisations an
    input.
    """
    count, results = values.shape
    if not inputs:
        return np.zeros((0, results))
    if count < FOR_SHARES * len(inputs):
        return np.full((len(inputs), results), np.nan)
    degree = min(_DEGREE, count // (_SAMPLES_PER_TERM * len(inputs)))
    blocks = [_terms(entry, places[:, k], degree) for k, entry in enumerate(inputs)]
    terms = np.concatenate(blocks, axis=1)
    centred = values - values.mean(axis=0)
    weights = np.linalg.lstsq(terms, centred, rcond=None)[0]
    variance = centred.var(axis=0)
    left = (centred - terms @ weights).var(axis=0) / max(1 - terms.shape[1] / count, 0.5)
    parts = np.split(weights, len(inputs))
    explained = [(block @ part).var(axis=0) for block, part in zip(blocks, parts, strict=True)]
    with np.errstate(invalid="ignore", divide="ignore"):
        # The residual acts as noise: each term explains one part in ``count`` of it.
        indices = (np.array(explained) - degree * left / count) / variance
    return np.where(variance > 0, np.clip(indices, 0.0, 1.0), np.nan)


def _terms(entry: Uncertain, place: FloatArray, degree: int) -> FloatArray:
    """Return centred functions of an input, shape (realisations, degree)."""
    from numpy.polynomial.legendre import legvander

    higher = legvander(2 * place - 1, degree)[:, 2:]
    terms = np.column_stack([standard(entry, place), higher])
    return np.asarray(terms - terms.mean(axis=0))


RTOL = 1e-4
"""Default accuracy of each realisation: the effect of inputs is hardly ever smaller."""

REALISATIONS = 256
"""Realisations by default: a standard deviation is then known to 4 %."""

SHARE = "share "
"""Beginning of the names of columns of shares."""

MOST = 2**17
"""Most realisations (chosen)."""

_OF_PULSE = ("first_peak_force_N", "arrival_time_s", "first_width_s")
"""Results of the first pulse of a contact or gauge."""

_ENDS = 5.0, 95.0
"""Percentiles of the range that is shown."""


@dataclass(frozen=True, eq=False, repr=False)
class Spread:
    """The spread of the results of a scene by its uncertain inputs.

    Parameters
    ----------
    scene
        The scene, with what is uncertain of it.
    inputs
        Names of the uncertain inputs, scatter not among them.
    names
        Name and unit of each result, such as ``first_peak_force_N``, its contact or gauge as
        ``contact 16``, shape (results,).
    nominal
        Results of the scene as it is, in SI units, shape (results,).
    values
        Results of the realisations, shape (realisations, results); NaN where there is none.
    shares
        Part of the variance that each input causes by itself, shape (inputs, results): first-order
        Sobol indices. The rest is due to scatter and to inputs acting together. NaN for fewer than
        32 realisations an input, and where nothing varies.
    rtol
        Accuracy of the runs: smaller variations are errors of the runs.
    """

    scene: Scene
    inputs: tuple[str, ...]
    names: tuple[tuple[str, str], ...]
    nominal: FloatArray
    values: FloatArray
    shares: FloatArray
    rtol: float

    def __repr__(self) -> str:
        from hertzchain.report.console import plain_text

        return plain_text(lambda console: print_spread(console, self, every=False))

    def plot(self) -> Figure:
        """Draw first peaks along the chain with their range, and the shares of the inputs."""
        return plot_spread(self)

    @property
    def deviation(self) -> FloatArray:
        """Standard deviations, shape (results,)."""
        return np.asarray(np.std(self.values, axis=0, ddof=1))

    @property
    def range_90(self) -> FloatArray:
        """Values below which 5 and 95 % of the realisations are, shape (2, results)."""
        return np.asarray(np.percentile(self.values, _ENDS, axis=0))

    @property
    def deviation_error(self) -> float:
        """Relative standard error of deviations for random numbers; Sobol's are not worse."""
        return float(1 / np.sqrt(2 * (len(self.values) - 1)))

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on results that some realisations lack, and other remarks; usually empty."""
        missing = np.isnan(self.values[:, ~np.isnan(self.nominal)])
        lost, some = (int(np.count_nonzero(missing.any(axis=axis))) for axis in (0, 1))
        remarks = []
        if lost:
            remarks.append(
                f"results without a spread: {lost}, as {some} of {len(missing)} realisations end"
                " before the pulses are over: give a later end_time"
            )
        if self.inputs and np.isnan(self.shares).all():
            least = FOR_SHARES * len(self.inputs)
            least_said = f"{least} realisations on: {FOR_SHARES} an input"
            remarks.append(f"what each input causes is known from {least_said}")
        return tuple(remarks)

    def to_frame(self) -> pandas.DataFrame:
        """Return one row per result: result, at, nominal, mean, deviation, low_5, high_95, shares.

        Shares have the names of inputs, ``share chain.young_modulus``, and ``share rest``.
        """
        import pandas

        low, high = self.range_90
        shares = {f"{SHARE}{name}": row for name, row in zip(self.inputs, self.shares, strict=True)}
        return pandas.DataFrame(
            {
                "result": [name for name, _ in self.names],
                "at": [at for _, at in self.names],
                "nominal": self.nominal,
                "mean": self.values.mean(axis=0),
                "deviation": self.deviation,
                "low_5": low,
                "high_95": high,
                **shares,
                f"{SHARE}rest": np.clip(1 - self.shares.sum(axis=0), 0.0, 1.0),
            }
        )

    def values_of(self, result: str, at: str) -> FloatArray:
        """Values of a result by its names, such as ``arrival_time_s``, ``the wall``."""
        listed = " or ".join(map(str, self.names))
        require((result, at) in self.names, "result", (result, at), f"must be one of {listed}")
        return self.values[:, self.names.index((result, at))]

    def to_dict(self) -> dict[str, Any]:
        """Return the spread as a JSON object."""
        table = self.to_frame()
        results = table.astype(object).where(table.notna(), None).to_dict("records")
        for row in results:
            names = [name for name in row if str(name).startswith(SHARE)]
            row["shares"] = {str(name).removeprefix(SHARE): row.pop(name) for name in names}
        return {
            "realisations": len(self.values),
            "deviation_error": self.deviation_error,
            "spread": results,
            "remarks": list(self.remarks),
            **context_of(self.scene),
        }


def spread(
    scene: SceneLike,
    realisations: Annotated[int, Key] = REALISATIONS,
    *,
    seed: Seed = 1,
    rtol: float = RTOL,
    time_limit: float = TIME_LIMIT,
    progress: ShowProgress = None,
) -> Spread:
    """Run a scene many times with values drawn from [uncertainty] and [scatter].

    Parameters
    ----------
    scene
        A scene with something ``uncertain``, or the path of its file.
    realisations
        Number of runs; the next power of 2 is taken, for which quasi-random numbers are evenly
        spread. Shares of the inputs need 32 for each.
    seed
        Seed of the scrambled Sobol sequence: the same seed gives the same results.
    rtol
        Accuracy of each run.
    time_limit
        Time limit of all runs together [s].
    progress
        As for ``judge_traces``.

    Raises
    ------
    SceneError
        If nothing is uncertain, or a drawn value is impossible.
    TooExpensive
        If it takes longer than the time limit.
    """
    scene = to_scene(scene)
    Key(least=16, most=MOST, kind="int").check("realisations", realisations)
    count = 1 << (realisations - 1).bit_length()
    deadline = Deadline(time_limit)
    # One end for all runs: by default each run would search its own, at additional cost.
    until = Run(with_end(scene, time_limit=time_limit).end_time)
    drawn = Realisations(replace(scene, run=until), count, seed)
    native = Native(rtol=rtol, peaks_only=True, wanted="first")
    (middle_run,) = run_each([replace(scene, run=until)], native, deadline)
    names, nominal = names_of(middle_run), values_of(middle_run)
    values = np.empty((count, nominal.size))
    with telling(progress) as report_progress:
        for done, run in enumerate(run_each(drawn, native, deadline)):
            values[done] = values_of(run)
            if done % 64 == 0:
                report_progress(f"native: {done} of {count} realisations")
    if middle_run.usual_wave is None:
        names, nominal, values = names[:-2], nominal[:-2], values[:, :-2]
    shares = first_order(drawn.inputs, drawn.drawn, values)
    inputs = tuple(each.name for each in drawn.inputs)
    return Spread(scene, inputs, names, nominal, values, shares, rtol)


def names_of(run: Result) -> tuple[tuple[str, str], ...]:
    """Return names and places of the results that ``values_of`` reads."""
    contacts = [run.scene.contact_name(contact) for contact in run.contact.tolist()]
    of_contacts = [(name, at) for name in ("peak_force_N", *_OF_PULSE) for at in contacts]
    of_gauges = [(name, name_of(gauge)) for gauge in run.scene.gauges for name in _OF_PULSE]
    return (*of_contacts, *of_gauges, ("speed_m_s", "wave"), ("height_N", "wave"))


def values_of(run: Result) -> FloatArray:
    """Return peaks and first pulses of contacts, gauges, the wave, in SI units; NaN if missing."""
    first, wave = run.first_columns, run.usual_wave
    of_contacts = np.array([run.peak_force, *(first[name] for name in _OF_PULSE)])
    of_gauges = [
        (read.force, read.arrival, read.width) if np.isfinite(read.width) else (np.nan,) * 3
        for read in run.gauges
    ]
    of_wave = (np.nan, np.nan) if wave is None else (wave.speed, wave.height)
    forces = np.where(run.is_cut_off, np.nan, of_contacts).ravel()
    return np.concatenate([forces, np.ravel(of_gauges), of_wave])


def name_of(gauge: Gauge) -> str:
    """Return the name of a gauge in results, such as ``gauge in granule 16``."""
    return f"gauge {'in' if gauge.key == 'granule' else 'at'} {gauge.place}"


_SHOWN = 0.005  # least share of a variance that is named
_HEADER = ("result", "", "nominal", "5 %", "95 %", "deviation", "made by")


def print_spread(console: Console, spread: Spread, every: bool) -> None:
    """Print the spread of all results, or of contacts only first peaks of three."""
    from hertzchain.report.console import print_prose, table

    console.print(describe(spread.scene), end="\n\n")
    print_prose(console, ", ".join(entry.name for entry in spread.scene.uncertain), "uncertain: ")
    count = f"{len(spread.values):,}, deviations are known to {spread.deviation_error:.1%}"
    print_prose(console, count, "realisations: ")
    for remark in spread.remarks:
        print_prose(console, remark, "remark: ")
    scene = spread.scene
    contacts = {scene.contact_name(number) for number in scene.contacts}
    chosen = [scene.contacts[0], scene.chain.granules // 2 + 1, scene.last_contact]
    shown = {scene.contact_name(number) for number in chosen}
    rows = [
        _row(spread, k)
        for k, (name, at) in enumerate(spread.names)
        if every or at not in contacts or (at in shown and name == "first_peak_force_N")
    ]
    console.print()
    console.print(table(_HEADER, rows, left=("result", "", "made by")))
    if not every:
        console.print(f"({len(spread.names) - len(rows)} more results are shown by --all)")


def _row(spread: Spread, k: int) -> list[str]:
    name, at = spread.names[k]
    what, _, unit = name.replace("m_s", "m/s").rpartition("_")
    words = what.replace("_", " ")
    middle, deviation = float(spread.nominal[k]), float(spread.deviation[k])
    if np.isnan(middle) or middle == 0:
        return [words, at, "no whole pulse", "", "", "", ""]
    if np.isnan(deviation) or deviation < spread.rtol * abs(middle):
        said = "cut off" if np.isnan(deviation) else "none"
        return [words, at, in_prefixed(middle, unit), "", "", said, ""]
    cells = [in_prefixed(x, unit) for x in (middle, *spread.range_90[:, k].tolist())]
    has_scatter = any(entry.each for entry in spread.scene.uncertain)
    rest = "scatter" if has_scatter else "several together"
    shares = dict(zip(spread.inputs, spread.shares[:, k].tolist(), strict=True))
    # A part of the rest is due to errors of the other shares.
    shares[rest] = 1 - sum(shares.values()) - _SHOWN
    largest = sorted(shares.items(), key=lambda pair: -pair[1])
    parts = ", ".join(f"{key} {share:.0%}" for key, share in largest if share >= _SHOWN)
    return [words, at, *cells, f"{deviation / abs(middle):.2%}", parts]


def plot_spread(spread: Spread, size: tuple[float, float] | None = None) -> Picture:
    """Draw first peaks along the chain with their range of 5 to 95 %, and shares of variance."""
    from hertzchain.report.picture import Picture, legend_above

    figure = Picture(size or (7.0, 6.0))
    at = [k for k, (name, _) in enumerate(spread.names) if name == "first_peak_force_N"]
    at = at[: len(spread.scene.contacts)]  # those of gauges follow
    contact = np.array(spread.scene.contacts[: len(at)])
    low, high = spread.range_90[:, at]
    shares = spread.shares[:, at]
    rows = 2 if np.isfinite(shares).any() else 1  # too few realisations give no shares
    above, *below = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    above.fill_between(contact, low, high, color="#56B4E9", alpha=0.6, label="5 to 95 %")
    above.plot(contact, spread.nominal[at], color="black", marker=".", label="the scene itself")
    above.set_ylabel("first peak [N]")
    for axes in below:
        layers = np.nan_to_num(shares)
        rest = np.clip(1 - layers.sum(axis=0), 0, 1)
        axes.stackplot(contact, *layers, rest, labels=[*spread.inputs, "scatter, and together"])
        axes.set(ylabel="share of variance", ylim=(0, 1))
    for axes in figure.axes:
        legend_above(axes)
    figure.axes[-1].set_xlabel("contact")
    return figure
