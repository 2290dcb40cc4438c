"""The part of the variance of results that each uncertain input causes by itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.scene.uncertain import Uncertain
from hertzchain.uncertainty.realisations import standard

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
    polynomials of the input's place in its distribution, fitted by least squares to the
    realisations, without further runs. The rest up to 1 is due to scatter and to inputs acting
    together.

    Parameters
    ----------
    inputs, places
        The inputs, and their places in their distributions, 0 to 1, shape (realisations, inputs).
    values
        Results, shape (realisations, results). NaN where all are the same, and for all if there
        are fewer than ``FOR_SHARES`` realisations an input.
    """
    count, results = values.shape
    if not inputs:
        return np.zeros((0, results))
    if count < FOR_SHARES * len(inputs):
        return np.full((len(inputs), results), np.nan)
    degree = min(_DEGREE, count // (_SAMPLES_PER_TERM * len(inputs)))
    blocks = [_terms(one, places[:, k], degree) for k, one in enumerate(inputs)]
    terms = np.concatenate(blocks, axis=1)
    centred = values - values.mean(axis=0)
    weights = np.linalg.lstsq(terms, centred, rcond=None)[0]
    variance = centred.var(axis=0)
    left = (centred - terms @ weights).var(axis=0) / max(1 - terms.shape[1] / count, 0.5)
    parts = np.split(weights, len(inputs))
    explained = [(block @ part).var(axis=0) for block, part in zip(blocks, parts, strict=True)]
    with np.errstate(invalid="ignore", divide="ignore"):
        # The residual acts as noise: each term explains one part in ``count`` of it.
        found = (np.array(explained) - degree * left / count) / variance
    return np.where(variance > 0, np.clip(found, 0.0, 1.0), np.nan)


def _terms(one: Uncertain, place: FloatArray, degree: int) -> FloatArray:
    """Return centred functions of an input, shape (realisations, degree)."""
    from numpy.polynomial.legendre import legvander

    higher = legvander(2 * place - 1, degree)[:, 2:]
    terms = np.column_stack([standard(one, place), higher])
    return np.asarray(terms - terms.mean(axis=0))
