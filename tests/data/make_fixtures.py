"""Write the files that the reader tests read, each with the program named beside it.

    pip install laspy[lazrs] lazrs copclib pye57 open3d trimesh meshio plyfile pypcd4
    python tests/data/make_fixtures.py

Every fixture is small, is named after what is odd in it, and holds known points: `<points>.npy` (float64, n x 3, or
n x 4 with the scan number in the last column). `fixtures.csv` lists which points belong to which file, how exactly they
must be read, and which program wrote them. The files in the repository are the ones that this script wrote; running it
again gives the same points, not the same bytes (dates, GUIDs).
"""

import csv
import importlib.metadata
import io
import struct
from pathlib import Path

import copclib
import laspy
import lazrs
import meshio
import numpy as np
import open3d as o3d
import plyfile
import pye57
import pypcd4
import trimesh
from pye57 import libe57

HERE = Path(__file__).parent
rows: list[tuple[str, str, float, str]] = []


def version(*packages: str) -> str:
    return ", ".join(f"{package} {importlib.metadata.version(package)}" for package in packages)


versions = {
    "laspy": version("laspy", "lazrs"),
    "open3d": version("open3d"),
    "trimesh": version("trimesh"),
    "meshio": version("meshio"),
    "plyfile": version("plyfile"),
    "pypcd4": version("pypcd4"),
    "pye57": version("pye57"),
    "copclib": version("copclib"),
    "numpy": version("numpy"),
    "hand": "by hand",
}


def note(name: str, points: str, program: str, tolerance: float = 0.0) -> None:
    """List a fixture: its points, who wrote it, and how far (in each coordinate) a point may be off."""
    rows.append((name, points, tolerance, versions[program]))


def save(name: str, points: np.ndarray) -> np.ndarray:
    np.save(HERE / f"{name}.npy", np.ascontiguousarray(points, dtype=np.float64))
    return points


def a_room(n: int, seed: int) -> np.ndarray:
    """Points on the walls of a room of 5 x 4 x 3 m, in whole millimetres."""
    rng = np.random.default_rng(seed)
    points = rng.uniform([0, 0, 0], [5, 4, 3], (n, 3))
    side = rng.integers(0, 4, n)
    points[side == 0, 0], points[side == 1, 0] = 0, 5
    points[side == 2, 1], points[side == 3, 1] = 0, 4
    return np.round(points, 3)


