"""What the stored runs say: estimates with their intervals, curves, fits, convergence.

The run is the statistical unit throughout.
"""

from tbatch.campaign.estimates.estimate import FILTERED, RAW, Estimate
from tbatch.campaign.estimates.loads import load_estimates
from tbatch.campaign.estimates.separation import separation_estimates
from tbatch.campaign.estimates.units import ALL_SPEEDS, ANY_WHEELSET, Records, Units

__all__ = ["ALL_SPEEDS", "ANY_WHEELSET", "FILTERED", "RAW", "Estimate", "Records", "Units", "estimates"]


def estimates(units: Units) -> list[Estimate]:
    """All estimates of the runs of a speed and wheelset, of any wheelset, or of a whole campaign."""
    return [*separation_estimates(units), *load_estimates(units)]
