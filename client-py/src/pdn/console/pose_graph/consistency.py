"""How far a sum of squared residuals is from what the stated standard deviations promise."""

from __future__ import annotations

import math

TWO_SIDED_95 = 1.959963984540054
"""Standard deviations within which a normal variable lies with 95 %."""

NO_NOISE = 1e-9
"""chi2 per degree of freedom below which there is no noise but rounding."""


def interval(degrees_of_freedom: int) -> tuple[float, float]:
    """Between what chi2 lies in 95 of 100 graphs whose noise is as stated: quantiles of the chi-squared
    distribution, approximated to a percent from 3 degrees of freedom on [E. B. Wilson and M. M. Hilferty,
    "The distribution of chi-square", PNAS 17, 1931].
    """
    spread = 2.0 / (9.0 * degrees_of_freedom)
    low, high = (1.0 - spread + sign * TWO_SIDED_95 * math.sqrt(spread) for sign in (-1.0, 1.0))
    return degrees_of_freedom * max(0.0, low) ** 3, degrees_of_freedom * high**3


def verdict(chi2: float, degrees_of_freedom: int) -> str:
    """A sentence about chi2 for whoever made the graph."""
    if degrees_of_freedom <= 0:
        return "No loop is closed, so there is nothing that could contradict: chi2 says nothing of the noise."
    low, high = interval(degrees_of_freedom)
    expected = f"95 of 100 graphs whose noise is as stated have chi2 from {low:.6g} to {high:.6g}"
    if low <= chi2 <= high:
        return f"Consistent: {expected}."
    if chi2 > high:
        factor = math.sqrt(chi2 / degrees_of_freedom)
        return (
            f"Too large: {expected}. Either the stated standard deviations are {factor:.2g} times too small "
            "on the average (then so are those of every pose), or some edges are false, or this is no "
            "global optimum."
        )
    if chi2 < NO_NOISE * degrees_of_freedom:
        return "Too small: the measurements agree to the last digits, as only those without noise do."
    factor = math.sqrt(degrees_of_freedom / chi2)
    return (
        f"Too small: {expected}. The stated standard deviations are {factor:.2g} times too large, on average."
    )
