"""What the report tells of an element when it is pointed at: labels and values, as a person reads them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from asbuilt.plan import LOA_BANDS, Column, Door, Element, Opening, Room, Stair, Storey, Wall, WallFace, Window
from asbuilt.report.registration import ScanOffset
from asbuilt.report.tilt import Pair

Line = tuple[str, str]
_NAMES: dict[type, str] = {
    WallFace: "Wall face",
    Wall: "Wall",
    Door: "Door",
    Window: "Window",
    Room: "Room",
    Column: "Column",
    Stair: "Stair",
}
_UNSEEN = "not observed"


@dataclass(frozen=True)
class Measure:
    """A measure of trust that walls can be coloured by: its name, its title, and its bands, the best first."""

    name: str
    title: str
    bands: tuple[str, ...]


MEASURES = (
    Measure("loa", "Level of accuracy (USIBD, 95 %)", tuple(LOA_BANDS)),
    Measure(
        "confidence", "Confidence that it is real", ("0.95 and more", "from 0.90", "from 0.80", "from 0.60", "less")
    ),
    Measure(
        "seen", "Coverage: share of the length seen", ("90 % and more", "from 70 %", "from 50 %", "from 30 %", "less")
    ),
)
_LEAST = {"confidence": (0.95, 0.9, 0.8, 0.6), "seen": (0.9, 0.7, 0.5, 0.3)}


def bands(element: Element) -> dict[str, int | None]:
    """The number of an element's band by each of `MEASURES`, 0 the best; None where it is not known."""
    loa = None if element.loa is None else list(LOA_BANDS).index(element.loa)
    by_value = {
        name: None if (value := getattr(element, name)) is None else sum(value < limit for limit in least)
        for name, least in _LEAST.items()
    }
    return {"loa": loa, **by_value}


def title(element: Element) -> str:
    """What an element is called: its kind, and its id or, for a room, its number."""
    name = element.number or element.id if isinstance(element, Room) else element.id
    return f"{_NAMES.get(type(element), 'Unknown opening')} {name}".rstrip()


def lines(element: Element, storey: Storey, lean: Pair | None = None) -> list[Line]:
    """All that is known of an element; `lean` is that of a wall face, m/m, with its standard error."""
    return [*_own(element, storey), *_lean(lean, storey), *_trust(element)]


def scan_lines(scan: ScanOffset) -> list[Line]:
    """All that is known of a scan."""
    found = [("Points", f"{scan.points:,}"), ("Shared wall faces", str(scan.faces))]
    if scan.offset is not None and scan.error is not None:
        found += [
            (f"Offset along {axis}", f"{signed_mm(value)} ± {1000 * error:.1f} mm")
            for axis, value, error in zip("xy", scan.offset, scan.error, strict=True)
        ]
        found.append(("Compared with", ", ".join(f"{key} ({100 * part:.0f} %)" for key, part in scan.against[:4])))
    return [*found, ("Remark", scan.remark)] if scan.remark else found


def metres(value: float | None, digits: int = 3) -> str:
    """A length, m, or that it was not observed.

    >>> metres(0.1), metres(None)
    ('0.100 m', 'not observed')
    """
    return _UNSEEN if value is None else f"{value:.{digits}f} m"


def millimetres(value: float | None) -> str:
    """A small length (m) in millimetres, or that it is not known."""
    return "not known" if value is None else f"{1000 * value:.1f} mm"


def signed_mm(value: float) -> str:
    """A small length (m) in millimetres, with its sign and without the unit.

    >>> signed_mm(0.0012), signed_mm(-0.00001)
    ('+1.2', '+0.0')
    """
    return f"{round(1000 * value, 1) + 0.0:+.1f}"


def _own(element: Element, storey: Storey) -> Iterator[Line]:
    """What only elements of its kind have."""
    if isinstance(element, Wall):
        yield "Thickness", metres(element.thickness)
        if element.thickness is None:
            yield "Drawn with", metres(element.drawn_thickness)
        yield "Height", "to the ceiling" if element.height is None else metres(element.height, 2)
        yield "Wall faces", ", ".join(element.faces) or "none"
    elif isinstance(element, Opening):
        yield "Clear width", metres(element.width)
        yield "Sill above floor", metres(element.sill, 2)
        yield "Head above floor", metres(element.head, 2)
        yield "In wall", element.wall or "not known"
        if isinstance(element, Door):
            yield "State", element.state
            if element.hinge and element.swing:
                yield "Hinge and swing", f"at its {element.hinge}, to the {element.swing}"
    elif isinstance(element, Room):
        yield "Area", f"{element.area:.2f} m²"
        yield "Perimeter", metres(element.perimeter, 2)
        yield "Clear height", metres(element.height)
        yield "Floor", "not observed" if element.floor is None else f"z {element.floor:.3f} m"
        yield "Scans in it", ", ".join(element.scans) or "not known"
    elif isinstance(element, Column):
        size = f"{element.width:.3f} m" if element.shape == "round" else f"{element.width:.3f} x {element.depth:.3f} m"
        yield "Diameter" if element.shape == "round" else "Sides", size
    elif isinstance(element, Stair):
        yield "Rise", metres(element.rise, 2)
    if isinstance(element, Wall | WallFace):
        yield "Length", metres(element.length)


def _lean(lean: Pair | None, storey: Storey) -> Iterator[Line]:
    if lean is not None:
        height = storey.ceiling - storey.floor
        value, error = (1000 * height * part for part in lean)
        side = "towards its room" if value > 0 else "away from its room"
        yield "Out of plumb", f"{abs(value):.1f} ± {error:.1f} mm over {height:.2f} m, {side}"


def _trust(element: Element) -> Iterator[Line]:
    """What was worked out."""
    if element.seen is not None:
        yield "Seen", f"{100 * element.seen:.0f} %"
    if element.rms is not None:
        yield "Residual (rms)", millimetres(element.rms)
    yield "Sigma of its place", millimetres(element.sigma)
    yield "LOA at 95 %", element.loa or "not known"
    yield "Confidence", "not known" if element.confidence is None else f"{element.confidence:.2f}"
    if element.voxels:
        yield "Voxels", f"{element.voxels:,}"
