"""Linear algebra on one thread, so that the last bits of a result do not depend on how many there are.

OpenBLAS factorises by another recursion with two threads than with one, whatever the size: the inverse of a coach's ten
dofs differs in the last bit (OpenBLAS 0.3.30, AMD Zen 4). The matrices here are small or sparse; nothing gets slower.
"""

from collections.abc import Callable
from typing import ParamSpec, TypeVar

import scipy.linalg  # noqa: F401  # its own BLAS has to be loaded before it can be told
from threadpoolctl import threadpool_limits

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def one_blas_thread(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Makes a function whose linear algebra runs on one thread, in this process, as long as it runs."""
    wrapped: Callable[_Arguments, _Result] = threadpool_limits.wrap(limits=1, user_api="blas")(function)
    return wrapped
