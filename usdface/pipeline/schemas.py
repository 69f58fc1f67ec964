"""Registration of the usdface schemas before a job."""

from contextlib import suppress

from usdface.errors import SchemaError
from usdface.schemas import register

__all__ = ["register_schemas"]


def register_schemas() -> None:
    """Register the usdface schemas; in a host where that is too late, stages are read without."""
    with suppress(SchemaError):
        register()
