"""A linear discriminant of classes with one covariance (Fisher 1936), shrunk towards a sphere."""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray

__all__ = ["Discriminant", "fisher_discriminant", "with_room_for_wider_classes"]


@dataclass(frozen=True, eq=False, slots=True)
class Discriminant:
    """Scores of K classes, linear in I features.

    Attributes
    ----------
    directions : (I, K) float64
    offsets : (K,) float64
    """

    directions: FloatArray
    offsets: FloatArray

    def scores(self, features: FloatArray) -> FloatArray:
        """Return the score of each class (N, K) of features (N, I); differences are log odds."""
        return np.asarray(features @ self.directions + self.offsets)


def fisher_discriminant(features: FloatArray, classes: IntArray, shrinkage: float) -> Discriminant:
    """Return the discriminant of examples (N, I) of the classes 0 to K - 1 (N,), all as likely.

    The common covariance is shrunk by `shrinkage`, 0 to 1, towards the sphere of the same trace:
    examples are fewer than the ways in which a face can move.
    """
    means = np.array([features[classes == k].mean(axis=0) for k in range(classes.max() + 1)])
    rest = (features - means[classes]) / np.sqrt(len(features))
    # Without any motion there is no covariance; the floor keeps the sphere invertible.
    sphere = max(shrinkage * np.square(rest).sum() / rest.shape[1], 1e-12)
    rest *= np.sqrt(1 - shrinkage)
    if len(rest) < rest.shape[1]:  # the same by the matrix inversion lemma, N x N
        inner = np.linalg.solve(rest @ rest.T + sphere * np.eye(len(rest)), rest @ means.T)
        directions = (means.T - rest.T @ inner) / sphere
    else:
        covariance = rest.T @ rest + sphere * np.eye(rest.shape[1])
        directions = np.linalg.solve(covariance, means.T)
    return Discriminant(directions, -0.5 * np.einsum("ki,ik->k", means, directions))


def with_room_for_wider_classes(
    discriminant: Discriminant, members: FloatArray, narrow: BoolArray, lead: float
) -> Discriminant:
    """Lower the offsets of narrow classes that win over a typical member of another class.

    One covariance for all is too small for a class of many kinds of examples and too large for one
    of few: the boundary between the two lies too far on the side of the first. It is moved to the
    middle between their typical members, or less far if that member leads by `lead` before.

    Parameters
    ----------
    discriminant : Discriminant
        Of K classes.
    members : (E, I) float64
        A typical member of each of the first E classes.
    narrow : (E,) bool
        Classes of few kinds of examples; the others keep their offsets.
    lead : float
        Log odds.
    """
    scores = discriminant.scores(members)[:, : len(members)]
    ahead = np.diagonal(scores)[:, None] - scores
    lowered = np.clip(np.minimum(lead - ahead, (ahead.T - ahead) / 2.0), 0.0, None)
    offsets = discriminant.offsets.copy()
    offsets[: len(members)] -= np.where(narrow, lowered.max(axis=0, initial=0.0), 0.0)
    return replace(discriminant, offsets=offsets)
