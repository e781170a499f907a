"""Baselines in space: planes in the points of a storey, of which the upright ones leave a trace on the ground.

RANSAC [8], region growing [3], plane sweep [1, 5], Hough transform [10] and expectation maximization [11]. All work
on the points thinned to one in 5 cm, as their authors thin theirs. Numbers are the paper's references.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.signal import find_peaks
from scipy.spatial import cKDTree

from asbuilt.grid import FloatArray, IntArray
from baselines.storey import StoreyCloud, merge, runs, wall_of_plane

VOXEL = 0.05
#: Centre, axes (in columns, the normal first) and half extents along the second and third.
Plane = tuple[FloatArray, FloatArray, FloatArray]


def ransac_planes(
    cloud: StoreyCloud,
    distance: float = 0.05,
    normal_cosine: float = 0.9,
    cluster: float = 0.2,
    least: int = 300,
    overlook: float = 0.05,
) -> FloatArray:
    """[8]: planes through three points of one small cube; the largest connected part of the best one's points.

    Normal cosine and the probability to overlook a plane are the published defaults (CGAL's, after the authors' code).
    Distance, cluster size and least number of points, there one per cent of the scene, are ours: one per cent of a
    whole building is half a metre.
    """
    random = np.random.default_rng(0)
    points = cloud.thinned(VOXEL)
    normals = _normals(points)
    cubes = np.unique(np.floor(points / 0.8).astype(np.int64), axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(cubes, kind="stable")
    points, normals, cubes = points[order], normals[order], cubes[order]
    found, failures = [], 0
    while len(points) > least and failures < np.log(overlook) / np.log(0.5):
        seed = random.integers(len(points), size=400)
        first = np.searchsorted(cubes, cubes[seed])
        size = np.searchsorted(cubes, cubes[seed], side="right") - first
        a, b, c = points[seed], *(points[first + random.integers(2**31, size=400) % size] for _ in range(2))
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=1)
        agrees = np.abs((normals[seed] * normal).sum(axis=1)) >= normal_cosine * length
        normal, a = (normal / np.maximum(length, 1e-9)[:, None])[agrees & (length > 1e-3)], a[agrees & (length > 1e-3)]
        if len(normal) == 0:
            failures += 1
            continue
        sample = random.choice(len(points), min(6000, len(points)), replace=False)
        near = np.abs(normal @ points[sample].T - (normal * a).sum(axis=1)[:, None]) <= distance
        near &= np.abs(normal @ normals[sample].T) >= normal_cosine
        best = int(near.sum(axis=1).argmax())
        inliers = np.flatnonzero(
            (np.abs((points - a[best]) @ normal[best]) <= distance) & (np.abs(normals @ normal[best]) >= normal_cosine)
        )
        inliers = inliers[_largest_part(points[inliers], normal[best], cluster)]
        if len(inliers) < least:
            failures += 1
            continue
        failures = 0
        found.append(wall_of_plane(points[inliers], _fit_plane(points[inliers])))
        keep = np.ones(len(points), dtype=bool)
        keep[inliers] = False
        points, normals, cubes = points[keep], normals[keep], cubes[keep]
    return merge(found)


def planar_patches(
    cloud: StoreyCloud, normal_variance_deg: float, coplanarity_deg: float, least: int, neighbours: int = 30
) -> FloatArray:
    """[3]: patches grown over points of like normal; in Open3D's robust form (Araújo and Oliveira 2020)."""
    import open3d

    points = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(cloud.thinned(VOXEL)))
    points.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(neighbours))
    patches = points.detect_planar_patches(
        normal_variance_threshold_deg=normal_variance_deg,
        coplanarity_deg=coplanarity_deg,
        outlier_ratio=0.75,
        min_plane_edge_length=0.3,
        min_num_points=least,
        search_param=open3d.geometry.KDTreeSearchParamKNN(neighbours),
    )
    found = []
    for patch in patches:
        normal = patch.R[:, 2]
        if abs(normal[2]) <= np.sin(np.radians(10)):
            corners = np.asarray(patch.get_box_points())[:, :2]
            along = np.array([-normal[1], normal[0]]) / np.hypot(*normal[:2])
            found.append(runs(corners, np.array(patch.center[:2]), along, 1e9, 0.3, 2))
    return merge(found)