def main() -> None:
    room = a_room(150, 1)
    local = save("room", room)
    survey = save(
        "survey",
        np.round(np.column_stack([room + np.array([500123.0, 5412345.0, 312.0]), np.arange(150) // 50 + 7]), 3),
    )
    las(survey)
    laz_chunks()
    copc()
    e57(room)
    ply(local)
    pcd(local)
    text(local, survey)
    with open(HERE / "fixtures.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["file", "points", "tolerance", "written_by"])
        writer.writerows(rows)


def las_data(version: str, point_format: int, survey: np.ndarray) -> laspy.LasData:
    header = laspy.LasHeader(version=version, point_format=point_format)
    header.scales = [0.001] * 3
    header.offsets = [500000.0, 5412000.0, 0.0]
    data = laspy.LasData(header)
    data.x, data.y, data.z = survey[:, :3].T
    data.point_source_id = survey[:, 3].astype(np.uint16)
    data.intensity = np.arange(len(survey), dtype=np.uint16) * 7
    if "gps_time" in data.point_format.dimension_names:
        data.gps_time = np.linspace(0, 9, len(survey)) ** 2
    if "red" in data.point_format.dimension_names:
        data.red = data.green = np.arange(len(survey), dtype=np.uint16) * 100
    return data


def las(survey: np.ndarray) -> None:
    for version, point_format in [
        ("1.1", 0),
        ("1.1", 1),
        ("1.2", 2),
        ("1.2", 3),
        ("1.3", 4),
        ("1.3", 5),
        ("1.4", 1),
    ] + [("1.4", f) for f in range(6, 11)]:
        data = las_data(version, point_format, survey)
        for suffix in ("las", "laz"):
            name = f"las{version.replace('.', '')}_format{point_format}.{suffix}"
            try:
                data.write(HERE / name)
            except Exception as error:  # lazrs does not compress wave packets
                print("not written:", name, error)
                continue
            note(name, "survey", "laspy")
    # LAS 1.0 differs in the reserved words of its header only; laspy does not write it.
    bytes_ = bytearray((HERE / "las11_format0.las").read_bytes())
    bytes_[25] = 0
    (HERE / "las10_format0.las").write_bytes(bytes_)
    note("las10_format0.las", "survey", "laspy")
    # Extra bytes behind the fields of the format.
    for version, point_format in [("1.2", 3), ("1.4", 7)]:
        for suffix in ("las", "laz"):
            data = las_data(version, point_format, survey)
            data.add_extra_dim(laspy.ExtraBytesParams(name="reflectance", type=np.float32))
            data.reflectance = np.arange(len(survey), dtype=np.float32)
            name = f"las{version.replace('.', '')}_format{point_format}_extra_bytes.{suffix}"
            data.write(HERE / name)
            note(name, "survey", "laspy")
    # Coordinate systems.
    data = las_data("1.2", 0, survey)
    keys = laspy.vlrs.known.GeoKeyDirectoryVlr()
    keys.parse_record_data(struct.pack("<12H", 1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 32632))
    data.vlrs.append(keys)
    data.write(HERE / "las_crs_geotiff.las")
    note("las_crs_geotiff.las", "survey", "laspy")
    wkt = 'PROJCS["ETRS89 / UTM zone 32N",AUTHORITY["EPSG","25832"]]'
    data = las_data("1.4", 6, survey)
    data.vlrs.append(laspy.VLR("LASF_Projection", 2112, "", wkt.encode() + b"\0"))
    data.write(HERE / "las_crs_wkt.laz")
    note("las_crs_wkt.laz", "survey", "laspy")
    data = las_data("1.4", 6, survey)
    data.evlrs = laspy.vlrs.vlrlist.VLRList([laspy.VLR("LASF_Projection", 2112, "", wkt.encode() + b"\0")])
    data.write(HERE / "las_crs_wkt_evlr.las")
    note("las_crs_wkt_evlr.las", "survey", "laspy")
    data = las_data("1.4", 6, survey[:0])
    for suffix in ("las", "laz"):
        data.write(HERE / f"las_no_points.{suffix}")
        note(f"las_no_points.{suffix}", "none", "laspy")
    save("none", np.empty((0, 3)))


def laz_chunks() -> None:
    """More than one chunk: fixed (a plain grid, which compresses well) and variable (by lazrs itself)."""
    n = 100_050
    i = np.arange(n)
    grid = np.column_stack([i % 400, i // 400, np.zeros(n), i // 50_025 + 1]).astype(float)
    # Too long for an .npy of its own: the test knows the rule.
    for version, point_format in [("1.2", 0), ("1.4", 6)]:
        header = laspy.LasHeader(version=version, point_format=point_format)
        header.scales, header.offsets = [1.0] * 3, [0.0] * 3
        data = laspy.LasData(header)
        data.x, data.y, data.z = grid[:, :3].T
        data.point_source_id = grid[:, 3].astype(np.uint16)
        name = f"laz_three_chunks_format{point_format}.laz"
        data.write(HERE / name)
        note(name, "grid", "laspy")

    survey = np.load(HERE / "survey.npy")
    for version, point_format in [("1.2", 3), ("1.4", 7)]:
        data = las_data(version, point_format, survey)
        plain = io.BytesIO()
        data.write(plain)
        plain = plain.getvalue()
        start, length = struct.unpack_from("<I", plain, 96)[0], struct.unpack_from("<H", plain, 105)[0]
        vlr = lazrs.LazVlr.new_for_compression(point_format, 0, True)
        record = bytes(vlr.record_data())
        head = bytearray(plain[:start])
        head += struct.pack("<H16sHH32s", 0, b"laszip encoded", 22204, len(record), b"") + record
        struct.pack_into("<I", head, 96, len(head))
        struct.pack_into("<I", head, 100, struct.unpack_from("<I", head, 100)[0] + 1)
        head[104] |= 0x80
        file = io.BytesIO()
        file.write(head)
        compressor = lazrs.LasZipCompressor(file, vlr)
        points = np.frombuffer(plain, np.uint8, length * len(survey), start).reshape(-1, length)
        for part in (points[:100], points[100:101], points[101:]):
            compressor.compress_many(np.ascontiguousarray(part).reshape(-1))
            compressor.finish_current_chunk()
        compressor.done()
        name = f"laz_variable_chunks_format{point_format}.laz"
        (HERE / name).write_bytes(file.getvalue())
        note(name, "survey", "laspy")


def copc() -> None:
    """A hierarchy of three nodes."""
    room = a_room(240, 5)
    config = copclib.CopcConfigWriter(
        7, copclib.Vector3(0.001, 0.001, 0.001), copclib.Vector3(0, 0, 0), 'LOCAL_CS["site"]'
    )
    config.las_header.min, config.las_header.max = copclib.Vector3(0, 0, 0), copclib.Vector3(5, 4, 3)
    config.copc_info.spacing = 1.0
    writer = copclib.FileWriter(str(HERE / "copc.laz"), config)
    expected = []
    for number, key in enumerate([(0, 0, 0, 0), (1, 0, 0, 0), (1, 1, 0, 0)]):
        points = copclib.Points(config.las_header)
        for x, y, z in room[80 * number : 80 * number + 80]:
            point = points.CreatePoint()
            point.x, point.y, point.z = float(x), float(y), float(z)
            point.point_source_id = number + 1
            points.AddPoint(point)
        writer.AddNode(copclib.VoxelKey(*key), points)
        expected.append(np.column_stack([room[80 * number : 80 * number + 80], np.full(80, number + 1)]))
    writer.Close()
    save("copc", np.concatenate(expected))
    note("copc.laz", "copc", "copclib", 1e-9)


def rotate(points: np.ndarray, quaternion: list[float]) -> np.ndarray:
    w, x, y, z = quaternion
    matrix = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return points @ matrix.T


QUATERNIONS = [[1.0, 0.0, 0.0, 0.0], [0.9238795325112867, 0.0, 0.0, 0.3826834323650898], [0.5, 0.5, 0.5, 0.5]]
PLACES = [[0.0, 0.0, 0.0], [500123.5, 5412345.25, 312.0], [-3.0, 2.0, 1.5]]


def write_e57(name: str, scans: list[dict], kind: str) -> None:
    """Write scans with libE57Format itself, which gives a say in how each field is stored."""
    image = libe57.ImageFile(str(HERE / name), "w")
    image.extensionsAdd("", libe57.E57_V1_0_URI)
    root = image.root()
    text = lambda value: libe57.StringNode(image, value)  # noqa: E731
    real = lambda value: libe57.FloatNode(image, float(value))  # noqa: E731
    root.set("formatName", text("ASTM E57 3D Imaging Data File"))
    root.set("guid", text(f"{{file {name}}}"))
    root.set("versionMajor", libe57.IntegerNode(image, libe57.E57_FORMAT_MAJOR))
    root.set("versionMinor", libe57.IntegerNode(image, libe57.E57_FORMAT_MINOR))
    root.set("coordinateMetadata", text("EPSG:25832"))
    data3d = libe57.VectorNode(image, True)
    root.set("data3D", data3d)
    for number, scan in enumerate(scans):
        node = libe57.StructureNode(image)
        if scan.get("guid", True):
            node.set("guid", text(f"{{{name} {number}}}"))
        node.set("name", text(f"Setup {number + 1}"))
        if "pose" in scan:
            (w, x, y, z), place = scan["pose"]
            pose, rotation, translation = (libe57.StructureNode(image) for _ in range(3))
            for key, value in zip("wxyz", (w, x, y, z), strict=False):
                rotation.set(key, real(value))
            for key, value in zip("xyz", place, strict=False):
                translation.set(key, real(value))
            pose.set("rotation", rotation)
            pose.set("translation", translation)
            node.set("pose", pose)
        prototype = libe57.StructureNode(image)
        buffers = libe57.VectorSourceDestBuffer()
        arrays = []
        for field, values in scan["fields"].items():
            if field.endswith(("State", "Index")):
                values = values.astype(np.longlong)
                prototype.set(field, libe57.IntegerNode(image, 0, 0, int(max(values.max(), 2))))
                buffers.append(libe57.SourceDestBuffer(image, field, values, len(values), True))
            elif kind == "scaled":
                raw = np.round(values / 0.001)
                low, high = int(raw.min()), int(raw.max())
                prototype.set(field, libe57.ScaledIntegerNode(image, low, low, high, 0.001, 0.0))
                values = raw.astype(np.longlong)
                buffers.append(libe57.SourceDestBuffer(image, field, values, len(values), True, False))
            else:
                values = values.astype(np.float64 if kind == "double" else np.float32)
                precision = libe57.E57_DOUBLE if kind == "double" else libe57.E57_SINGLE
                prototype.set(
                    field,
                    libe57.FloatNode(
                        image, 0.0, precision, -1e9 if kind == "double" else -1e6, 1e9 if kind == "double" else 1e6
                    ),
                )
                buffers.append(libe57.SourceDestBuffer(image, field, values, len(values), True))
            arrays.append(values)
        points = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
        node.set("points", points)
        data3d.append(node)
        writer = points.writer(buffers)
        writer.write(len(arrays[0]))
        writer.close()
    image.close()


def e57(room: np.ndarray) -> None:
    def fields(points: np.ndarray) -> dict:
        return dict(zip(("cartesianX", "cartesianY", "cartesianZ"), points.T.copy(), strict=False))

    def spherical(points: np.ndarray) -> dict:
        r = np.linalg.norm(points, axis=1)
        angles = np.arctan2(points[:, 1], points[:, 0]), np.arcsin(points[:, 2] / r)
        return {"sphericalRange": r, "sphericalAzimuth": angles[0], "sphericalElevation": angles[1]}

    parts = [room[50 * i : 50 * i + 50] - [2.5, 2.0, 1.5] for i in range(3)]
    posed = save(
        "posed",
        np.concatenate(
            [
                np.column_stack([rotate(p, q) + t, np.full(len(p), i)])
                for i, (p, q, t) in enumerate(zip(parts, QUATERNIONS, PLACES, strict=False))
            ]
        ),
    )
    poses = list(zip(QUATERNIONS, PLACES, strict=False))
    setups = [{"fields": fields(part), "pose": pose} for part, pose in zip(parts, poses, strict=True)]
    for kind, tolerance in [("double", 2e-9), ("float", 1e-6), ("scaled", 2e-9)]:
        write_e57(f"e57_{kind}.e57", setups, kind)
        note(f"e57_{kind}.e57", "posed", "pye57", tolerance)
    setups = [{"fields": spherical(part), "pose": pose} for part, pose in zip(parts, poses, strict=True)]
    write_e57("e57_spherical.e57", setups, "double")
    note("e57_spherical.e57", "posed", "pye57", 2e-9)
    write_e57("e57_spherical_float.e57", setups, "float")
    note("e57_spherical_float.e57", "posed", "pye57", 4e-6)

    # Every third record says that it is a direction (1) or nothing at all (2).
    state = np.where(np.arange(len(room)) % 3 == 0, 1 + np.arange(len(room)) % 2, 0)
    save("valid", room[state == 0])
    write_e57(
        "e57_invalid_states.e57", [{"fields": fields(room) | {"cartesianInvalidState": state}, "guid": False}], "scaled"
    )
    note("e57_invalid_states.e57", "valid", "pye57", 2e-9)
    write_e57(
        "e57_invalid_states_spherical.e57",
        [{"fields": spherical(room + 1e-3) | {"sphericalInvalidState": state}}],
        "double",
    )
    save("valid_shifted", room[state == 0] + 1e-3)
    note("e57_invalid_states_spherical.e57", "valid_shifted", "pye57", 2e-9)

    # All z alike: a field of no bits.
    flat = save("flat", np.column_stack([room[:, :2], np.full(len(room), 1.25)]))
    write_e57("e57_flat_scaled.e57", [{"fields": fields(flat)}], "scaled")
    note("e57_flat_scaled.e57", "flat", "pye57", 2e-9)

    # Several packets, whose pieces of a stream end within a value.
    large = save_large("e57_packets")
    write_e57("e57_packets_scaled.e57", [{"fields": fields(large), "pose": poses[2]}], "scaled")
    note("e57_packets_scaled.e57", "packets", "pye57", 1e-9)

    # As pye57 writes by default.
    file = pye57.E57(str(HERE / "e57_pye57.e57"), mode="w")
    for part, (quaternion, place) in zip(parts, poses, strict=False):
        file.write_scan_raw(fields(part), rotation=np.array(quaternion), translation=np.array(place))
    file.close()
    note("e57_pye57.e57", "posed", "pye57", 1e-6)
    file = pye57.E57(str(HERE / "e57_no_scans.e57"), mode="w")
    file.close()
    note("e57_no_scans.e57", "none", "pye57")
    assert len(posed) == len(room)


def save_large(_name: str) -> np.ndarray:
    """15,000 points by a rule that the test knows: too many for an .npy of their own."""
    i = np.arange(15_000)
    return np.column_stack([(i * 37 % 8191) * 0.001, (i * 101 % 4093) * 0.001, (i % 2503) * 0.001])


def ply(room: np.ndarray) -> None:
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(room))
    cloud.colors = o3d.utility.Vector3dVector(np.tile([0.1, 0.5, 0.9], (len(room), 1)))
    o3d.io.write_point_cloud(str(HERE / "ply_open3d_binary_double.ply"), cloud)
    note("ply_open3d_binary_double.ply", "room", "open3d")
    o3d.io.write_point_cloud(str(HERE / "ply_open3d_ascii.ply"), cloud, write_ascii=True)
    note("ply_open3d_ascii.ply", "room", "open3d", 1e-9)

    faces = np.arange(len(room)).reshape(-1, 3)
    mesh = trimesh.Trimesh(room, faces, process=False)
    for encoding in ("ascii", "binary"):
        name = f"ply_trimesh_faces_{encoding}.ply"
        (HERE / name).write_bytes(mesh.export(file_type="ply", encoding=encoding))
        note(name, "room", "trimesh", 1e-6)
    for binary in (False, True):
        name = f"ply_meshio_{'binary' if binary else 'ascii'}.ply"
        meshio.Mesh(room, [("triangle", faces)]).write(HERE / name, binary=binary)
        note(name, "room", "meshio", 1e-9)

    vertex = np.zeros(
        len(room), [("nx", "f4"), ("z", "f4"), ("quality", "i2"), ("y", "f8"), ("x", "f4"), ("red", "u1")]
    )
    vertex["x"], vertex["y"], vertex["z"] = room.T
    ragged = np.zeros(3, [("indices", object), ("flag", "u1")])
    ragged["indices"] = [np.arange(k, dtype="i4") for k in (1, 0, 5)]
    odd = plyfile.PlyElement.describe(vertex, "vertex")
    listed = np.zeros(len(room), [("seen_by", object), ("x", "f8"), ("y", "f8"), ("z", "f8")])
    listed["x"], listed["y"], listed["z"] = room.T
    listed["seen_by"] = [np.arange(k % 4, dtype="u1") for k in range(len(room))]
    listed_last = np.zeros(len(room), [("x", "f8"), ("y", "f8"), ("z", "f8"), ("seen_by", object)])
    for field in listed.dtype.names:
        listed_last[field] = listed[field]
    describe = plyfile.PlyElement.describe
    before = [describe(ragged, "strip"), describe(np.zeros(2, [("id", "i4"), ("w", "f8")]), "camera")]
    for order, label in (("<", "little"), (">", "big")):
        for elements, kind, tolerance in [
            ([odd], "odd_order", 1e-6),
            ([*before, odd], "elements_before", 1e-6),
            ([describe(listed, "vertex", val_types={"seen_by": "u1"})], "list_in_vertex", 0.0),
        ]:
            if kind == "list_in_vertex" and label == "big":
                continue  # plyfile writes the numbers beside a list in the wrong byte order
            name = f"ply_{kind}_{label}.ply"
            plyfile.PlyData(elements, byte_order=order).write(HERE / name)
            note(name, "room", "plyfile", tolerance)
    plyfile.PlyData([*before, odd], text=True).write(HERE / "ply_elements_before_ascii.ply")
    note("ply_elements_before_ascii.ply", "room", "plyfile", 1e-6)
    plyfile.PlyData([describe(listed_last, "vertex", val_types={"seen_by": "u1"})], text=True).write(
        HERE / "ply_list_behind_ascii.ply"
    )
    note("ply_list_behind_ascii.ply", "room", "plyfile", 1e-9)


def pcd(room: np.ndarray) -> None:
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(room))
    cloud.normals = o3d.utility.Vector3dVector(np.tile([0.0, 0.0, 1.0], (len(room), 1)))
    for label, options in [("ascii", {"write_ascii": True}), ("binary", {}), ("compressed", {"compressed": True})]:
        name = f"pcd_open3d_{label}.pcd"
        o3d.io.write_point_cloud(str(HERE / name), cloud, **options)
        note(name, "room", "open3d", 1e-6)
    for encoding in (pypcd4.Encoding.ASCII, pypcd4.Encoding.BINARY, pypcd4.Encoding.BINARY_COMPRESSED):
        name = f"pcd_pypcd4_{encoding.value}.pcd"
        fields, types = (
            ("intensity", "x", "y", "z", "ring"),
            (np.float32, np.float64, np.float64, np.float64, np.uint16),
        )
        columns = np.column_stack([np.arange(len(room)), room, np.arange(len(room)) % 16])
        pypcd4.PointCloud.from_points(columns, fields, types).save(HERE / name, encoding=encoding)
        note(name, "room", "pypcd4", 1e-9)


def text(room: np.ndarray, survey: np.ndarray) -> None:
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(room))
    cloud.colors = o3d.utility.Vector3dVector(np.tile([0.1, 0.5, 0.9], (len(room), 1)))
    for suffix in ("xyz", "xyzrgb", "pts"):
        o3d.io.write_point_cloud(str(HERE / f"text_open3d.{suffix}"), cloud, write_ascii=True)
        note(f"text_open3d.{suffix}", "room", "open3d", 1e-9)
    np.savetxt(HERE / "text_numpy_exponents.txt", room)
    note("text_numpy_exponents.txt", "room", "numpy")

    def write(
        name: str, lines: list[str], points: str, end: str = "\n", encoding: str = "utf-8", last: str | None = None
    ) -> None:
        (HERE / name).write_bytes((end.join(lines) + (end if last is None else last)).encode(encoding))
        note(name, points, "hand")

    xyz = survey[:, :3]
    plain = [f"{x:.3f} {y:.3f} {z:.3f}" for x, y, z in xyz]
    save("survey_xyz", xyz)
    write(
        "text_header_order.csv",
        ["id,Height [m],Easting [m],Northing [m],note"]
        + [f"{i},{z:.3f},{x:.3f},{y:.3f},wall" for i, (x, y, z) in enumerate(xyz)],
        "survey_xyz",
    )
    write(
        "text_decimal_comma.csv",
        ["X;Y;Z;R"] + [f"{x:.3f};{y:.3f};{z:.3f};12".replace(".", ",") for x, y, z in xyz],
        "survey_xyz",
        end="\r\n",
        encoding="utf-8-sig",
    )
    write("text_decimal_comma_blanks.xyz", [p.replace(".", ",") for p in plain], "survey_xyz")
    write("text_cloudcompare.txt", ["//X Y Z Intensity"] + [f"{p} 0.5" for p in plain], "survey_xyz")
    write("text_cloudcompare_count.asc", ["//X,Y,Z", "150"] + [p.replace(" ", ",") for p in plain], "survey_xyz")
    write("text_numbered.txt", [f"{i + 1} {p} WALL" for i, p in enumerate(plain)], "survey_xyz")
    write(
        "text_comments_tabs.xyz",
        ["# made by hand", "# second line", ""]
        + ["\t".join(p.split()) for p in plain[:75]]
        + ["# half-way", ""]
        + ["\t".join(p.split()) for p in plain[75:]],
        "survey_xyz",
    )
    write("text_quoted.csv", ['"x", "y", "z"'] + [", ".join(f'"{v}"' for v in p.split()) for p in plain], "survey_xyz")
    write("text_no_last_newline.xyz", ["  " + p + "  " for p in plain], "survey_xyz", last="")
    pts = [f"{p} {-i} 10 20 30" for i, p in enumerate(plain)]
    write("text_one_block.pts", ["150", *pts], "survey_xyz")
    write("text_two_blocks.pts", ["50", *pts[:50], "100", *pts[50:]], "survey_xyz", end="\r\n")
    write("text_without_count.pts", pts, "survey_xyz")

    holes = [
        line for i, line in enumerate(plain[:20]) for line in ([line, "NaN 1 2", "inf 1 2"] if i % 5 == 0 else [line])
    ]
    save("survey_20", xyz[:20])
    write("text_not_finite.xyz", holes, "survey_20")

    # PTX: two setups, columns x rows each; some directions without a return.
    lines, expected = [], []
    for number, (quaternion, place) in enumerate(zip(QUATERNIONS[1:], PLACES[1:], strict=False)):
        matrix = rotate(np.eye(3), quaternion)
        own = np.round(room[50 * number : 50 * number + 50] - [2.5, 2.0, 1.5], 3)
        lines += ["10", "6", " ".join(f"{v:.6f}" for v in place)]
        lines += [" ".join(f"{v:.9f}" for v in axis) for axis in matrix]
        lines += [" ".join(f"{v:.9f}" for v in axis) + " 0" for axis in matrix]
        lines += [" ".join(f"{v:.6f}" for v in place) + " 1"]
        for i, (x, y, z) in enumerate(own):
            lines.append(f"{x:.6f} {y:.6f} {z:.6f} 0.500000")
            if i % 5 == 4:
                lines.append("0 0 0 0.500000")
        written = np.array([[float(f"{v:.9f}") for v in axis] for axis in matrix])
        expected.append(np.column_stack([own @ written + place, np.full(50, number)]))
    save("ptx", np.concatenate(expected))
    write("text_two_scans.ptx", lines, "ptx", end="\r\n")
    rows[-1] = (rows[-1][0], "ptx", 2e-9, rows[-1][3])


if __name__ == "__main__":
    main()
