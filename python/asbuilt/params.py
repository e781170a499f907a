"""Every parameter, with its unit, meaning and default: here and nowhere else.

One frozen dataclass a stage, gathered in `Parameters`. `Parameters.preset("paper")` is exactly the paper's best
setting (section 5.1: k = 2.5, fill gap 0.7 m, minimum length 0.2 m, snapping within 5 degrees; 5.2: incremental;
5.3: the nine slices of 10 cm that hold least). `Parameters.preset("default")` is what serves buildings best; each
dataclass says where it departs from the paper.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, Literal

from asbuilt.errors import ParameterError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def _check(condition: bool, name: str, value: object, expected: str) -> None:
    if not condition:
        raise ParameterError(f"{name} = {value}: expected {expected}")


_KINDS = {"float": (Real, "a number"), "int": (Integral, "a whole number"), "bool": (bool, "true or false")}
"""What values of fields may be, and its name, by what they are declared as."""


def _check_values(stage: str, parameters: DataclassInstance) -> None:
    for declared in dataclasses.fields(parameters):
        name, value = f"{stage}.{declared.name}", getattr(parameters, declared.name)
        if declared.type in _KINDS:
            kind, expected = _KINDS[str(declared.type)]
            _check(isinstance(value, kind) and isinstance(value, bool) == (kind is bool), name, value, expected)
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, float):
                _check(math.isfinite(number), name, value, "a finite number")


@dataclass(frozen=True)
class EvidenceParameters:
    """Section 3.1, with moments added.

    Attributes
    ----------
    voxel : side of an evidence voxel, m; a multiple of 0.1 mm. Smaller keeps surfaces apart that lie closer together,
        for memory that grows with its inverse square. An evidence file has a voxel of its own, which stands; another
        than that or the default is refused.
    occupancy : keep only which voxels hold a point. Takes less time and memory, and serves the paper's method alone,
        as precisely as its voxels are small.
    preview : of files with levels of detail (COPC), read only those down to a spacing of half a voxel.
    """

    voxel: float = 0.05
    occupancy: bool = False
    preview: bool = False

    def __post_init__(self) -> None:
        _check_values("evidence", self)
        _check(0 < self.voxel <= 1, "evidence.voxel", self.voxel, "a length in (0, 1] m")


@dataclass(frozen=True)
class StoreyParameters:
    """Section 3.1: floors and ceilings from horizontal surfaces.

    Attributes
    ----------
    voxel : side of the voxels that the histograms count, m; a multiple of the evidence voxel. 0.1 in the paper.
    headroom : least free height above a floor, m; not in the paper. Larger ignores attics and crawl spaces.
    min_area_share : a floor with less than this share of the largest storey's area is none; not in the paper.
    slab : the histogram leaves out voxels within this distance of floor and ceiling, m; 0 keeps all.
    """

    voxel: float = 0.1
    headroom: float = 1.7
    min_area_share: float = 0.04
    slab: float = 0.1

    def __post_init__(self) -> None:
        _check_values("storeys", self)
        _check(self.voxel > 0, "storeys.voxel", self.voxel, "a length above 0 m")
        _check(self.headroom > 0.5, "storeys.headroom", self.headroom, "more than 0.5 m")
        _check(0 <= self.min_area_share <= 1, "storeys.min_area_share", self.min_area_share, "a share in [0, 1]")
        _check(self.slab >= 0, "storeys.slab", self.slab, "a length of at least 0 m")


@dataclass(frozen=True)
class CrossSectionParameters:
    """Section 5.3: which heights go into the ground-plane histogram.

    Attributes
    ----------
    select : "all" heights, one "band", or the "lowest" density slices of the height histogram.
    slice : height of a slice, m; a multiple of the evidence voxel.
    count : number of slices for "lowest" (the paper's N, best at 9).
    band : lower and upper height above the floor for "band", m.
    """

    select: Literal["all", "band", "lowest"] = "lowest"
    slice: float = 0.1
    count: int = 9
    band: tuple[float, float] = (1.0, 2.5)

    def __post_init__(self) -> None:
        _check_values("cross_sections", self)
        _check(self.select in ("all", "band", "lowest"), "cross_sections.select", self.select, "all, band or lowest")
        _check(self.slice > 0, "cross_sections.slice", self.slice, "a length above 0 m")
        _check(self.count > 0, "cross_sections.count", self.count, "at least 1")
        _check(self.band[0] < self.band[1], "cross_sections.band", self.band, "the lower height first")
        if self.count != CrossSectionParameters.count:
            _check(self.select == "lowest", "cross_sections.count", self.count, "select = lowest with it")
        if self.band != CrossSectionParameters.band:
            _check(self.select == "band", "cross_sections.band", self.band, "select = band with it")


@dataclass(frozen=True)
class LineParameters:
    """Section 3.3: the Hough transform over the ground-plane histogram.

    Attributes
    ----------
    sigmas : a cell takes part when its count exceeds the mean by this many standard deviations (k). 2 in section 3.3,
        2.5 in 5.1. Larger drops more clutter and more faint walls.
    statistics_over : cells of the mean and deviation: "all" of the storey's rectangle, or the "occupied" ones. The
        paper does not say which.
    method : "incremental" or "batch" (5.2).
    theta_step : step of the line's orientation, rad.
    rho_step : step of the line's distance from the origin, in voxels.
    fill_gap : gaps along a line up to this length are bridged, m.
    min_length : shorter segments are dropped, m.
    min_votes : stop when the strongest line has fewer votes (the paper's stop by strength).
    max_lines : stop after this many lines (the paper's stop by number).
    """

    sigmas: float = 2.5
    statistics_over: Literal["all", "occupied"] = "all"
    method: Literal["incremental", "batch"] = "incremental"
    theta_step: float = 0.017453292519943295
    rho_step: float = 1.0
    fill_gap: float = 0.7
    min_length: float = 0.2
    min_votes: int = 4
    max_lines: int = 100_000

    def __post_init__(self) -> None:
        _check_values("lines", self)
        _check(self.method in ("incremental", "batch"), "lines.method", self.method, "incremental or batch")
        _check(0 < self.theta_step <= 1.6, "lines.theta_step", self.theta_step, "an angle in (0, 1.6] rad")
        _check(self.rho_step > 0, "lines.rho_step", self.rho_step, "more than 0 voxels")
        _check(self.fill_gap >= 0, "lines.fill_gap", self.fill_gap, "a length of at least 0 m")
        _check(self.min_length >= 0, "lines.min_length", self.min_length, "a length of at least 0 m")
        _check(self.min_votes > 0, "lines.min_votes", self.min_votes, "at least 1")
        _check(self.max_lines > 0, "lines.max_lines", self.max_lines, "at least 1")
        known = ("all", "occupied")
        _check(self.statistics_over in known, "lines.statistics_over", self.statistics_over, "all or occupied")


@dataclass(frozen=True)
class OrientationParameters:
    """Section 3.4: dominant orientations.

    Attributes
    ----------
    bin : width of a bin of the length-weighted distribution, rad.
    snap : segments within this angle of a dominant orientation turn to it, rad; 0 snaps none.
    """

    bin: float = 0.017453292519943295
    snap: float = 0.08726646259971647

    def __post_init__(self) -> None:
        _check(0 < self.bin < 0.8, "orientation.bin", self.bin, "an angle in (0, 0.8) rad")
        _check(0 <= self.snap < 0.8, "orientation.snap", self.snap, "an angle in [0, 0.8) rad")


@dataclass(frozen=True)
class RefineParameters:
    """The clean-up after section 3.4.

    Attributes
    ----------
    merge : join collinear pieces and fit each line to its cells.
    merge_angle : pieces turned less against each other may be collinear, rad.
    merge_distance : collinear pieces lie within this distance of one line, m.
    merge_gap : collinear pieces with a gap up to this are one, m.
    """

    merge: bool = True
    merge_angle: float = 0.05235987755982989
    merge_distance: float = 0.1
    merge_gap: float = 0.7

    def __post_init__(self) -> None:
        _check_values("refine", self)
        _check(0 <= self.merge_angle < 0.8, "refine.merge_angle", self.merge_angle, "an angle in [0, 0.8) rad")
        _check(self.merge_distance >= 0, "refine.merge_distance", self.merge_distance, "a length of at least 0 m")
        _check(self.merge_gap >= 0, "refine.merge_gap", self.merge_gap, "a length of at least 0 m")


@dataclass(frozen=True)
class WallParameters:
    """Walls by the vertical profile of each cell; not in the paper.

    Attributes
    ----------
    min_profile : cells with less height filled take no part in the search for lines, m. Larger is faster and misses
        walls that are mostly hidden.
    band : voxels within this distance of a line belong to it, m. Larger stands more noise, and merges faces that lie
        closer together than twice as much.
    trace_gap : a line is followed across gaps up to this, m.
    bridge : pieces of one plane with a gap up to this may be one wall, if what lies between can be hidden wall, m.
    closing : gaps between scan lines up to this are filled when an elevation is read, m.
    min_score, drop : a run of steps is a wall if its score reaches `min_score`; it ends where the score falls by
        `drop` below its highest; both as metres of wall, about half as long where it is well seen.
    extend, trim : a face is drawn out to a corner by up to `extend`, and cut back to one by up to `trim`, m.
    min_length : shorter faces are not drawn, m.
    unseen_thickness : thickness with which a wall is drawn of which one face was seen, m.
    """

    min_profile: float = 0.3
    band: float = 0.03
    trace_gap: float = 0.7
    bridge: float = 4.5
    closing: float = 0.45
    min_score: float = 0.2
    drop: float = 0.25
    extend: float = 2.0
    trim: float = 0.8
    min_length: float = 0.1
    unseen_thickness: float = 0.1

    def __post_init__(self) -> None:
        _check_values("walls", self)
        _check(0 < self.unseen_thickness < 1, "walls.unseen_thickness", self.unseen_thickness, "a length in (0, 1) m")
        _check(0 < self.band < 0.2, "walls.band", self.band, "a length in (0, 0.2) m")
        for name in ("min_profile", "trace_gap", "bridge", "closing", "extend", "trim", "min_length"):
            _check(getattr(self, name) >= 0, f"walls.{name}", getattr(self, name), "a length of at least 0 m")


_PRESET_OF = {"paper": "paper", "profile": "default"}
"""The preset of each method."""
_READ_BY_ONE = {
    "paper": ("storeys.slab", "cross_sections", "lines", "orientation", "refine"),
    "profile": ("walls",),
}
"""Stages, and parameters of others, that one method alone reads."""


@dataclass(frozen=True)
class Parameters:
    """All parameters of a run.

    Attributes
    ----------
    method : "paper" finds walls by sections 3.2 to 3.4 and 5.3; "profile" by the vertical profile of each cell
        (not in the paper; see `asbuilt.profiles` to `asbuilt.corners`).

    Raises
    ------
    ParameterError : a parameter was changed that the method does not read.
    """

    preset_name: str = "default"
    method: Literal["paper", "profile"] = "profile"
    evidence: EvidenceParameters = field(default_factory=EvidenceParameters)
    storeys: StoreyParameters = field(default_factory=StoreyParameters)
    cross_sections: CrossSectionParameters = field(default_factory=CrossSectionParameters)
    lines: LineParameters = field(default_factory=LineParameters)
    orientation: OrientationParameters = field(default_factory=OrientationParameters)
    refine: RefineParameters = field(default_factory=RefineParameters)
    walls: WallParameters = field(default_factory=WallParameters)

    def __post_init__(self) -> None:
        _check(self.method in _PRESET_OF, "method", self.method, "paper or profile")
        whole, part = self.storeys.voxel, self.evidence.voxel
        if part != EvidenceParameters.voxel:  # else an evidence file may tell another one
            fits = round(whole / part) >= 1 and abs(whole - round(whole / part) * part) < 1e-9
            expected = f"storeys.voxel = {whole:g} m or a whole part of it, such as {whole / 2:g} or {whole / 4:g}"
            _check(fits, "evidence.voxel", f"{part:g}", expected)
        for method, alone in _READ_BY_ONE.items():
            changed = (
                () if method == self.method else ((name, value) for s in alone for name, value in self._changed(s))
            )
            for name, value in changed:
                raise ParameterError(
                    f"{name} = {value}: preset {_PRESET_OF[self.method]} does not read it; leave it out, or take "
                    f"preset {_PRESET_OF[method]}, which does"
                )

    def _changed(self, name: str) -> Iterator[tuple[str, object]]:
        """Names and values of a stage's parameters, or of one of them, that are not the defaults."""
        stage = name.partition(".")[0]
        for own in dataclasses.fields(getattr(self, stage)):
            value = getattr(getattr(self, stage), own.name)
            if name in (stage, f"{stage}.{own.name}") and value != own.default:
                yield f"{stage}.{own.name}", value

    @classmethod
    def preset(cls, name: str = "default") -> Parameters:
        """The parameters of a preset, "default" or "paper".

        Raises
        ------
        ParameterError : there is no preset of that name.
        """
        if name == "default":
            return cls()
        if name == "paper":
            return cls(preset_name="paper", method="paper")
        raise ParameterError(f"preset {name!r}: expected default or paper")

    def replace(self, **stages: Any) -> Parameters:
        """A copy with changes: ``replace(lines={"sigmas": 2.0})``, or a whole dataclass for a stage.

        Raises
        ------
        ParameterError : a stage or parameter does not exist, or a value is out of its range.
        """
        changes: dict[str, Any] = {}
        for stage, change in stages.items():
            if stage not in {f.name for f in dataclasses.fields(self)}:
                stages_of = ", ".join(f.name for f in dataclasses.fields(self) if f.default is dataclasses.MISSING)
                raise ParameterError(f"parameters have no stage {stage!r}; they have {stages_of}")
            if isinstance(change, dict):
                names = [known.name for known in dataclasses.fields(getattr(self, stage))]
                unknown = next((name for name in change if name not in names), None)
                if unknown is not None:
                    raise ParameterError(f"{stage}.{unknown}: no such parameter; {stage} has {', '.join(names)}")
                change = dataclasses.replace(getattr(self, stage), **change)
            changes[stage] = change
        return dataclasses.replace(self, **changes)

    def as_dict(self) -> dict[str, Any]:
        """Plain dicts, as written into every output."""
        return dataclasses.asdict(self)
