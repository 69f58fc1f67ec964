"""Errors in a glTF file that its readers run into, as ours."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from usdface.errors import InputError

__all__ = ["schema_errors"]


@contextmanager
def schema_errors(path: Path) -> Iterator[None]:
    """Name the file in errors; unexpected exceptions are violations of the specification.

    Raises
    ------
    InputError
        With the code SCHEMA_BROKEN, or its own.
    """
    try:
        yield
    except InputError as error:
        code = "SCHEMA_BROKEN" if error.code == InputError.default_code else error.code
        raise InputError(f"{path}: {error}", code) from error
    except (
        ArithmeticError,
        AttributeError,
        LookupError,
        OSError,
        TypeError,
        ValueError,
        struct.error,
        np.linalg.LinAlgError,
    ) as error:
        # A wrong JSON type in one of the many fields that pygltflib does not check.
        message = f"{path}: the file does not follow the glTF schema: {error}"
        raise InputError(message, "SCHEMA_BROKEN") from error
