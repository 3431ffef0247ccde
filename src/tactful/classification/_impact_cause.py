"""What went wrong with a planned impact, and how sure that is."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.classification._aim_aware_result import AimAwareResult
from tactful.classification._impact_features import IMPACT_FEATURES, ImpactFeatures, impact_features
from tactful.classification._verdict import Evidence
from tactful.errors import TactfulError
from tactful.impacts import ImpactPlan
from tactful.robots import Robot

Array = NDArray[np.float64]

PLANNED = "as planned"
UNKNOWN = "unknown"
_NAMES = tuple(IMPACT_FEATURES)
_FAR = 3.0
"""How much further than 99 % of the runs of its cause an impact may lie from their mean (in squared distance)."""


@dataclass(frozen=True, slots=True, eq=False)
class ImpactCause:
    """What went wrong with an impact.

    Attributes:
        cause: the most probable one; "missed" if nothing came; "unknown" if the impact is like none that was learnt.
        confidence: its probability, as the model has it.
        probabilities: that of every cause that was learnt; empty for "missed".
        tilt_deg: rotation vector (3,) of the tool against the plan, base axes, None for "missed"; where the tool lies
            flat on it, the inclination of the surface [deg].
        evidence: the features that speak most for this cause and against an impact as planned, in standard deviations.
    """

    cause: str
    confidence: float
    probabilities: Mapping[str, float]
    tilt_deg: Array | None
    evidence: tuple[Evidence, ...]


class ImpactCauses:
    r"""Tell what went wrong with an impact, from runs of which it is known.

    Each cause c is a normal distribution of the features (`IMPACT_FEATURES`), standardized, with its own mean and
    covariance; the covariance is shrunk towards its diagonal (and that towards a floor), so that some dozen runs do:

        log p(c | x) = -1/2 (x - m_c)^T S_c^-1 (x - m_c) - 1/2 log |S_c| + const.,    all causes equally probable.

    The inclination is no output of the model: it is the rotation of the tool against the plan, see `ImpactFeatures`.

    Args:
        causes: their names; one of them has to be "as planned".
        mean: of the standardized features (c, k).
        covariance: of them (c, k, k).
        centre, scale: that standardize the features (k,).
        reach: squared distance from its mean within which 99 % of the runs of each cause lie (c,).

    Raises:
        TactfulError: if the shapes do not fit.
    """

    def __init__(
        self,
        causes: Sequence[str],
        mean: ArrayLike,
        covariance: ArrayLike,
        centre: ArrayLike,
        scale: ArrayLike,
        reach: ArrayLike,
    ) -> None:
        self.causes = tuple(str(cause) for cause in causes)
        c, k = len(self.causes), len(_NAMES)
        shapes = {"mean": (c, k), "covariance": (c, k, k), "centre": (k,), "scale": (k,), "reach": (c,)}
        arrays = {"mean": mean, "covariance": covariance, "centre": centre, "scale": scale, "reach": reach}
        self._arrays = {name: np.array(value, dtype=np.float64) for name, value in arrays.items()}
        for name, array in self._arrays.items():
            if array.shape != shapes[name] or not np.isfinite(array).all():
                raise TactfulError(f"impact causes: {name} must be {shapes[name]} finite numbers, not {array.shape}")
        if PLANNED not in self.causes:
            raise TactfulError(f"impact causes: none of {', '.join(self.causes)} is {PLANNED!r}: learn some such runs")
        self._precision = np.linalg.inv(self._arrays["covariance"])  # (c, k, k)
        self._log_det = np.linalg.slogdet(self._arrays["covariance"])[1]  # (c,)

    @classmethod
    def learn(
        cls,
        features: Sequence[ImpactFeatures],
        causes: Sequence[str],
        *,
        shrinkage: float = 0.1,
        floor: float = 0.1,
    ) -> ImpactCauses:
        """Return the model of runs whose causes are known.

        Args:
            features: of the runs.
            causes: of the runs; "as planned" for those in which nothing was wrong. A name is free.
            shrinkage: weight of the diagonal of each covariance.
            floor: least standard deviation of a feature within a cause, as a share of that over all runs.

        Raises:
            TactfulError: if a cause has fewer than 10 runs, or there are not as many causes as runs.
        """
        labels = np.array([str(cause) for cause in causes])
        if len(labels) != len(features):
            raise TactfulError(f"{len(labels)} causes for {len(features)} runs: give one each")
        names = sorted(set(labels.tolist()))
        for name in names:
            if (count := int((labels == name).sum())) < 10:
                raise TactfulError(f"only {count} runs of {name!r}: learn from at least 10 of each cause")
        values = np.array([run.values for run in features]).reshape(len(labels), -1)  # (N, k)
        centre, spread = values.mean(axis=0), values.std(axis=0)
        scale = np.where(spread > 1e-9, spread, 1.0)
        standard = (values - centre) / scale
        mean, covariance, reach = [], [], []
        for name in names:
            runs = standard[labels == name]
            away = runs - runs.mean(axis=0)
            S = away.T @ away / (len(runs) - 1)
            S = (1 - shrinkage) * S + shrinkage * np.diag(np.diag(S)) + floor**2 * np.eye(len(S))
            distance = np.einsum("ni,ij,nj->n", away, np.linalg.inv(S), away)
            mean.append(runs.mean(axis=0))
            covariance.append(S)
            reach.append(np.quantile(distance, 0.99))
        return cls(names, np.array(mean), np.array(covariance), centre, scale, np.array(reach))

    def tell(self, result: AimAwareResult, plan: ImpactPlan, robot: Robot) -> ImpactCause:
        """Return what went wrong with an impact that was judged or missed.

        Raises:
            TactfulError: if there is neither an impact nor a verdict, or the plan has no contact points.
        """
        if result.verdict == "missed" and not result.judged:
            return ImpactCause("missed", 1.0, {}, None, result.evidence)
        return self.tell_features(impact_features(result, plan, robot))

    def tell_features(self, features: ImpactFeatures) -> ImpactCause:
        """Return what went wrong with an impact with these features."""
        arrays = self._arrays
        x = (features.values - arrays["centre"]) / arrays["scale"]
        away = x - arrays["mean"]  # (c, k)
        distance = np.einsum("ci,cij,cj->c", away, self._precision, away)
        score = -0.5 * (distance + self._log_det)
        weights = np.exp(score - score.max())
        probability = weights / weights.sum()
        best = int(np.argmax(probability))
        inside = bool(distance[best] <= _FAR * arrays["reach"][best])
        cause = self.causes[best] if inside else UNKNOWN
        return ImpactCause(
            cause=cause,
            confidence=float(probability[best]) if inside else float(np.exp(-0.5 * _FAR)),
            probabilities=dict(zip(self.causes, (float(p) for p in probability), strict=True)),
            tilt_deg=features.tilt_deg,
            evidence=self._evidence(cause, best, x, features),
        )

    def _evidence(self, cause: str, best: int, x: Array, features: ImpactFeatures) -> tuple[Evidence, ...]:
        planned = self.causes.index(PLANNED)
        spread = np.sqrt(np.diagonal(self._arrays["covariance"], axis1=1, axis2=2))  # (c, k)
        far = (x - self._arrays["mean"][planned]) / spread[planned]
        near = (x - self._arrays["mean"][best]) / spread[best]
        gain = far**2 - near**2 if cause not in (PLANNED, UNKNOWN) else far**2
        told = np.argsort(-gain)[:3]
        return tuple(
            Evidence(
                _NAMES[i],
                float(features.values[i]),
                None,
                f"{cause}: {IMPACT_FEATURES[_NAMES[i]]} is {features.values[i]:.3g}, {far[i]:+.1f} standard deviations",
            )
            for i in told
        )

    def save(self, path: str | Path) -> None:
        """Write the model as a NumPy archive (`.npz`).

        Raises:
            TactfulError: if the place cannot be written.
        """
        try:
            with Path(path).open("wb") as file:
                np.savez_compressed(file, causes=np.array(self.causes), features=np.array(_NAMES), **self._arrays)  # type: ignore[arg-type]
        except OSError as error:
            raise TactfulError(f"{path} cannot be written: {error.strerror or error}") from None

    @classmethod
    def load(cls, path: str | Path) -> ImpactCauses:
        """Read a model that `save` wrote.

        Raises:
            TactfulError: if the file is missing, torn, not a model, or of other features.
        """
        try:
            with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as archive:
                arrays: dict[str, Any] = {name: archive[name] for name in archive.files}
            if tuple(arrays.pop("features").tolist()) != _NAMES:
                raise TactfulError(f"{path} holds a model of other features: learn it again")
            return cls(arrays.pop("causes").tolist(), **arrays)
        except OSError as error:
            raise TactfulError(f"{path} cannot be read: {error.strerror or error}") from None
        except (ValueError, AttributeError, TypeError, KeyError, EOFError, zipfile.BadZipFile):
            raise TactfulError(f"{path} is not a model of impact causes: write one with ImpactCauses.save") from None
