"""One storey of an IFC model, and how an element of the plan gets on it with what it can be trusted with."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import shapely

from asbuilt.export.ifc_file import Entity, Frame, IfcFile, Placed, Property
from asbuilt.plan import Element, Point, Storey


@dataclass
class Level:
    """A storey under construction: the plan's, the model's, and the elements that the latter contains so far."""

    model: IfcFile
    storey: Storey
    placed: Placed
    contents: list[Entity] = field(default_factory=list)

    @property
    def floor(self) -> float:
        """Height of the floor in the plan's frame, m."""
        return self.storey.floor

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
        properties: Iterable[Property] = (),
        within: Placed | None = None,
        **attributes: Any,
    ) -> Placed:
        """Make an entity of an element of the plan, with its `Pset_AsBuilt`; who calls it says what contains it.

        Parameters
        ----------
        frame : where it stands; its representation is in this frame.
        shape : its representation, or None.
        properties : what `Pset_AsBuilt` says beside the trust.
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
        self.model.describe(placed.entity, "Pset_AsBuilt", [*trust(element), *properties])
        return placed


def trust(element: Element) -> tuple[Property, ...]:
    """What an element can be trusted with; lengths in m."""
    return (
        ("Seen", "IfcNormalisedRatioMeasure", element.seen),
        ("Rms", "IfcLengthMeasure", element.rms),
        ("Voxels", "IfcInteger", element.voxels),
        ("Sigma", "IfcLengthMeasure", element.sigma),
        ("LOA", "IfcLabel", element.loa),
        ("Confidence", "IfcNormalisedRatioMeasure", element.confidence),
    )


def area_in(frame: Frame, ring: Iterable[Point], holes: Iterable[Iterable[Point]] = ()) -> Any:
    """A polygon of the plan in a frame; an empty one of fewer than three points."""
    outer = [frame.local(point) for point in ring]
    if len(outer) < 3:
        return shapely.Polygon()
    return shapely.Polygon(outer, [[frame.local(point) for point in hole] for hole in holes])
