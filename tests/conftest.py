from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Real data beside the project; a user's clone does not have it."""
    if not SHARED.is_dir():
        pytest.skip("real data (../shared/data) is not beside this clone")
    return SHARED
