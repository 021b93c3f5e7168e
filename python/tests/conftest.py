import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parent))

from long_mode import SEED  # noqa: E402


@pytest.fixture(params=["float64", "float32"])
def number(request):
    """The dtype of an array that is passed to a mesh."""
    return request.param


@pytest.fixture
def tolerance():
    """Of lengths about 1."""
    return 1e-9


def pytest_terminal_summary(terminalreporter):
    if SEED:
        terminalreporter.write_line(f"To repeat these random numbers: ADAPTIVE_BVH_TEST_SEED={SEED}")
