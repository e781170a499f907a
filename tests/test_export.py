"""Each export is read back by a program that is not ours, and is whole or not there."""

from __future__ import annotations

import errno
import json
import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import ezdxf
import numpy as np
import pytest
from PIL import Image

from asbuilt import FloorPlan, load_plan
from asbuilt.errors import OutputError
from asbuilt.export import check_output, export, known_suffixes
from asbuilt.export.atomic import replacing
from asbuilt.plan import WallFace

ALL = sorted(known_suffixes())


def test_geojson_comes_back_as_it_was(plan, tmp_path):
    assert export(plan, tmp_path / "plan.geojson") == (tmp_path / "plan.geojson",)
    assert load_plan(tmp_path / "plan.geojson") == plan
    text = json.loads((tmp_path / "plan.geojson").read_text())
    assert text["type"] == "FeatureCollection"
    assert len(text["features"]) == 2 + 8


def test_geojson_takes_numpy_numbers(one_storey, tmp_path):
    face = WallFace((np.float64(0), np.float64(1)), (2.0, 3.0), seen=np.float32(0.5), voxels=np.int64(7))
    plan = FloorPlan((type(one_storey.storeys[0])(0, np.float32(0.0), 2.5, None, (face,)),))
    export(plan, tmp_path / "plan.geojson")
    assert load_plan(tmp_path / "plan.geojson").wall_faces[0].voxels == 7


def test_dxf_has_each_storey_on_its_layer_in_metres_and_passes_the_audit(plan, tmp_path):
    export(plan, tmp_path / "plan.dxf")
    drawing = ezdxf.readfile(tmp_path / "plan.dxf")
    auditor = drawing.audit()
    assert not auditor.has_errors
    assert not auditor.has_fixes
    assert drawing.dxfversion == "AC1032"  # R2018
    assert drawing.units == ezdxf.units.M
    for storey in plan:
        lines = drawing.modelspace().query(f'LINE[layer=="A-WALL-S{storey.index}"]')
        drawn = [(line.dxf.start.xyz, line.dxf.end.xyz) for line in lines]
        assert drawn == [((*face.start, 0.0), (*face.end, 0.0)) for face in storey.wall_faces]
    assert drawing.layers.get("A-WALL-S0").is_on()
    assert ("CRS", "EPSG:25832") in drawing.header.custom_vars.properties


def test_png_shows_the_faces_where_they_are(one_storey, tmp_path):
    export(one_storey, tmp_path / "plan.png")
    with Image.open(tmp_path / "plan.png") as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    assert pixels.shape[1] == 1800
    walls = np.argwhere((pixels[..., 0] > 150) & (pixels[..., 1] < 60))
    (top, left), (bottom, right) = walls.min(axis=0), walls.max(axis=0)
    assert (right - left) / (bottom - top) == pytest.approx(8 / 5, rel=0.01)


@pytest.mark.parametrize("suffix", ALL)
def test_the_same_plan_gives_the_same_bytes(suffix, plan, tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    first = export(plan, tmp_path / "a" / f"plan{suffix}")
    second = export(plan, tmp_path / "b" / f"plan{suffix}")
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]
    assert ezdxf.options.write_fixed_meta_data_for_testing is False  # the caller's own files keep their dates


def test_another_process_gives_the_same_bytes(plan, tmp_path):
    """Sets have another order there: by these two seeds ezdxf's names its classes in different ones."""
    export(plan, tmp_path / "plan.geojson")
    script = (
        "import sys, asbuilt\nfrom asbuilt.export import export, known_suffixes\n"
        "plan = asbuilt.load_plan(sys.argv[1])\n"
        "for suffix in known_suffixes(): export(plan, sys.argv[2] + '/plan' + suffix)\n"
    )
    written = []
    for seed in "14":
        (tmp_path / seed).mkdir()
        arguments = [sys.executable, "-c", script, str(tmp_path / "plan.geojson"), str(tmp_path / seed)]
        subprocess.run(arguments, check=True, env={**os.environ, "PYTHONHASHSEED": seed})
        written.append({path.name: path.read_bytes() for path in (tmp_path / seed).iterdir()})
    assert len(written[0]) >= len(ALL)
    assert [name for name in written[0] if written[0][name] != written[1].get(name)] == []


@pytest.mark.parametrize("suffix", ALL)
def test_an_empty_plan_is_written_too(suffix, tmp_path):
    written = export(FloorPlan(), tmp_path / f"plan{suffix}")
    assert sorted(written) == sorted(tmp_path.iterdir())
    assert written
    assert all(path.stat().st_size > 0 for path in written)


