"""A panoramic laser scanner in simulation: a grid of azimuths and elevations, cast column by column.

All surfaces are upright or level, so a column of rays is a path in the plan: it is crossed with the plan once, and the
heights of all its rays follow from the crossings.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from buildings.scene import Scene

Array = NDArray[np.float64]
NONE = np.inf


@dataclass(frozen=True)
class Scanner:
    """`step_deg` is the angle between rays; noise (m) is drawn per scan between the two; the rest are chances."""

    step_deg: float = 0.85
    lowest_deg: float = -62.0
    noise: tuple[float, float] = (0.001, 0.003)
    mixed: float = 0.4
    dropout: float = 0.01
    shift: float = 0.0025
    turn_deg: float = 0.02
    reach: float = 40.0


class Caster:
    """Casts rays against a frozen scene."""

    def __init__(self, scene: Scene) -> None:
        self.quads, self.cylinders = scene.freeze()
        self.levels = [z for _, z in scene.levels]
        self.rings = np.concatenate([ring for ring, _ in scene.levels])
        self.ends = np.cumsum([len(ring) for ring, _ in scene.levels])[:-1]

    def cast(
        self, origin: Array, azimuth: Array, slope: Array, rng: Generator, beyond: Array | None = None
    ) -> tuple[Array, NDArray[np.int64]]:
        """Horizontal distance of the first surface for each column and slope, and the number of its quad or -1.

        Parameters
        ----------
        origin : (3,) of the scanner.
        azimuth, slope : (n,) directions in plan and (m,) tangents of elevation.
        beyond : (n,) horizontal distance before which surfaces do not count.
        """
        ray = np.column_stack([np.cos(azimuth), np.sin(azimuth)])
        beyond = np.full(len(azimuth), 0.25) if beyond is None else beyond
        far, quad = self._crossings(origin, ray, beyond)
        hit = np.full((len(azimuth), len(slope)), NONE)
        which = np.full(hit.shape, -1)
        for k in range(far.shape[1]):
            columns = np.flatnonzero(np.isfinite(far[:, k]))
            z = origin[2] + far[columns, k, None] * slope
            number = quad[columns, k]
            low, high, solid = self._heights(number)
            stops = (z >= low[:, None]) & (z <= high[:, None]) & ~np.isfinite(hit[columns])
            thin = solid < 1
            stops[thin] &= rng.random((int(thin.sum()), len(slope))) < solid[thin, None]
            row, column = np.nonzero(stops)
            hit[columns[row], column] = far[columns[row], k]
            which[columns[row], column] = number[row]
        rims = np.split(cross(origin, ray, self.rings), self.ends, axis=1)
        for far, z in zip(rims, self.levels, strict=True):
            self._level(z - origin[2], slope, beyond, far, hit, which)
        return hit, which

    def _heights(self, number: NDArray[np.int64]) -> tuple[Array, Array, Array]:
        count = len(self.quads)
        low, high, solid = np.empty((3, len(number)))
        flat = number < count
        low[flat], high[flat], solid[flat] = self.quads[number[flat], 4:7].T
        low[~flat], high[~flat] = self.cylinders[number[~flat] - count, 3:5].T
        solid[~flat] = 1.0
        return low, high, solid

    def _crossings(self, origin: Array, ray: Array, beyond: Array) -> tuple[Array, NDArray[np.int64]]:
        """Distances (n, k) at which each column crosses something, in order, and what; inf where there is no more."""
        far = cross(origin, ray, self.quads[:, :4])
        if len(self.cylinders):
            offset = self.cylinders[:, :2] - origin[:2]
            middle = ray @ offset.T
            root = self.cylinders[:, 2] ** 2 - (offset**2).sum(axis=1) + middle**2
            far = np.hstack([far, np.where(root > 0, middle - np.sqrt(np.maximum(root, 0)), NONE)])
        far[far <= beyond[:, None]] = NONE
        most = int(np.isfinite(far).sum(axis=1).max(initial=0))
        order = np.argsort(far, axis=1)[:, :most]
        return np.take_along_axis(far, order, axis=1), order

    def _level(
        self, rise: float, slope: Array, beyond: Array, far: Array, hit: Array, which: NDArray[np.int64]
    ) -> None:
        """Stop rays at a level polygon, `rise` above the scanner, whose rim the columns cross at `far` (n, edges)."""
        rows = np.flatnonzero(slope * rise > 0)
        columns = np.flatnonzero(np.isfinite(far).any(axis=1))
        if not len(columns) or not len(rows):
            return
        distance = rise / slope[rows]
        order = np.sort(far[columns], axis=1)
        # an odd number of edges still ahead: the ray comes down inside the ring
        ahead = np.zeros((len(columns), len(rows)), dtype=bool)
        for k in range(int(np.isfinite(order).sum(axis=1).max())):
            ahead ^= np.isfinite(order[:, k, None]) & (order[:, k, None] > distance)
        stops = ahead & (distance < hit[np.ix_(columns, rows)]) & (distance > beyond[columns, None])
        column, row = np.nonzero(stops)
        hit[columns[column], rows[row]] = distance[row]
        which[columns[column], rows[row]] = -1

    def mirrored(self, origin: Array, azimuth: Array, slope: Array, rng: Generator, hit: Array, which: Array) -> None:
        """Let the rays that met a mirror go on; what they meet is measured as if it lay behind the mirror."""
        for number in np.flatnonzero(self.quads[:, 10] > 0):
            columns = np.flatnonzero((which == number).any(axis=1))
            if not len(columns):
                continue
            x1, y1, x2, y2 = self.quads[number, :4]
            line = np.arctan2(y2 - y1, x2 - x1)
            normal = np.array([-np.sin(line), np.cos(line)])
            image = origin.copy()
            image[:2] -= 2 * ((origin[:2] - (x1, y1)) @ normal) * normal
            seen = which[columns] == number
            start = np.where(seen, hit[columns], NONE).min(axis=1)
            far, _ = self.cast(image, 2 * line - azimuth[columns], slope, rng, start + 0.005)
            hit[columns] = np.where(seen, far, hit[columns])
            which[columns] = np.where(seen, -1, which[columns])


def cross(origin: Array, ray: Array, lines: Array) -> Array:
    """Distance (n, q) along each ray in the plan to each segment; inf where they do not meet."""
    start, step = lines[:, :2] - origin[:2], lines[:, 2:] - lines[:, :2]
    with np.errstate(divide="ignore", invalid="ignore"):
        slant = ray[:, :1] * step[:, 1] - ray[:, 1:] * step[:, 0]
        far = (start[:, 0] * step[:, 1] - start[:, 1] * step[:, 0]) / slant
        along = (start[:, 0] * ray[:, 1:] - start[:, 1] * ray[:, :1]) / slant
        return np.where((along >= 0) & (along < 1) & (far > 0), far, NONE)


def scan(caster: Caster, scanner: Scanner, position: Array, rng: Generator) -> Array:
    """The points (n, 3) of one scan in the building's frame, with its noise and its error of registration."""
    step = np.radians(scanner.step_deg)
    azimuth = np.arange(0, 2 * np.pi, step) + rng.uniform(0, step)
    elevation = np.arange(np.radians(scanner.lowest_deg), np.pi / 2 - step / 2, step) + rng.uniform(0, step / 2)
    slope = np.tan(elevation)
    hit, which = caster.cast(position, azimuth, slope, rng)
    caster.mirrored(position, azimuth, slope, rng, hit, which)
    hit = _onto_arcs(caster.quads, position, azimuth, hit, which)
    reach = np.where(np.isfinite(hit), hit / np.cos(elevation), 1e9)
    reach = _mix(reach, scanner, rng)
    kept = (reach < scanner.reach) & (rng.random(reach.shape) > scanner.dropout)
    column, row = np.nonzero(kept)
    length = reach[kept] + rng.normal(0, rng.uniform(*scanner.noise), len(column))
    turn = azimuth[column] + rng.normal(0, np.radians(scanner.turn_deg))
    flat = length * np.cos(elevation[row])
    points = np.column_stack([flat * np.cos(turn), flat * np.sin(turn), length * np.sin(elevation[row])])
    return points + position + rng.normal(0, scanner.shift, 3)


