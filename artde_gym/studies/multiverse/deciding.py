"""Deciding factors: a small tree over the factors, with its accuracy on held-out worlds."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy  # its `stats`, half a second, is imported when it is first used: not by workers
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.evaluation.statistics import CONFIDENCE
from artde_gym.extras import needs

DEPTH = 3
FOLDS = 5
SMALLEST = 0.05  # share of the worlds in a leaf
REPEATS = 10  # permutations of each factor and fold


@dataclasses.dataclass(frozen=True)
class Node:
    """A node of a tree: `counts` of the classes in it; a leaf has no factor.

    Attributes:
        factor: place of the one that it asks for.
        threshold: `below` are the worlds whose factor is at most this.
    """

    counts: tuple[int, ...]
    factor: int | None = None
    threshold: float = float("nan")
    below: Node | None = None
    above: Node | None = None


@dataclasses.dataclass(frozen=True)
class Deciding:
    """Factors that decide between classes.

    Attributes:
        classes: in the order of `Node.counts`.
        accuracy: share of worlds whose class a tree predicts that was made without them.
        baseline: share of the most frequent class, which needs no tree.
        importance: of each factor, by how much of the accuracy is lost where its values are permuted.
        spread: standard errors of these, over the folds.
        tree: made from all worlds.
    """

    classes: tuple[str, ...]
    accuracy: float
    baseline: float
    importance: Array
    spread: Array
    tree: Node


def what_decides(factors: Array, classes: Sequence[str]) -> Deciding | None:
    """Fit a tree; None where fewer than two classes have `FOLDS` worlds each. Rarer classes are left out.

    Args:
        factors: numbers (worlds, factors).
        classes: of the worlds.

    Raises:
        MissingDependencyError: without scikit-learn.
    """
    inspection, model_selection, trees = _scikit_learn()
    names, counts = np.unique(np.array(classes, dtype=str), return_counts=True)
    kept = np.isin(classes, names[counts >= FOLDS])
    if (counts >= FOLDS).sum() < 2:
        return None
    exponents = np.frexp(np.nan_to_num(np.abs(factors)).max(axis=0))[1]
    x, y = np.ldexp(factors[kept], -exponents), np.array(classes, dtype=str)[kept]  # trees have single precision

    def fitted(rows: NDArray[Any]) -> Any:
        made = trees.DecisionTreeClassifier(max_depth=DEPTH, min_samples_leaf=SMALLEST, random_state=0)
        return made.fit(x[rows], y[rows])

    accuracy, lost = [], []
    for train, test in model_selection.StratifiedKFold(FOLDS, shuffle=True, random_state=0).split(x, y):
        tree = fitted(train)
        accuracy.append(tree.score(x[test], y[test]))
        found = inspection.permutation_importance(tree, x[test], y[test], n_repeats=REPEATS, random_state=0)
        lost.append(found.importances_mean)
    whole = fitted(np.arange(len(y)))
    baseline = float(counts[counts >= FOLDS].max() / len(y))
    kinds = tuple(str(name) for name in whole.classes_)
    spread = np.std(lost, axis=0, ddof=1) / np.sqrt(FOLDS)
    return Deciding(
        kinds, float(np.mean(accuracy)), baseline, np.mean(lost, axis=0), spread, _node(whole, x, y, kinds, exponents)
    )


def rank_correlations(factors: Array, values: Array) -> tuple[Array, float]:
    """Return Spearman's rank correlation of each factor with some values, and the size that chance exceeds in 5 %."""
    with np.errstate(invalid="ignore", divide="ignore"):
        ranks = scipy.stats.rankdata(factors, axis=0), scipy.stats.rankdata(values)
        found = [float(np.corrcoef(column, ranks[1])[0, 1]) for column in ranks[0].T]
    return np.array(found), float(scipy.stats.norm.ppf(0.5 + CONFIDENCE / 2) / np.sqrt(max(len(values) - 1, 1)))


def _scikit_learn() -> tuple[Any, Any, Any]:
    """Import what is needed of it.

    Raises:
        MissingDependencyError: if it is not installed.
    """
    with needs("multiverse"):
        from sklearn import inspection, model_selection, tree
    return inspection, model_selection, tree


def _node(fitted: Any, x: Array, y: NDArray[Any], classes: Sequence[str], exponents: NDArray[Any]) -> Node:
    """Read a fitted tree, which scikit-learn holds as arrays, of factors that were divided by powers of two."""
    inside = fitted.decision_path(x).toarray().astype(bool)
    arrays = fitted.tree_

    def read(i: int) -> Node:
        counts = tuple(int((y[inside[:, i]] == name).sum()) for name in classes)
        if arrays.children_left[i] < 0:
            return Node(counts)
        below, above = (read(int(children[i])) for children in (arrays.children_left, arrays.children_right))
        factor = int(arrays.feature[i])
        return Node(counts, factor, float(np.ldexp(arrays.threshold[i], exponents[factor])), below, above)

    return read(0)
