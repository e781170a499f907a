"""The height histogram of the cloud with its storeys and the heights that made the walls (figure 2 of the paper)."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from asbuilt.cross_sections import select_cross_sections
from asbuilt.evidence import Evidence
from asbuilt.grid import IntArray
from asbuilt.params import CrossSectionParameters, StoreyParameters
from asbuilt.plan import FloorPlan
from asbuilt.report.markup import number, tag
from asbuilt.storeys import Level, drop_strays, height_histogram

_BAR = 7.0
"""Height of a bar, in units of the drawing; below, the width of the longest, and of what is written beside them."""
_WIDTH, _LEFT, _RIGHT = 420.0, 64.0, 190.0
_BEYOND = 1.0
"""Shown below the lowest floor and above the highest ceiling, m."""


def draw_heights(plan: FloorPlan, evidence: Evidence) -> ET.Element | None:
    """Bars of occupied voxels by height, the chosen ones darker, and a line for each floor and ceiling.

    None for a cloud that holds nothing but strays.
    """
    voxel = float(plan.parameters.get("storeys", {}).get("voxel", StoreyParameters().voxel))
    occupied = drop_strays(evidence.occupied(voxel))
    histogram = height_histogram(occupied, voxel)
    if histogram.counts.sum() == 0:
        return None
    shown = np.ones(len(histogram.counts), dtype=np.bool_)
    if plan.storeys:
        low, high = plan.storeys[0].floor - _BEYOND, max(storey.ceiling for storey in plan) + _BEYOND
        shown = (histogram.heights > low) & (histogram.heights < high)
    bins, chosen = np.flatnonzero(shown), _chosen(plan, occupied, voxel)
    longest = max(int(histogram.counts[bins].max(initial=0)), 1)
    top = histogram.low + (int(bins.max(initial=0)) + 1) * voxel

    def height(z: float) -> str:
        return number((top - z) / voxel * _BAR)

    drawn = [
        tag(
            "rect",
            tag("title", f"z {histogram.heights[i]:.2f} m: {histogram.counts[i]:,} voxels"),
            x=number(_LEFT),
            y=height(histogram.low + (i + 1) * voxel),
            width=number(_WIDTH * float(histogram.counts[i]) / longest),
            height=number(_BAR - 1),
            class_="bar chosen" if chosen[i] else "bar",
        )
        for i in bins.tolist()
    ]
    for storey in plan:
        for name, z in (("floor", storey.floor), ("ceiling", storey.ceiling)):
            drawn.append(tag("path", d=f"M{number(_LEFT - 6)} {height(z)}H{number(_LEFT + _WIDTH)}", class_="level"))
            beside = {"x": number(_LEFT + _WIDTH + 8), "y": height(z), "dy": "4"}
            drawn.append(tag("text", f"storey {storey.index}, {name} {z:.2f} m", **beside))
    drawn.extend(
        tag("text", f"{z} m", x=number(_LEFT - 10), y=height(z), dy="4", text_anchor="end")
        for z in range(int(np.ceil(top - len(bins) * voxel)), int(np.floor(top)) + 1)
    )
    size = f"0 -12 {number(_LEFT + _WIDTH + _RIGHT)} {number(len(bins) * _BAR + 24)}"
    label = "Occupied voxels by height, with the floor and the ceiling of each storey"
    return tag("svg", *drawn, viewBox=size, class_="heights", role="img", aria_label=label)


def explain_heights(plan: FloorPlan) -> str:
    """What the darker bars are."""
    if plan.parameters.get("method") == "paper":
        return "Darker: the slices that were chosen for the ground-plane histogram."
    return "Darker: heights between floor and ceiling, of which the walls were made."


def _chosen(plan: FloorPlan, occupied: IntArray, voxel: float) -> NDArray[np.bool_]:
    """Which bins of the histogram, those of the lowest voxel first, took part in finding walls."""
    given = plan.parameters.get("cross_sections", {})
    sections = CrossSectionParameters(**given) if given else CrossSectionParameters()
    if plan.parameters.get("method") != "paper":
        sections = CrossSectionParameters(select="all", slice=voxel)
    slab = float(plan.parameters.get("storeys", {}).get("slab", StoreyParameters().slab))
    low = int(occupied[:, 2].min())
    chosen = np.zeros(int(occupied[:, 2].max()) - low + 1, dtype=np.bool_)
    for storey in plan:
        level = Level(storey.index, storey.floor, storey.ceiling)
        chosen[occupied[select_cross_sections(occupied, voxel, level, slab, sections), 2] - low] = True
    return chosen