def _onto_arcs(quads: Array, position: Array, azimuth: Array, hit: Array, which: NDArray[np.int64]) -> Array:
    """Lengthen or shorten the rays that hit a chord so that they end on its arc."""
    column, row = np.nonzero((which >= 0) & (which < len(quads)))
    number = which[column, row]
    bent = quads[number, 9] > 0
    column, row, arc = column[bent], row[bent], quads[number[bent], 7:10]
    ray = np.column_stack([np.cos(azimuth[column]), np.sin(azimuth[column])])
    away = position[:2] - arc[:, :2]
    middle = (ray * away).sum(axis=1)
    root = np.sqrt(np.maximum(middle**2 - (away**2).sum(axis=1) + arc[:, 2] ** 2, 0))
    both = np.stack([-middle - root, -middle + root])
    old = hit[column, row]
    new = np.take_along_axis(both, np.abs(both - old).argmin(axis=0)[None], axis=0)[0]
    hit[column, row] = np.where(np.abs(new - old) < 0.2, new, old)
    return hit


def _mix(reach: Array, scanner: Scanner, rng: Generator) -> Array:
    """Mixed pixels: at an edge the beam hits both surfaces, and the range lies between."""
    after = np.roll(reach, -1, axis=0)
    edge = (np.abs(reach - after) > 0.1) & (np.maximum(reach, after) < 1e6) & (rng.random(reach.shape) < scanner.mixed)
    return np.where(edge, reach + (after - reach) * rng.random(reach.shape), reach)