@pytest.mark.parametrize("suffix", ALL)
@pytest.mark.parametrize("failure", [KeyboardInterrupt(), OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))])
def test_an_interrupted_write_leaves_the_old_file(suffix, failure, one_storey, tmp_path, monkeypatch):
    path = tmp_path / f"plan{suffix}"
    path.write_bytes(b"old")

    def fail(*_):
        raise failure

    monkeypatch.setattr(os, "fsync", fail)  # the last moment before the file takes its place
    expected = KeyboardInterrupt if isinstance(failure, KeyboardInterrupt) else OutputError
    with pytest.raises(expected) as caught:
        export(one_storey, path)
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == b"old"
    if expected is OutputError:
        first = path.with_name("plan_rooms.csv") if suffix == ".csv" else path
        assert str(caught.value) == f"{first}: cannot write: No space left on device"


def test_a_link_goes_on_pointing_and_the_mode_is_the_users(one_storey, tmp_path):
    (tmp_path / "link.svg").symlink_to(tmp_path / "real.svg")
    before = os.umask(0o027)
    try:
        export(one_storey, tmp_path / "link.svg")
    finally:
        os.umask(before)
    assert (tmp_path / "link.svg").is_symlink()
    assert stat.S_IMODE((tmp_path / "real.svg").stat().st_mode) == 0o640


def test_a_pipe_stays_a_pipe(one_storey, tmp_path):
    os.mkfifo(tmp_path / "pipe.svg")
    (tmp_path / "link.svg").symlink_to(tmp_path / "pipe.svg")
    for name in ("pipe.svg", "link.svg"):
        with pytest.raises(OutputError, match="is a device or a pipe"):
            export(one_storey, tmp_path / name)
    assert stat.S_ISFIFO((tmp_path / "pipe.svg").stat().st_mode)


def test_an_unknown_suffix_gets_the_list_of_known_ones(tmp_path):
    for name in ("plan.docx", "plan", ".dxf"):
        with pytest.raises(OutputError, match=r"\.geojson.*\.dxf.*\.svg.*\.png"):
            check_output(tmp_path / name)
    check_output(tmp_path / "PLAN.DXF")


def test_a_missing_folder_and_a_folder_of_that_name_are_found_before_any_work(tmp_path):
    with pytest.raises(OutputError, match="does not exist"):
        check_output(tmp_path / "absent" / "plan.dxf")
    (tmp_path / "plan.dxf").mkdir()
    with pytest.raises(OutputError, match="is a folder"):
        check_output(tmp_path / "plan.dxf")


@pytest.mark.skipif(os.geteuid() == 0, reason="permissions do not bind the superuser")
def test_a_read_only_folder_is_one_line(one_storey, tmp_path):
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(OutputError, match="permission"):
            check_output(tmp_path / "plan.dxf")
        with pytest.raises(OutputError, match="cannot write"):
            export(one_storey, tmp_path / "plan.dxf")
    finally:
        tmp_path.chmod(0o700)


def test_files_that_cannot_be_made_are_one_line(one_storey):
    path = Path("/proc/plan.dxf")  # nobody, not even the superuser, makes files there
    if not path.parent.is_dir():
        pytest.skip("/proc is absent on this system")
    with pytest.raises(OutputError) as caught:
        export(one_storey, path)
    assert "\n" not in str(caught.value)


def test_a_library_that_calls_a_full_disk_something_else_leaves_nothing(tmp_path, monkeypatch):
    def fail(path: Path) -> None:
        path.with_name("journal.tmp").write_bytes(b"left behind")
        raise RuntimeError("An unknown error occurred")

    usage = shutil.disk_usage(tmp_path)
    for free, expected in ((0, OutputError), (2**30, RuntimeError)):  # with room left it is a bug
        monkeypatch.setattr(shutil, "disk_usage", lambda _, free=free: usage._replace(free=free))
        with pytest.raises(expected), replacing(tmp_path / "plan.ifc") as temporary:
            fail(temporary)
        assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", ALL)
def test_an_output_whose_name_no_encoding_explains(suffix, one_storey, tmp_path):
    name = os.fsdecode(b"pl\xffan")
    assert all(path.name.startswith(name) for path in export(one_storey, tmp_path / f"{name}{suffix}"))
    folder = tmp_path / name
    folder.mkdir()
    if suffix not in (".gpkg", ".ifc"):
        assert export(one_storey, folder / f"plan{suffix}")
        return
    with pytest.raises(OutputError, match="the name of its folder is no text"):  # their libraries take text alone
        export(one_storey, folder / f"plan{suffix}")
    assert list(folder.iterdir()) == []
