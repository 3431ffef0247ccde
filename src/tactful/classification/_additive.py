"""An additive model: a probability that explains itself, and its file."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tactful.classification._features import FEATURES
from tactful.errors import TactfulError

Array = NDArray[np.float64]

CONTEXTS = ("first", "after_collision")
"""A model for the first contact, and one for what comes in a collision, or within a second of it."""

FORMAT, VERSION = "tactful classifier", 2
_ARRAYS = ("knots", "values", "offset")


class ModelError(TactfulError):
    """A file that is no classifier, or not one for this version.

    Attributes:
        path: the file.
    """

    def __init__(self, path: str | Path, problem: str) -> None:
        self.path = str(path)
        super().__init__(f"{path}: {problem}")

    def __reduce__(self) -> tuple[Any, ...]:
        return ModelError, (self.path, str(self).removeprefix(f"{self.path}: "))


@dataclass(frozen=True, eq=False, kw_only=True)
class AdditiveModel:
    r"""The log odds that a contact is cooperation, as a sum of one curve a feature.

        log p / (1 - p) = b_c + sum_k f_ck(x_k),

    with curves f that are linear between knots and constant beyond them, so that what lies outside of what was learned
    counts as its border. c is the context. A feature that is not known adds nothing; each curve is zero on average.

    Attributes:
        features: names of the features, k of `FEATURES`.
        knots: (k, m), ascending.
        values: (c, k, m), of the curves at the knots.
        offset: (c,), the log odds b.
        threshold: the probability above which a contact had best be called cooperation, see `learning.train`.
        provenance: where it comes from.
        figures: how good it was where it was trained and cross-validated.
    """

    features: tuple[str, ...]
    knots: Array
    values: Array
    offset: Array
    threshold: float = 0.5
    provenance: Mapping[str, Any] = field(default_factory=dict)
    figures: Mapping[str, Any] = field(default_factory=dict)

    @property
    def with_location(self) -> bool:
        """Whether it looks at features that say where on the arm the contact is."""
        return any(FEATURES[name].location for name in self.features)

    def contributions(self, x: Array, context: int) -> Array:
        """Return what each feature adds to the log odds (k,), from their values x (k,)."""
        curves = zip(x, self.knots, self.values[context], strict=True)
        return np.array([0.0 if np.isnan(value) else np.interp(value, *curve) for value, *curve in curves])

    def probability(self, x: Array, context: int) -> float:
        """Return the probability of cooperation, from the features x (k,)."""
        return float(1 / (1 + np.exp(-(self.offset[context] + self.contributions(x, context).sum()))))

    def save(self, path: str | Path) -> None:
        """Write to an .npz file of plain arrays and one line of JSON.

        Raises:
            ModelError: the place cannot be written.
        """
        about = {
            "format": FORMAT,
            "version": VERSION,
            "features": self.features,
            "contexts": CONTEXTS,
            "threshold": self.threshold,
            "provenance": dict(self.provenance),
            "figures": dict(self.figures),
        }
        try:
            with Path(path).open("wb") as file:
                arrays = {name: getattr(self, name) for name in _ARRAYS}
                np.savez(file, allow_pickle=False, about=np.array(json.dumps(about, allow_nan=False)), **arrays)
        except OSError as error:
            raise ModelError(path, f"cannot be written: {error.strerror or error}") from None

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Return the model that `save` wrote; nothing in the file is executed.

        Raises:
            ModelError: the file is missing, damaged, no classifier, or one of a version that is not known.
        """
        try:
            with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as archive:
                arrays = {name: archive[name] for name in archive.files}
        except OSError as error:
            raise ModelError(path, f"cannot be read: {error.strerror or 'it is damaged'}") from None
        except (ValueError, EOFError, TypeError, AttributeError, zipfile.BadZipFile, zlib.error):
            raise ModelError(path, "is no classifier, or damaged: train one with `tactful train`") from None
        try:
            about = json.loads(str(arrays["about"]))
            known = about["format"] == FORMAT
        except (KeyError, TypeError, ValueError):
            known = False
        if not known:
            raise ModelError(path, "is no classifier: train one with `tactful train`")
        if about.get("version") != VERSION:
            raise ModelError(path, f"has version {about.get('version')!r}, but {VERSION} is needed: train it anew")
        return cls._checked(path, about, arrays)

    @classmethod
    def _checked(cls, path: str | Path, about: dict[str, Any], arrays: dict[str, Any]) -> Self:
        features = about.get("features")
        if not isinstance(features, list) or about.get("contexts") != list(CONTEXTS):
            raise ModelError(path, "is damaged: it does not say what it looks at")
        for name in features:
            if name not in FEATURES:
                near = get_close_matches(str(name), FEATURES, n=1)
                hint = f"; is it {near[0]!r}?" if near else ""
                raise ModelError(path, f"looks at {name!r}, which this version does not know{hint}: train it anew")
        if missing := [name for name in _ARRAYS if name not in arrays or arrays[name].dtype != np.float64]:
            raise ModelError(path, f"is damaged: {missing[0]} is missing or holds no numbers")
        threshold = about.get("threshold")
        if not isinstance(threshold, float) or not 0 < threshold < 1:
            raise ModelError(path, "is damaged: its threshold is no probability")
        k, c = len(features), len(CONTEXTS)
        knots, values, offset = (arrays[name] for name in _ARRAYS)
        m = knots.shape[-1] if knots.ndim else 0
        shapes = (knots.shape, values.shape, offset.shape) == ((k, m), (c, k, m), (c,)) and m > 0
        if not shapes or not all(np.isfinite(arrays[name]).all() for name in _ARRAYS):
            raise ModelError(path, "is damaged: its arrays do not fit each other")
        if (np.diff(knots, axis=1) <= 0).any():
            raise ModelError(path, "is damaged: its knots do not ascend")
        return cls(
            features=tuple(features),
            knots=knots,
            values=values,
            offset=offset,
            threshold=threshold,
            provenance=about.get("provenance", {}),
            figures=about.get("figures", {}),
        )
