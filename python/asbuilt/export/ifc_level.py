"""One storey of an IFC model, and how an element of the plan gets on it with what it can be trusted with."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import shapely

from asbuilt.export.ifc_file import Entity, Frame, IfcFile, Placed, Property
from asbuilt.plan import Element, Point, Storey, WallFace


@dataclass
class Level:
    """A storey under construction: the plan's, the model's, what this contains so far, and what is on which layer."""

    model: IfcFile
    storey: Storey
    placed: Placed
    contents: list[Entity] = field(default_factory=list)
    layers: dict[str, list[Entity]] = field(default_factory=dict)

    @property
    def floor(self) -> float:
        """Height of the floor in the plan's frame, m."""
        return self.storey.floor

    @cached_property
    def faces(self) -> dict[str, WallFace]:
        """The storey's wall faces by their ids."""
        return {face.id: face for face in self.storey.wall_faces if face.id}

    @property
    def height(self) -> float:
        """Height from floor to ceiling, m."""
        return self.storey.ceiling - self.storey.floor

    def add(
        self,
        kind: str,
        element: Element,
        frame: Frame,
        shape: Entity | None,
        layer: str,
        properties: Iterable[Property] = (),
        within: Placed | None = None,
        **attributes: Any,
    ) -> Placed:
        """Make an entity of an element of the plan, with its `Asbuilt_Trust`; who calls it says what contains it.

        Parameters
        ----------
        frame : where it stands; its representation is in this frame.
        shape : its representation, or None.
        layer : name of the layer it is drawn on, as in the DXF, without the storey's suffix.
        properties : what `Asbuilt_Trust` says beside the trust.
        within : what its place is given relative to; the storey where None.
        """
        name = element.id or f"S{self.storey.index}"
        placed = self.model.product(
            kind,
            name,
            frame,
            within or self.placed,
            Representation=shape,
            **{"Name": name, **attributes},
        )
        self.model.describe(placed.entity, [*trust(element), *properties])
        self.draw_on(layer, shape)
        return placed

    def draw_on(self, layer: str, shape: Entity | None) -> None:
        """Put a representation on a layer; nothing without one."""
        if shape is not None:
            self.layers.setdefault(f"{layer}-S{self.storey.index}", []).extend(shape.Representations)

    def finish(self) -> None:
        """Tell the storey what it contains, and the layers what is on them."""
        self.model.contain(self.placed.entity, self.contents)
        for name, shapes in sorted(self.layers.items()):
            self.model.make("IfcPresentationLayerAssignment", name, None, shapes)


def trust(element: Element) -> tuple[Property, ...]:
    """What an element can be trusted with; lengths in m."""
    return (
        ("Seen", "IfcNormalisedRatioMeasure", _share(element.seen)),
        ("Rms", "IfcLengthMeasure", element.rms),
        ("Voxels", "IfcInteger", element.voxels),
        ("Sigma", "IfcLengthMeasure", element.sigma),
        ("LOA", "IfcLabel", element.loa),
        ("Confidence", "IfcNormalisedRatioMeasure", _share(element.confidence)),
    )


def _share(value: float | None) -> float | None:
    return None if value is None else min(max(value, 0.0), 1.0)


def area_in(frame: Frame, ring: Iterable[Point], holes: Iterable[Iterable[Point]] = ()) -> Any:
    """A polygon of the plan in a frame; an empty one of fewer than three points."""
    outer = [frame.local(point) for point in ring]
    if len(outer) < 3:
        return shapely.Polygon()
    return shapely.Polygon(outer, [[frame.local(point) for point in hole] for hole in holes])
