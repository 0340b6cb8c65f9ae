"""Logistic regression with a ridge, by Newton's method, and the choice of the ridge by leaving groups out.

    L(b, w) = Σ_i log(1 + exp(-s_i (b + wᵀφ_i))) + λ/2 |w|²,   s_i = 1 if grasp i held, else -1

L is convex, and the intercept b is free. Columns of Φ are φ, θ is (b, w).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import expit

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.base.errors import InputError
from sgnlp.planning.confidence import Model

STRENGTHS: tuple[float, ...] = tuple(float(s) for s in np.geomspace(1000.0, 0.1, 17))
"""The λ that are tried, in steps of a factor 1.8, the largest first: of equally good ones it is taken."""
ITERATIONS, TOLERANCE = 100, 1e-10
"""Largest number of Newton steps, and the largest entry of the gradient at which they end."""


def loss(theta: Array, phi: Array, held: BoolArray, strength: float) -> float:
    """L at θ (1 + F,) of features Φ (N, F)."""
    signs = np.where(held, 1.0, -1.0)
    scores = theta[0] + phi @ theta[1:]
    return float(np.logaddexp(0.0, -signs * scores).sum() + 0.5 * strength * theta[1:] @ theta[1:])


def gradient(theta: Array, phi: Array, held: BoolArray, strength: float) -> Array:
    """∇L (1 + F,)."""
    residual = expit(theta[0] + phi @ theta[1:]) - held
    return np.concatenate([[residual.sum()], phi.T @ residual + strength * theta[1:]])


def minimum(phi: Array, held: BoolArray, strength: float) -> Array:
    """The θ (1 + F,) with the least L. Raises `InputError` if all held, or none did: b would be infinite."""
    if held.all() or not held.any():
        raise InputError("a confidence is fitted to grasps of which some held and some did not")
    theta = np.zeros(1 + phi.shape[1])
    ones = np.column_stack([np.ones(len(phi)), phi])
    ridge = np.diag([0.0, *[strength] * phi.shape[1]])
    for _ in range(ITERATIONS):
        slope = gradient(theta, phi, held, strength)
        if np.abs(slope).max() <= TOLERANCE * len(phi):
            break
        p = expit(ones @ theta)
        step = np.linalg.solve((ones * (p * (1 - p))[:, None]).T @ ones + ridge, slope)
        before, length = loss(theta, phi, held, strength), 1.0
        while loss(theta - length * step, phi, held, strength) > before and length > TOLERANCE:
            length /= 2
        if length <= TOLERANCE:  # within rounding, no step decreases L any more
            break
        theta = theta - length * step
    return theta


def left_out(phi: Array, held: BoolArray, groups: Sequence[str], strength: float) -> float:
    """Log loss of all groups, each predicted by a fit to the others; groups without which all outcomes agree are
    skipped."""
    names, found = np.array(groups), 0.0
    for name in dict.fromkeys(groups):
        out = names == name
        if held[~out].any() and not held[~out].all():
            found += loss(minimum(phi[~out], held[~out], strength), phi[out], held[out], 0.0)
    return found


def fitted(shape: Model, values: Array, held: BoolArray, groups: Sequence[str]) -> tuple[Model, float]:
    """The model of these features fitted to values x (N, F), and its λ, the best of `STRENGTHS` by cross-validation.

    Raises `InputError` if all held, or none did.
    """
    ends = zip(shape.features, values.min(axis=0), values.max(axis=0), strict=True)
    bounded = tuple(replace(f, low=float(low), high=float(high)) for f, low, high in ends)
    phi = replace(shape, features=bounded).scaled(values)
    strength = min(STRENGTHS, key=lambda s: left_out(phi, held, groups, s))
    b, *weights = minimum(phi, held, strength)
    features = tuple(replace(f, weight=float(w)) for f, w in zip(bounded, weights, strict=True))
    return Model(float(b), features), strength
