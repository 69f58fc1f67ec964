"""USD's own validators, as judges of what we write."""

from typing import Any

import pytest
from pxr import Usd

# The packages of usd-core before that one hold validators that do not load.
THEY_LOAD = (0, 25, 8)
needed = pytest.mark.skipif(
    Usd.GetVersion() < THEY_LOAD, reason="the validators of this usd-core do not load"
)


def all_validators() -> list[Any]:
    """Return all validators of USD; skip the test where they do not load."""
    from pxr import UsdValidation

    skip_without()
    return UsdValidation.ValidationRegistry().GetOrLoadAllValidators()


def skip_without() -> None:
    """Skip the test where USD's validators do not load."""
    if Usd.GetVersion() < THEY_LOAD:
        pytest.skip("the validators of this usd-core do not load")
