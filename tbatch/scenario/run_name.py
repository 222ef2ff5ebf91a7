"""The printed name of a run: ``c03-s000127`` is sample 127 of case 3, the fourth speed."""

import re

_NAME = re.compile(r"c(\d{2,9})-s(\d{6,9})", re.ASCII)


def run_name(case: int, sample: int) -> str:
    """Return a run's printed name.

    Args:
        case: Index of the speed, from 0.
        sample: Index of the sample, from 0.
    """
    return f"c{case:02d}-s{sample:06d}"


def parse_run_name(name: str) -> tuple[int, int]:
    """Return (case, sample) of a printed name.

    Raises:
        ValueError: The text is not a run's name.
    """
    match = _NAME.fullmatch(name)
    if match is None or run_name(int(match[1]), int(match[2])) != name:
        raise ValueError(f"{name!r} is not the name of a run, which looks like 'c03-s000127' (speed 3, sample 127)")
    return int(match[1]), int(match[2])
