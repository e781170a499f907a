"""What stands and hangs in rooms and is no wall: cupboards, beds, curtains, door leaves, lamps, people, mirrors."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.random import Generator
from shapely import Point, Polygon, box, unary_union

from buildings.model import Opening, Room, Storey, Style, edges, quad
from buildings.scene import Scene

#: kind of room: pieces along its walls as (width, depth, height) ranges, and how often each comes
ALONG = {
    "wardrobe": ((1.0, 2.4), (0.55, 0.65), (1.9, 2.25)),
    "built-in": ((1.2, 3.0), (0.4, 0.65), (0.0, 1.0)),  # the last is how near to the ceiling, see _height
    "shelf": ((0.8, 2.0), (0.25, 0.4), (1.2, 2.1)),
    "desk": ((1.2, 1.8), (0.65, 0.8), (0.74, 0.74)),
    "sofa": ((1.6, 2.4), (0.85, 0.95), (0.8, 0.8)),
    "bed": ((1.0, 1.9), (2.0, 2.1), (0.5, 0.6)),
    "counter": ((1.2, 2.8), (0.6, 0.65), (0.9, 0.9)),
    "fridge": ((0.6, 0.7), (0.6, 0.65), (1.7, 2.0)),
    "bath": ((0.7, 0.8), (1.6, 1.7), (0.58, 0.58)),
    "bench": ((0.9, 2.0), (0.35, 0.45), (0.45, 0.45)),
    "case": ((0.8, 1.6), (0.4, 0.6), (1.0, 1.9)),
}
ROOMS = {
    "living": ("sofa", "shelf", "shelf", "case", "built-in"),
    "bedroom": ("bed", "wardrobe", "desk", "shelf"),
    "kitchen": ("counter", "counter", "fridge", "built-in"),
    "bath": ("bath", "shelf"),
    "study": ("desk", "shelf", "shelf", "wardrobe"),
    "office": ("desk", "desk", "wardrobe", "shelf", "built-in"),
    "meeting": ("bench", "shelf"),
    "corridor": ("bench", "wardrobe"),
    "gallery": ("bench", "case", "case"),
    "store": ("shelf", "shelf", "shelf", "wardrobe"),
    "stairs": ("bench",),
    "closet": (),
}


class Furnisher:
    """Furnishes the rooms of one storey; nothing stands in a doorway or in another piece."""

    def __init__(self, rng: Generator, scene: Scene, storey: Storey, style: Style) -> None:
        self.rng, self.scene, self.storey, self.style = rng, scene, storey, style
        self.doorways = unary_union([o.box.buffer(0.45, join_style="mitre") for o in storey.openings if o.to_floor])
        self.stands: list[Polygon] = [column for column, _ in storey.columns]
        if storey.stairwell is not None:
            self.stands.append(storey.stairwell)

    def furnish(self) -> None:
        """Everything in all rooms."""
        for opening in self.storey.openings:
            if opening.kind == "door":
                self._leaf(opening)
            if opening.kind in ("window", "french"):
                self._window(opening)
        for room in self.storey.rooms:
            amount = self.style.furnished * min(7.0, 1.5 + 0.14 * room.polygon.area)
            for kind in self.rng.permutation(ROOMS[room.kind] * 2)[: self.rng.poisson(amount)]:
                self._along_wall(room, *ALONG[kind])
            if room.kind != "closet":
                self._loose(room, amount)
                self._hung(room)

    def _fits(self, room: Room, footprint: Polygon) -> bool:
        if not room.polygon.buffer(0.002).contains(footprint) or footprint.intersects(self.doorways):
            return False
        return not any(footprint.intersects(other) for other in self.stands)

    def _spot(self, room: Room, width: float, depth: float, gap: float) -> tuple[Polygon, np.ndarray] | None:
        """A free rectangle along one of the room's walls."""
        ring = edges(room.polygon)
        length = np.hypot(ring[:, 2] - ring[:, 0], ring[:, 3] - ring[:, 1])
        for _ in range(8):
            i = int(self.rng.choice(len(ring), p=length / length.sum()))
            if length[i] < width:
                continue
            along = (ring[i, 2:] - ring[i, :2]) / length[i]
            centre = ring[i, :2] + along * self.rng.uniform(width / 2, length[i] - width / 2)
            footprint = quad(tuple(centre), tuple(along), width, -gap, gap + depth)
            if self._fits(room, footprint):
                return footprint, along
        return None

    def _along_wall(self, room: Room, widths: tuple, depths: tuple, heights: tuple) -> None:
        width, depth = self.rng.uniform(*widths), self.rng.uniform(*depths)
        clear = self.storey.height if room.ceiling is None else room.ceiling
        height = min(_height(float(self.rng.uniform(*heights)), heights, clear - room.step), clear - room.step)
        spot = self._spot(room, width, depth, float(self.rng.choice([0.0, 0.01, 0.04])))
        if spot is None:
            return
        footprint = spot[0]
        windows = [o.box for o in self.storey.openings if o.kind == "window" and o.sill < room.step + height]
        if any(footprint.buffer(0.1).intersects(window) for window in windows):
            return
        self.stands.append(footprint)
        bottom = self.storey.floor + room.step
        if heights == ALONG["desk"][2] and self.rng.random() < 0.8:
            self.scene.level(footprint, bottom + height)
            for x, y in np.asarray(footprint.exterior.coords)[:4]:
                self.scene.block(box(x - 0.02, y - 0.02, x + 0.02, y + 0.02), bottom, bottom + height)
        elif heights == ALONG["shelf"][2]:
            self.scene.block(footprint, bottom, bottom + height, solid=0.75)
            for board in np.arange(0.35, height, 0.35):
                self.scene.level(footprint, bottom + board)
        else:
            self.scene.block(footprint, bottom, bottom + height)

    def _loose(self, room: Room, amount: float) -> None:
        """Tables, plants, people and lamps, away from the walls."""
        rng, bottom = self.rng, self.storey.floor + room.step
        top = self.storey.floor + (self.storey.height if room.ceiling is None else room.ceiling)
        x0, y0, x1, y1 = room.polygon.bounds
        for _ in range(rng.poisson(0.5 * amount) + 1):
            x, y = float(rng.uniform(x0, x1)), float(rng.uniform(y0, y1))
            kind = rng.choice(["table", "plant", "person", "lamp", "chair", "screen"])
            if kind == "lamp":
                if room.polygon.contains(Point(x, y).buffer(0.4)) and room.ceiling is not None:
                    drop = float(rng.uniform(0.4, 0.9))
                    self.scene.cylinder(x, y, float(rng.uniform(0.1, 0.3)), top - drop, top - drop + 0.2)
                    self.scene.cylinder(x, y, 0.01, top - drop + 0.2, top)
                continue
            turn = rng.uniform(0, np.pi)
            size = {"table": (1.4, 0.45), "chair": (0.45, 0.22), "screen": (1.5, 0.02)}.get(str(kind), (0.5, 0.25))
            footprint = quad((x, y), (np.cos(turn), np.sin(turn)), size[0], size[1], size[1])
            if not self._fits(room, footprint.buffer(0.15)):
                continue
            self.stands.append(footprint)
            if kind == "table":
                self.scene.block(footprint, bottom + 0.7, bottom + 0.74)
                self.scene.cylinder(x, y, 0.05, bottom, bottom + 0.7)
            elif kind == "person":
                self.scene.cylinder(x, y, 0.21, bottom, bottom + 1.5)
                self.scene.cylinder(x, y, 0.1, bottom + 1.5, bottom + 1.75)
            elif kind == "plant":
                self._plant(x, y, bottom, float(rng.uniform(0.6, 1.8)))
            else:
                self.scene.block(footprint, bottom, bottom + (0.85 if kind == "chair" else 1.5))

    def _plant(self, x: float, y: float, bottom: float, height: float) -> None:
        self.scene.cylinder(x, y, 0.15, bottom, bottom + 0.3)
        for _ in range(40):
            turn, size = self.rng.uniform(0, np.pi), self.rng.uniform(0.04, 0.1)
            middle = np.array([x, y]) + self.rng.normal(0, 0.12, 2)
            along = size * np.array([np.cos(turn), np.sin(turn)])
            z = bottom + 0.3 + (height - 0.3) * self.rng.random()
            self.scene.wall(middle - along, middle + along, z - size, z + size)

    def _hung(self, room: Room) -> None:
        """Boards, pictures and mirrors on walls, beams under the ceiling."""
        rng, bottom = self.rng, self.storey.floor + room.step
        for _ in range(rng.poisson(1.2)):
            spot = self._spot(room, float(rng.uniform(0.4, 1.8)), float(rng.uniform(0.015, 0.04)), 0.0)
            if spot is not None and not any(spot[0].intersects(o.box) for o in self.storey.openings):
                low = float(rng.uniform(0.8, 1.3))
                self.scene.block(spot[0], bottom + low, bottom + low + float(rng.uniform(0.4, 1.0)))
        if rng.random() < self.style.mirror:
            spot = self._spot(room, float(rng.uniform(0.8, 1.4)), 0.03, 0.0)
            if spot is not None and not any(spot[0].intersects(o.box) for o in self.storey.openings):
                ring = np.asarray(spot[0].exterior.coords)
                self.scene.wall(ring[3], ring[2], bottom + 0.3, bottom + 1.9, mirror=True)
                self.stands.append(spot[0].buffer(0.2))
        if room.ceiling is not None and rng.random() < self.style.beam:
            self._beams(room)

    def _beams(self, room: Room) -> None:
        """Beams across the room, parallel to one of its walls."""
        ring = edges(room.polygon)
        edge = ring[np.argmax(np.hypot(ring[:, 2] - ring[:, 0], ring[:, 3] - ring[:, 1]))]
        along = edge[2:] - edge[:2]
        length = float(np.hypot(*along))
        along /= length
        top = self.storey.floor + (room.ceiling or 0.0)
        for at in np.arange(self.rng.uniform(0.5, 1.2), length, self.rng.uniform(0.9, 2.5)):
            beam = quad(tuple(edge[:2] + at * along), tuple(along), 0.2, 0.0, 60.0).intersection(room.polygon)
            for part in getattr(beam, "geoms", [beam]):
                if isinstance(part, Polygon) and part.area > 0.05:
                    self.scene.block(part, top - 0.22, top - 0.001)

    def _leaf(self, opening: Opening) -> None:
        """The leaf of a door: shut, or somewhere between ajar and flat against the wall."""
        (a, b), z0 = (np.array(jamb) for jamb in opening.jambs), self.storey.floor + opening.sill
        z1 = z0 + (opening.head - opening.sill) - 0.01
        hinge, latch = (a, b) if self.rng.random() < 0.5 else (b, a)
        side = int(self.rng.integers(2))  # the room into which it opens
        start, end = hinge[side], latch[side]
        out = hinge[side] - hinge[1 - side]
        out /= np.hypot(*out)
        if opening.closed:
            depth = 0.05 * out
            self.scene.wall(start, end, z0, z1)
            self.scene.wall(start - depth, end - depth, z0, z1)
            return
        along = (end - start) / np.hypot(*(end - start))
        turn = np.radians(self.rng.uniform(50, 115))
        leaf = (along * np.cos(turn) + out * np.sin(turn)) * opening.width
        thick = np.array([-leaf[1], leaf[0]]) / opening.width * 0.04
        foot = start + 0.02 * out + 0.03 * along
        self.scene.block(Polygon([foot, foot + leaf, foot + leaf + thick, foot + thick]), z0 + 0.01, z1)

    def _window(self, opening: Opening) -> None:
        """Frame and mullion in the middle of the wall, a radiator under it, curtains before it."""
        p, q = (np.array(end) for end in opening.line)
        along = (q - p) / np.hypot(*(q - p))
        z0, z1 = self.storey.floor + opening.sill, self.storey.floor + opening.head
        frame = 0.07
        for at in (0.0, opening.width / 2 - frame / 2, opening.width - frame):
            self.scene.wall(p + at * along, p + (at + frame) * along, z0, z1)
        self.scene.wall(p, q, z0, z0 + frame)
        self.scene.wall(p, q, z1 - frame, z1)
        self.scene.wall(p, q, z0, z1, solid=0.02)  # dust on the glass
        room = self.storey.rooms[opening.rooms[0]]
        middle = np.mean([np.array(jamb) for jamb in opening.jambs], axis=0)
        spot = min(middle, key=lambda end: room.polygon.distance(Point(end)))
        inward = np.array([-along[1], along[0]])
        inward *= 1 if room.polygon.contains(Point(spot + 0.1 * inward)) else -1
        bottom = self.storey.floor + room.step
        if opening.sill - room.step > 0.55 and self.rng.random() < 0.6:
            foot = spot + 0.05 * inward
            side = along * opening.width * 0.4
            radiator = Polygon([foot - side, foot + side, foot + side + 0.1 * inward, foot - side + 0.1 * inward])
            if self._fits(room, radiator):
                self.stands.append(radiator)
                self.scene.block(radiator, bottom + 0.1, bottom + opening.sill - room.step - 0.08)
        if self.rng.random() < 0.4:
            self._curtain(room, spot, along, inward, opening)

    def _curtain(self, room: Room, spot: np.ndarray, along: np.ndarray, inward: np.ndarray, opening: Opening) -> None:
        """A wave of cloth on each side of the window, from the rail to near the floor."""
        bottom, rail = self.storey.floor + room.step + 0.03, self.storey.floor + opening.head + 0.1
        top = min(rail, self.storey.floor + (room.ceiling or self.storey.height) - 0.02)
        wide = float(self.rng.uniform(0.25, 0.5)) * opening.width
        for sign in (-1, 1):
            at = np.arange(0, wide, 0.03)
            wave = 0.14 + 0.035 * np.sin(at * 2 * np.pi / 0.16)
            cloth = spot + sign * (opening.width / 2 + 0.12 - at)[:, None] * along + wave[:, None] * inward
            if all(room.polygon.contains(Point(end)) for end in (cloth[0], cloth[-1])):
                for a, b in itertools.pairwise(cloth):
                    self.scene.wall(a, b, bottom, top, solid=0.95)


def _height(drawn: float, heights: tuple, clear: float) -> float:
    """Built-in cupboards: one in four reaches the ceiling, and nobody could tell it from a wall; most leave a gap."""
    if heights != ALONG["built-in"][2]:
        return drawn
    return clear if drawn < 0.25 else clear - 0.05 - 0.25 * drawn
