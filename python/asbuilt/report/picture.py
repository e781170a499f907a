"""The density of the points as a small picture that stands within the page."""

from __future__ import annotations

import base64
import io

import numpy as np

from asbuilt.density import density_image
from asbuilt.evidence import Evidence
from asbuilt.export.sheet import Bounds
from asbuilt.grid import FloatArray
from asbuilt.plan import Storey

_LONG_SIDE = 1600
"""Pixels at most along a side: what a screen shows, and small for a school."""
_GREYS = 16
_CONTRAST = 1.5
"""Larger is paler where little stands: table tops, and ceilings below the storey's."""


def density_picture(evidence: Evidence, storey: Storey) -> tuple[str, Bounds] | None:
    """A PNG as a data URI, clear where nothing is, and its corners x0, y0, x1, y1, m; None where no point lies.

    Grey by the logarithm: a wall holds a hundred times the points of a table, and both should be seen.
    """
    from PIL import Image  # heavy: help and errors do not wait for it

    image, (x0, x1, y0, y1) = density_image(evidence, storey)
    if image.size == 0:
        return None
    block = -(-max(image.shape) // _LONG_SIDE)
    shrunk = _sum_blocks(image, block)
    logarithm = np.log1p(shrunk)
    top = float(np.quantile(logarithm[logarithm > 0], 0.99)) if (logarithm > 0).any() else 1.0
    level = np.round(np.minimum(logarithm / top, 1.0) ** _CONTRAST * (_GREYS - 1)).astype(np.uint8)
    picture = Image.fromarray(level[::-1])
    picture.putpalette([255 - round(190 * i / (_GREYS - 1)) for i in range(_GREYS) for _ in range(3)])
    stream = io.BytesIO()
    picture.save(stream, format="PNG", optimize=True, bits=4, transparency=0)
    height, width = (block * size for size in shrunk.shape)  # the last block may reach beyond the picture
    across, up = (x1 - x0) / image.shape[1], (y1 - y0) / image.shape[0]
    uri = "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode("ascii")
    return uri, (x0, y0, x0 + width * across, y0 + height * up)


def _sum_blocks(image: FloatArray, block: int) -> FloatArray:
    """The sums of square blocks of cells."""
    padded = np.pad(image, [(0, -size % block) for size in image.shape])
    rows, columns = (size // block for size in padded.shape)
    sums: FloatArray = padded.reshape(rows, block, columns, block).sum(axis=(1, 3))
    return sums