def plane_sweep(cloud: StoreyCloud, step: float = 0.05, gap: float = 0.5, min_length: float = 0.5) -> FloatArray:
    """[1, 5]: a vertical plane sweeps along the two dominant directions; where it meets many points is a wall.

    The directions are those under which the sweep's counts are most uneven (Budroni and Böhm's rotational sweep). The
    values are ours, not tuned.
    """
    points = cloud.thinned(VOXEL)
    ground = points[:, :2]
    sample = ground[:: max(len(ground) // 50_000, 1)]

    def unevenness(angle: float) -> float:
        total = 0
        for normal in ((np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))):
            bins = np.floor(sample @ np.array(normal) / step).astype(np.int64)
            total += int((np.bincount(bins - bins.min()).astype(np.int64) ** 2).sum())
        return float(total)

    angles = np.radians(np.arange(0, 90, 0.5))
    best = float(angles[int(np.argmax([unevenness(angle) for angle in angles]))])
    found = []
    for angle in (best, best + np.pi / 2):
        normal, along = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        bins = np.floor(ground @ normal / step).astype(np.int64)
        low = int(bins.min())
        counts = np.bincount(bins - low)
        for peak in find_peaks(counts, prominence=counts.mean())[0]:
            near = ground[np.abs(bins - low - peak) <= 1]
            place = np.floor(near @ along / 0.1).astype(np.int64)
            # half a metre of height in each decimetre of wall
            enough = np.bincount(place - place.min())[place - place.min()] >= 0.5 / VOXEL
            centre = normal * np.median(near @ normal)
            found.append(runs(near[enough], centre, along, gap, min_length, 10))
    return merge(found)


def hough_planes(
    cloud: StoreyCloud, angle_deg: float = 1.0, rho: float = 0.1, least: int = 300, planes: int = 400
) -> FloatArray:
    """[10]: the accumulator of orientation and distance of planes; its maximum, whose points leave it, and again.

    Only upright planes, within six degrees, have a place in it: with all orientations, the horizontal cuts through a
    whole building hold more points than any wall does, and take them all. The values are ours, not tuned.
    """
    points = cloud.thinned(2 * VOXEL)
    points = points[np.random.default_rng(0).permutation(len(points))[:40_000]]
    share = len(points) / 40_000
    azimuth, elevation = np.meshgrid(
        np.radians(np.arange(0, 180, angle_deg)), np.radians(np.arange(-6, 6.1, 3)), indexing="ij"
    )
    normals = np.stack(
        [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)], axis=-1
    ).reshape(-1, 3)
    middle = points.mean(axis=0)
    points = points - middle
    bins = 2 * int(np.ceil(np.linalg.norm(points, axis=1).max() / rho)) + 3

    def votes(some: FloatArray) -> IntArray:
        rows = ((some @ normals.T) / rho + bins / 2).astype(np.int64) + bins * np.arange(len(normals))
        return np.bincount(rows.ravel(), minlength=bins * len(normals)).astype(np.int32)

    space = np.zeros(bins * len(normals), dtype=np.int32)
    for some in np.array_split(points, max(len(points) // 2000, 1)):
        space += votes(some)
    found = []
    for _ in range(planes):
        peak = int(space.argmax())
        if space[peak] < least / 4 * share:
            break
        normal = normals[peak // bins]
        near = (points @ normal / rho + bins / 2).astype(np.int64) == peak % bins
        inliers = points[near]
        space -= votes(inliers)
        points = points[~near]
        found.append(wall_of_plane(inliers + middle, normal))
    return merge(found, distance=0.1)


def em_planes(
    cloud: StoreyCloud, sigma: float = 0.03, planes: int = 500, rounds: int = 20, least: float = 12.0
) -> FloatArray:
    """[11]: a mixture of bounded planes and an outlier class; planes are born where points are unexplained, and die.

    Points belong in part to each plane; a plane is fitted to its share of them. Distances beyond a plane's bounds
    count as distances to it. The values are ours, not tuned.
    """
    random = np.random.default_rng(0)
    points = cloud.thinned(2 * VOXEL)
    points = points[random.permutation(len(points))[:40_000]]
    tree = cKDTree(points)
    unexplained = np.ones(len(points))
    mixture: list[Plane] = []
    rows: list[IntArray] = []
    belongs: list[FloatArray] = []
    for number in range(rounds):
        if number % 4 == 0:
            seeds = random.choice(len(points), 3 * planes, p=unexplained / unexplained.sum())
            births = (_local_plane(points[tree.query_ball_point(points[seed], 0.8)]) for seed in seeds)
            mixture = [*mixture, *(birth for birth in births if birth is not None)][:planes]
        # E: nothing beyond three sigma of a plane's bounds belongs to it
        rows = [
            np.array(tree.query_ball_point(centre, float(np.linalg.norm(half)) + 3 * sigma), dtype=np.int64)
            for centre, _, half in mixture
        ]
        likely = [
            np.exp(-_squared(points[near], *plane) / (2 * sigma**2)) for near, plane in zip(rows, mixture, strict=True)
        ]
        total = np.full(len(points), np.exp(-4.5))  # the outlier class takes over at three sigma
        for near, some in zip(rows, likely, strict=True):
            total[near] += some
        belongs = [some / total[near] for near, some in zip(rows, likely, strict=True)]
        unexplained = np.exp(-4.5) / total
        # M
        alive = [i for i, weight in enumerate(belongs) if weight.sum() >= least]
        rows, belongs = [rows[i] for i in alive], [belongs[i] for i in alive]
        mixture = [_weighted_plane(points[near], weight) for near, weight in zip(rows, belongs, strict=True)]
    # planes that share a wall own its points in turns, and are joined as collinear
    owner, most = np.full(len(points), -1), np.zeros(len(points))
    for i, (near, weight) in enumerate(zip(rows, belongs, strict=True)):
        mine = near[weight > most[near]]
        owner[mine], most[near] = i, np.maximum(most[near], weight)
    owner[unexplained > 0.5] = -1
    found = [wall_of_plane(points[owner == i], frame[:, 0], gap=0.5) for i, (_, frame, _) in enumerate(mixture)]
    return merge(found, distance=0.1)


def _normals(points: FloatArray, neighbours: int = 20) -> FloatArray:
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(neighbours))
    return np.asarray(cloud.normals)


def _fit_plane(points: FloatArray) -> FloatArray:
    """Unit normal of the least squares plane."""
    return np.linalg.eigh(np.cov(points.T))[1][:, 0]


def _largest_part(points: FloatArray, normal: FloatArray, cell: float) -> IntArray:
    """Rows of the points that make the largest connected part of a plane's picture."""
    if len(points) == 0:
        return np.zeros(0, dtype=np.int64)
    first = np.cross(normal, [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    index = np.floor(points @ np.column_stack([first, np.cross(normal, first)]) / cell).astype(np.int64)
    index -= index.min(axis=0)
    picture = np.zeros(index.max(axis=0) + 1, dtype=bool)
    picture[tuple(index.T)] = True
    label = ndimage.label(picture, structure=np.ones((3, 3)))[0][tuple(index.T)]
    return np.flatnonzero(label == np.bincount(label).argmax())


def _local_plane(points: FloatArray) -> Plane | None:
    if len(points) < 8:
        return None
    centre, frame, half = _weighted_plane(points, np.ones(len(points)))
    off = np.abs((points - centre) @ frame[:, 0])
    return (centre, frame, half) if np.median(off) < 0.04 else None


def _weighted_plane(points: FloatArray, weight: FloatArray) -> Plane:
    """Centre, axes (normal first) and half extents of the plane of weighted points; a plane is uniform over those."""
    rows = np.flatnonzero(weight > 1e-3)
    points, weight = points[rows], weight[rows]
    centre = np.average(points, axis=0, weights=weight)
    values, frame = np.linalg.eigh(np.cov(points.T, aweights=weight, bias=True))
    return centre, frame, np.sqrt(3 * np.maximum(values[1:], 0.0)) + 0.1


def _squared(points: FloatArray, centre: FloatArray, frame: FloatArray, half: FloatArray) -> FloatArray:
    local = (points - centre) @ frame
    beyond = np.maximum(np.abs(local[:, 1:]) - half, 0.0)
    return local[:, 0] ** 2 + (beyond**2).sum(axis=1)
