"""Functions compiled by numba, with machine code in the user's cache."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

from usdface.user_cache import user_cache_folder

__all__ = ["CUBE", "FLAGS", "MATRIX", "VECTOR", "compiled"]

MATRIX, CUBE, VECTOR = "float64[:,::1]", "float64[:,:,::1]", "float64[::1]"
FLAGS = "boolean[::1]"

_Function = TypeVar("_Function", bound=Callable[..., object])


def compiled(signature: str, *, contract: bool = True) -> Callable[[_Function], _Function]:
    """Return the decorator that compiles a function, or takes it from the user's cache.

    numba's own choice is the folder of this file, where pip leaves machine code behind when it
    uninstalls: a folder without modules that hides an editable install.

    Parameters
    ----------
    signature : str
        Types of the result and the arguments.
    contract : bool
        Multiplications and additions may be fused.
    """
    fused = {"contract"} if contract else False
    config: Any = numba.config

    def decorate(function: _Function) -> _Function:
        before = config.CACHE_DIR
        config.CACHE_DIR = before or str(user_cache_folder("compiled") or "")
        try:
            machine_code = numba.njit(signature, cache=True, nogil=True, fastmath=fused)(function)
        finally:
            config.CACHE_DIR = before
        return cast(_Function, machine_code)

    return decorate
