import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parent.parent / "campaign"))  # the toy campaign

from synthetic_run import synthetic_record

from tbatch.view.record import RunRecord


@pytest.fixture(scope="session")
def record() -> RunRecord:
    """A coach that loses contact twelve times at a dip."""
    return synthetic_record(seed=2, scale=0.75)
