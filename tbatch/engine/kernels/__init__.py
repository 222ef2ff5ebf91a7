"""The only Taichi kernels. `advance` holds the step; its parts stand beside it, one noun a file.

Rules of this folder, from Taichi 1.7.4 with lane vectors (`real_matrix_scalarize=False`):

- Unary minus on a vector, `abs`, `**`, casts of comparisons and `acc -= v` abort the process: write `0.0 - x`,
  `max(x, 0.0 - x)`, `m * sqrt(m)`, `select(condition, 1.0, 0.0)`, `acc = acc - v`.
- `x[i] += y` on an array is atomic: write `x[i] = x[i] + y`.
- No `from __future__ import annotations`; array parameters of a `@ti.func` are `ti.template()`.
- Every sum has a stated order, the one of `tbatch.numerics.reference`: both give the same bits.
"""

import os

# Both must be set before taichi is imported: the first silences a banner on stdout, the second a network call (1.7.4).
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
os.environ.setdefault("TI_SKIP_VERSION_CHECK", "ON")

from tbatch.engine.frontend import read_functions_once

read_functions_once()
