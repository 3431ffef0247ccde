"""Settings of the isolation of contacts."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, FiniteFloat, PositiveFloat, PositiveInt

from tactful.config import Config


class IsolationConfig(Config):
    """Where on the arm a contact is, see `Isolator`."""

    noise_nm: PositiveFloat | tuple[PositiveFloat, ...] = 0.1
    """Standard deviation of tau_ext where no covariance is given; one for all joints or one each [Nm]."""
    magnitudes_n: Annotated[tuple[PositiveFloat, ...], Field(min_length=1)] = (5.0, 10.0, 20.0, 40.0)
    """Magnitudes m of the force prior, equally probable; each is spread by m / 2 [N]."""
    friction: PositiveFloat = 0.5
    """Coefficient mu of the force prior: the force leaves the normal by mu m / 2 in each tangential direction."""
    spacing_m: PositiveFloat = 0.05
    """Spacing of the grid on the surface [m]."""
    fine_spacing_m: PositiveFloat = 0.01
    """Spacing of the grid where it is refined [m]."""
    refined_cells: PositiveInt = 8
    """How many cells of the grid are refined, the most probable ones."""
    sure: Annotated[float, Field(gt=0.5, lt=1.0)] = 0.9
    """Probability from which a link is claimed; below it the contact is `ambiguous`."""
    coverage: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.9
    """Probability that the set of candidate points and the intervals hold."""
    point_spread_m: PositiveFloat = 0.03
    """Root mean square distance of the contact from its mean up to which a point is named [m]."""
    pair_log_odds: FiniteFloat = 1.5
    """Log odds from which two contacts are claimed, see `Isolator.pair_log_odds`: false for 2 % of the single
    contacts of a simulated Panda."""
    false_misfit: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.02
    """Probability below which a misfit is taken to say that more than one contact is there."""
