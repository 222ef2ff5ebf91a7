from collections.abc import Callable

import pytest


@pytest.fixture
def holds(request: pytest.FixtureRequest) -> Callable[[str, float, float], bool]:
    """Check an error against its tolerance, and leave both in the test's report (pytest --junitxml)."""

    def check(quantity: str, error: float, tolerance: float) -> bool:
        request.node.user_properties.append((quantity, f"{error:.2e} of {tolerance:.2e}"))
        assert error <= tolerance, f"{quantity}: error {error:.3e}, tolerance {tolerance:.3e}"
        return True

    return check
