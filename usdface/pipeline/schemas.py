"""Registration of the usdface schemas before a job."""

from contextlib import suppress

from usdface.errors import SchemaError
from usdface.schemas import plugin_dir, register

__all__ = ["register_schemas"]


def register_schemas() -> None:
    """Register the usdface schemas; in a host where that is too late, stages are read without.

    Raises
    ------
    SchemaError
        If this package is in an archive.
    """
    plugin_dir()
    with suppress(SchemaError):
        register()
