"""What people feed: each ends in a result, or in one line that says what to do."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

import laspy
import numpy as np
import pytest

import asbuilt
from asbuilt.errors import InputError
from asbuilt.export import export
from plans import complete_plan
from rooms import box_room, level, noisy, wall, write_las

ASBUILT = [sys.executable, "-c", "from asbuilt.cli import main; main()"]
ROOM = noisy(box_room(0, 0, 5, 4)[::3])


def one_line(result: tuple[int, str, str], *words: object) -> bool:
    code, out, err = result
    return (code, out, err.count("\n")) == (2, "", 1) and len(err) < 500 and all(str(word) in err for word in words)


def test_a_folder_of_220_scans_gives_the_plan_of_all(run, tmp_path):
    folder = tmp_path / "many"
    folder.mkdir()
    for i in range(220):
        write_las(folder / f"scan {i:03d}.las", ROOM[i::220])
    assert run("plan", folder, "-o", tmp_path / "many.geojson")[0] == 0
    faces = asbuilt.extract_floor_plan(asbuilt.evidence_from_points(ROOM)).wall_faces
    assert len(faces) == 4
    found = asbuilt.load_plan(tmp_path / "many.geojson")
    assert found.wall_faces == faces
    assert len(found.inputs) == 220


def test_a_single_room_under_a_name_of_spaces_and_other_alphabets(run, tmp_path):
    folder = tmp_path / "Schule, Übersicht 学校 (2. OG)"
    folder.mkdir()
    scan = write_las(folder / "Raum 1 čtvrtý.las", ROOM)
    code, out, err = run("plan", scan, "-o", folder / "Plan ä.dxf", "-o", folder / "Plan ä.geojson")
    assert (code, err) == (0, "")
    assert f"wrote {folder / 'Plan ä.dxf'}" in out
    assert len(asbuilt.load_plan(folder / "Plan ä.geojson").storeys[0].rooms) == 1


def test_a_facade_seen_from_the_street_has_no_storey_and_says_so(run, tmp_path):
    facade = np.concatenate([wall((0, 0), (15, 0), 0, 9), level(0, -6, 15, 0, 0)])[::4]
    code, out, err = run("plan", write_las(tmp_path / "facade.las", noisy(facade)), "-o", tmp_path / "plan.dxf")
    assert code == 1
    assert "nothing found" in err
    assert "no floor found" in err
    assert f"wrote {tmp_path / 'plan.dxf'}" in out


def test_a_cloud_of_colours_alone_and_one_with_colours(run, tmp_path):
    colours = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    head = "ply\nformat ascii 1.0\nelement vertex 2\n"
    alone, posed = tmp_path / "alone.ply", tmp_path / "posed.ply"
    alone.write_text(f"{head}{colours}end_header\n1 2 3\n4 5 6\n")
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    posed.write_text(f"{head}{axes}{colours}end_header\n0 0 0 1 2 3\n0 0 1 4 5 6\n")
    assert one_line(run("info", alone), alone, "x, y, z", "red, green, blue")
    assert run("info", posed)[0] == 0


@pytest.mark.parametrize("suffix", ["e57", "las", "laz", "ply", "pcd", "ptx", "pts", "xyz", "csv", "evidence"])
def test_an_empty_file_is_told_by_name(suffix, run, tmp_path):
    path = tmp_path / f"scan.{suffix}"
    path.touch()
    for command in (["info"], ["plan", "-o", tmp_path / "plan.dxf"], ["evidence", "-o", tmp_path / "a.evidence"]):
        assert one_line(run(*command, path), path)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("name", "head"),
    [
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex " + b"9" * 5000 + b"\nproperty float x\nend_header\n"),
        ("b.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty " + b"float" * 5000 + b" x\nend_header\n"),
        ("c.pcd", b"VERSION 0.7\nFIELDS x y " + b"q" * 20000 + b"\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nDATA ascii\n"),
        ("d.csv", b"x,y," + b"height " * 5000 + b"\n1,2,3\n"),
    ],
)
def test_a_damaged_header_is_not_recited(name, head, run, tmp_path):
    (tmp_path / name).write_bytes(head)
    result = run("info", tmp_path / name)
    assert one_line(result, name, "expected")
    assert len(result[2]) < len(str(tmp_path)) + 300


def test_texts_and_schedules_beside_scans_are_passed_over_and_named(run, tmp_path):
    folder = tmp_path / "scans"
    folder.mkdir()
    scan = write_las(folder / "room.las", ROOM)
    np.savetxt(folder / "more.txt", ROOM[:50] + 0.001, fmt="%.4f")
    (folder / "._room.las").write_bytes(b"what another system leaves beside a file")
    tables = export(complete_plan(), folder / "plan.csv")
    (folder / "notes.txt").write_text("Scanned on Tuesday.\n")
    left_out = sorted([folder / "notes.txt", *tables])
    cloud = asbuilt.read(folder)
    assert [file.path for file in cloud.files] == [folder / "more.txt", scan]
    assert [reason.split(": ")[0] for reason in cloud.passed_over] == [str(path) for path in left_out]
    code, _, err = run("plan", folder, "-o", tmp_path / "plan.geojson")
    lines = err.splitlines()
    assert (code, len(lines)) == (0, len(left_out))
    assert all(line.startswith("asbuilt: note: passed over: ") for line in lines)
    # by its own name a text is an input, and so are files that cannot be anything else
    with pytest.raises(InputError, match=r"notes\.txt"):
        asbuilt.read(folder, folder / "notes.txt")
    (folder / "broken.xyz").write_text("no point\n")
    with pytest.raises(InputError, match=r"broken\.xyz"):
        asbuilt.read(folder)


@pytest.mark.parametrize("suffix", [".las", ".laz", ".e57"])
def test_labelled_points_among_the_scans_are_not_read_once_more(suffix, run, tmp_path):
    folder = tmp_path / "scans"
    folder.mkdir()
    write_las(folder / "room.las", ROOM)
    plan = tmp_path / "plan.geojson"
    assert run("plan", folder, "-o", plan)[0] == 0
    labelled = folder / f"classes{suffix}"
    assert run("label", folder, "--plan", plan, "-o", labelled)[0] == 0
    first = labelled.read_bytes()
    for _ in range(2):
        code, out, err = run("label", folder, "--plan", plan, "-o", labelled)
        assert (code, err.count("\n")) == (0, 1)
        assert f"passed over: {labelled}: points that asbuilt label wrote" in err
        assert f"{len(ROOM):,} points" in out
        assert labelled.read_bytes() == first
    assert len(asbuilt.read(labelled).files) == 1
    (folder / "room.las").unlink()
    assert one_line(run("info", folder), "no input holds points", labelled, "name the file itself")


def test_a_plan_in_metres_does_not_carry_the_crs_of_points_in_feet(run, tmp_path):
    feet = 'PROJCS["NAD83 / Long Island (ftUS)",GEOGCS["NAD83"],UNIT["US survey foot",0.304800609601219]]'
    for name, part in (("a", ROOM[::2]), ("b", ROOM[1::2])):
        las = laspy.read(write_las(tmp_path / f"{name}.las", part / 0.3048006096))
        las.header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(feet))
        las.header.global_encoding.wkt = True
        las.write(tmp_path / f"{name}.las")
    plan = tmp_path / "plan.geojson"
    for said, kept in (((), None), (("--crs", "EPSG:32118"), "EPSG:32118")):
        code, _, err = run("plan", tmp_path / "*.las", "-o", plan, "--unit", "us-ft", *said)
        assert (code, err.count("\n")) == (0, 1)
        assert "crs: NAD83 / Long Island (ftUS) is that of the coordinates before --unit" in err
        assert asbuilt.load_plan(plan).crs == kept
    assert asbuilt.read(tmp_path / "a.las", unit="us-ft").crs == feet  # of the points as they are


def test_a_folder_of_texts_alone_holds_no_cloud(run, tmp_path):
    (tmp_path / "notes.txt").write_text("Scanned on Tuesday.\n")
    assert one_line(run("info", tmp_path), "no input holds points", tmp_path / "notes.txt")


def test_evidence_that_does_not_fit_on_the_disk_leaves_nothing(tmp_path):
    scans = [write_las(tmp_path / f"{i}.las", ROOM[i::2]) for i in range(2)]
    done = subprocess.run(
        [*ASBUILT, "evidence", *scans, "-o", tmp_path / "a.evidence"],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)),
        capture_output=True,
        text=True,
        check=False,
    )
    assert one_line((done.returncode, done.stdout, done.stderr), tmp_path / "a.evidence")
    assert sorted(tmp_path.iterdir()) == scans


@pytest.mark.skipif(os.geteuid() == 0, reason="permissions do not bind the superuser")
def test_a_read_only_folder_is_one_line_before_reading(run, tmp_path):
    scan = write_las(tmp_path / "room.las", ROOM)
    tmp_path.chmod(0o500)
    try:
        assert one_line(run("plan", scan, "-o", tmp_path / "plan.dxf"), "permission")
        assert one_line(run("evidence", scan, "-o", tmp_path / "a.evidence"), "permission")
    finally:
        tmp_path.chmod(0o700)


def test_files_that_nobody_can_make_are_one_line(run, tmp_path):
    scan = write_las(tmp_path / "room.las", ROOM)
    assert one_line(run("plan", scan, "-o", Path("/proc/plan.dxf")), "/proc/plan.dxf")
    assert one_line(run("evidence", scan, "-o", Path("/proc/a.evidence")), "/proc/a.evidence")
