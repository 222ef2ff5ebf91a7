"""Pictures of a viewer without a window, and what can be asked of them."""

import io
import time

import numpy as np


def settled(take, seconds: float = 60.0) -> np.ndarray:
    """A picture, once two in a row are the same; colours 0-255, shape (row, column, 3)."""
    from PIL import Image

    before, until = b"", time.monotonic() + seconds
    while time.monotonic() < until:
        time.sleep(1.0)
        png = take()
        if png == before:
            break
        before = png
    return np.asarray(Image.open(io.BytesIO(before)).convert("RGB")).astype(int)


def count(picture: np.ndarray, colour: tuple[int, int, int], within: int = 14) -> int:
    """Number of pixels that have a colour, nearly."""
    return int((np.abs(picture - np.array(colour)).max(axis=2) <= within).sum())


def colours(picture: np.ndarray) -> int:
    """Number of colours that can be told apart."""
    return len(np.unique((picture // 16).reshape(-1, 3), axis=0))
