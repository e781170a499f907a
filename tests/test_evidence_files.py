"""Evidence files: the same bytes by every path, resumed where they were left, and safe against any bytes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from itertools import permutations
from pathlib import Path

import laspy
import numpy as np
import pye57
import pytest
from hypothesis import given
from hypothesis import strategies as st

import asbuilt
from asbuilt import Evidence, InputError, OutputError, ParameterError, gather_evidence, read_evidence
from asbuilt.params import EvidenceParameters
from asbuilt.provenance import Provenance

ASBUILT = [sys.executable, "-c", "from asbuilt.cli import main; main()"]


def write_cloud(path: Path, seed: int, count: int = 3000) -> Path:
    """Points of one scan in a box of 6 m, as LAS or text."""
    points = np.random.default_rng(seed).uniform(-3, 3, (count, 3)).round(3)
    if path.suffix == ".xyz":
        np.savetxt(path, points, fmt="%.3f")
        return path
    las = laspy.create(point_format=6, file_version="1.4")
    las.header.scales = [0.001] * 3
    las.x, las.y, las.z = points.T
    las.point_source_id = np.full(count, seed, dtype=np.uint16)
    las.write(path)
    return path


@pytest.fixture
def scans(tmp_path: Path) -> list[Path]:
    folder = tmp_path / "scans"
    folder.mkdir()
    return [write_cloud(folder / name, seed) for seed, name in enumerate(["c.las", "a.laz", "b.xyz", "d.las"])]


@pytest.fixture
def whole(scans, run, tmp_path) -> bytes:
    """The bytes of all scans, read at once."""
    code, out, err = run("evidence", *scans, "-o", tmp_path / "whole.evidence")
    assert (code, err) == (0, "")
    assert "12,000 points in 4 files and 4 scans" in out
    assert not list(tmp_path.glob("whole.evidence.*"))
    return (tmp_path / "whole.evidence").read_bytes()


def test_files_and_threads_leave_no_trace(scans, whole, run, tmp_path):
    for number, order in enumerate(permutations(scans)):
        run("evidence", *order, "--threads", 1 + number % 3, "-o", tmp_path / "again.evidence")
        assert (tmp_path / "again.evidence").read_bytes() == whole


def test_every_format_gives_the_same_voxels(tmp_path):
    points = np.random.default_rng(5).uniform(-20, 20, (5000, 3)).round(4)
    np.savetxt(tmp_path / "a.xyz", points, fmt="%.4f")
    np.savetxt(
        tmp_path / "a.pts", np.column_stack([points, np.zeros((5000, 4))]), fmt="%.4f", header="5000", comments=""
    )
    (tmp_path / "a.ptx").write_text(
        "5000\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
        + "".join(f"{x:.4f} {y:.4f} {z:.4f} 0.5\n" for x, y, z in points)
    )
    with (tmp_path / "a.ply").open("wb") as ply:
        properties = "".join(f"property double {axis}\n" for axis in "xyz")
        ply.write(f"ply\nformat binary_little_endian 1.0\nelement vertex 5000\n{properties}end_header\n".encode())
        points.astype("<f8").tofile(ply)
    for name, point_format, version in [("a.las", 3, "1.2"), ("a3.laz", 3, "1.2"), ("a7.laz", 7, "1.4")]:
        las = laspy.create(point_format=point_format, file_version=version)
        las.header.scales = [1e-4] * 3
        las.x, las.y, las.z = points.T
        las.write(tmp_path / name)
    with pye57.E57(str(tmp_path / "a.e57"), mode="w") as e57:
        e57.write_scan_raw({f"cartesian{axis}": column for axis, column in zip("XYZ", points.T, strict=True)})
    for occupancy in (False, True):
        parameters = EvidenceParameters(occupancy=occupancy)
        expected = asbuilt.evidence_from_points(points, parameters)
        files = sorted(tmp_path.glob("a*.*"))
        assert len(files) == 8
        for file in files:
            found = gather_evidence(asbuilt.read(file), parameters)
            for name in ("index", "count", "mean", "covariance"):
                assert np.array_equal(getattr(found, name), getattr(expected, name)), file


def test_merged_evidence_is_that_of_all_scans(scans, whole, run, tmp_path):
    for number, scan in enumerate(scans):
        run("evidence", scan, "-o", tmp_path / f"{number}.evidence")
    parts = [tmp_path / f"{number}.evidence" for number in range(4)]
    for order in list(permutations(parts))[::5]:
        assert run("merge", *order, "-o", tmp_path / "merged.evidence")[0] == 0
        assert (tmp_path / "merged.evidence").read_bytes() == whole
    run("merge", *parts[:2], "-o", tmp_path / "left.evidence")
    run("merge", *parts[2:], "-o", tmp_path / "right.evidence")
    run("merge", tmp_path / "left.evidence", tmp_path / "right.evidence", "-o", tmp_path / "tree.evidence")
    assert (tmp_path / "tree.evidence").read_bytes() == whole


def test_scans_are_added_without_reading_the_old_ones(scans, whole, run, tmp_path):
    school = tmp_path / "school.evidence"
    run("evidence", *scans[:2], "-o", school)
    scans[0].unlink()
    scans[1].unlink()
    code, _, err = run("evidence", *scans[2:], "--add-to", school, "-o", school)
    assert (code, err) == (0, "")
    assert school.read_bytes() == whole


def test_a_scan_comes_in_once(scans, run, tmp_path):
    school = tmp_path / "school.evidence"
    run("evidence", *scans[:2], "-o", school)
    before = school.read_bytes()
    copy = tmp_path / "copy.las"
    copy.write_bytes(scans[0].read_bytes())
    code, _, err = run("evidence", copy, scans[2], "--add-to", school, "-o", school)
    assert code == 2
    assert err.startswith("asbuilt: c.las and copy.las are the same file (sha256:")
    code, _, err = run("merge", school, school, "-o", tmp_path / "x.evidence")
    assert (code, err.startswith(f"asbuilt: {school}: given twice"), err.count("\n")) == (2, True, 1)
    code, _, err = run("merge", school, copy, "-o", tmp_path / "x.evidence")
    assert (code, "expected an evidence file, found LAS" in err) == (2, True)
    run("evidence", copy, "-o", tmp_path / "copy.evidence")
    code, _, err = run("merge", school, tmp_path / "copy.evidence", "-o", tmp_path / "x.evidence")
    assert (code, "same file" in err, school.read_bytes() == before) == (2, True, True)


def test_a_bad_file_costs_only_itself(scans, whole, run, tmp_path, monkeypatch):
    good = scans[3].read_bytes()
    scans[3].write_bytes(good[:-500] + bytes(500))  # its header is sound; not so the end of its points
    text = scans[2].read_text()
    scans[2].write_text(f"{text}not a point\n")
    out = tmp_path / "out.evidence"
    code, _, err = run("evidence", *scans, "-o", out, "--threads", 1)
    assert (code, "b.xyz" in err, out.exists()) == (2, True, False)
    assert len(list((tmp_path / "out.evidence.parts").iterdir())) >= 2
    scans[2].write_text(text)
    scans[3].write_bytes(good)

    read = []
    gather = asbuilt._core.Evidence.gather

    class Watched:
        load = asbuilt._core.Evidence.load

        @staticmethod
        def gather(files, **options):
            read.extend(path for path, _ in files)
            return gather(files, **options)

    monkeypatch.setattr(asbuilt.gather._core, "Evidence", Watched)
    code, _, err = run("evidence", *scans, "-o", out)
    assert (code, err) == (0, f"asbuilt: resuming from {out}.parts\n")
    assert set(read) == {scans[2], scans[3]}  # what had been read was not read again
    assert out.read_bytes() == whole
    assert not out.with_name("out.evidence.parts").exists()


def test_ctrl_c_keeps_what_is_read(scans, tmp_path):
    cloud = asbuilt.read(*scans)
    kept = tmp_path / "parts"

    for wanted in (1, 3, None):
        done = 0

        def interrupt(_done: int, _promised: int, wanted: int | None = wanted) -> None:
            nonlocal done
            done = len(list(kept.glob("*.evidence")))
            if wanted is not None and done >= wanted:
                raise KeyboardInterrupt

        try:
            evidence = gather_evidence(cloud, threads=1, progress=interrupt, resume=kept)
        except KeyboardInterrupt:
            assert done >= wanted
    assert len(list(kept.glob("*.evidence"))) == len(scans)
    expected = gather_evidence(cloud)
    assert evidence.core.to_bytes(evidence.provenance.to_text()) == expected.core.to_bytes(
        expected.provenance.to_text()
    )


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="kill is a matter of Unix")
def test_a_killed_run_is_resumed(tmp_path, run):
    scans = [write_cloud(tmp_path / f"{seed}.xyz", seed, 60_000) for seed in range(8)]
    out = tmp_path / "out.evidence"
    arguments = ["evidence", *map(str, scans), "-o", str(out), "--threads", "1"]
    for kills in range(3):
        process = subprocess.Popen([*ASBUILT, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while process.poll() is None:
            if len(list(out.with_name("out.evidence.parts").glob("*.evidence"))) > 2 * kills:
                os.kill(process.pid, signal.SIGKILL)
                break
            time.sleep(0.001)
        process.wait()
    assert run(*arguments)[0] == 0
    run("evidence", *scans, "-o", tmp_path / "whole.evidence")
    assert out.read_bytes() == (tmp_path / "whole.evidence").read_bytes()


def test_a_plan_starts_from_evidence(example, run, tmp_path):
    scan, saved = example / "scans.laz", tmp_path / "house.evidence"
    run("evidence", scan, "-o", saved)
    for name, source in (("a", scan), ("b", saved)):
        assert run("plan", source, "-o", tmp_path / f"{name}.geojson")[0] == 0
    assert (tmp_path / "a.geojson").read_bytes() == (tmp_path / "b.geojson").read_bytes()
    code, out, _ = run("info", saved)
    assert (code, "asbuilt evidence, version 1" in out, "1 storey" in out) == (0, True, True)
    plan = asbuilt.extract_floor_plan(read_evidence(saved))
    assert len(plan.wall_faces) == len(asbuilt.load_plan(tmp_path / "a.geojson").wall_faces)


def test_occupancy_serves_the_paper_and_only_that(example, run, tmp_path):
    scan, bits, sums = example / "scans.laz", tmp_path / "bits.evidence", tmp_path / "sums.evidence"
    run("evidence", scan, "--occupancy", "-o", bits)
    run("evidence", scan, "-o", sums)
    assert 4 * bits.stat().st_size < sums.stat().st_size
    few, many = read_evidence(bits), read_evidence(sums)
    assert few.occupancy
    assert few.points == many.points
    assert np.array_equal(few.index, many.index)
    assert (few.count == 0).all()
    assert (few.mean == 0.025).all()
    plans = [asbuilt.extract_floor_plan(e, asbuilt.Parameters.preset("paper")).wall_faces for e in (few, many)]
    assert len(plans[0]) > 4
    assert plans[0] == plans[1]
    code, _, err = run("plan", bits, "-o", tmp_path / "plan.geojson")
    assert (code, "keeps occupancy alone" in err, "--preset paper" in err) == (2, True, True)
    code, _, err = run("merge", bits, sums, "-o", tmp_path / "both.evidence")
    assert (code, err.count("\n")) == (2, 1)


def test_voxels_and_units_of_evidence_stand(scans, run, tmp_path):
    coarse = tmp_path / "coarse.evidence"
    run("evidence", scans[0], "--voxel", "0.1", "-o", coarse)
    assert run("evidence", scans[1], "--add-to", coarse, "-o", coarse)[0] == 0
    assert read_evidence(coarse).voxel == 0.1
    with pytest.raises(ParameterError, match=r"its voxels are 0\.1 m and stay so"):
        gather_evidence(asbuilt.read(coarse), EvidenceParameters(voxel=0.02))
    with pytest.raises(ParameterError, match="in metres with z up"):
        gather_evidence(asbuilt.read(coarse, unit="mm"))
    plan = asbuilt.extract_floor_plan(coarse)
    assert plan.parameters["evidence"]["voxel"] == 0.1
    # the unit is that of the new scans, not of the evidence
    code, _, err = run("evidence", scans[2], "--unit", "mm", "--add-to", coarse, "-o", coarse)
    assert (code, err) == (0, "")


@pytest.mark.parametrize("option", [[], ["--preset", "paper"]])
def test_damage_is_refused_in_one_line(option, scans, whole, run, tmp_path):
    for number, place in enumerate((3, 18, 40, len(whole) // 2, len(whole) - 1)):
        damaged = bytearray(whole)
        damaged[place] ^= 4
        path = tmp_path / f"{number}.evidence"
        path.write_bytes(damaged)
        code, out, err = run("plan", path, "-o", tmp_path / "plan.geojson", *option)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert path.name in err


def test_what_cannot_be_written_is_refused_before_reading(scans, run, tmp_path):
    for name in ("plan.dxf", "no/such/folder/a.evidence"):
        code, _, err = run("evidence", *scans, "-o", tmp_path / name)
        assert (code, err.count("\n")) == (2, 1)
    with pytest.raises(OutputError, match="No such file"):
        gather_evidence(asbuilt.read(*scans)).save(tmp_path / "no" / "a.evidence")


@given(st.binary(max_size=200), st.text(max_size=50))
def test_any_text_may_stand_for_the_inputs(data: bytes, text: str) -> None:
    for found in (text, data.decode("latin-1"), f"[{text}]", f'{{"inputs":{text}}}', "[" * 100_000):
        try:
            provenance = Provenance.from_text(found)
        except ValueError:
            continue
        assert Provenance.from_text(provenance.to_text()) == provenance


@given(st.binary(max_size=100))
def test_any_bytes_may_come_in(data: bytes) -> None:
    for head in (b"", b"asbuilt evidence", b"asbuilt evidence\1\0\0\0"):
        with pytest.raises(InputError):
            asbuilt._core.Evidence.from_bytes(head + data)


def test_an_evidence_file_whose_inputs_are_no_json_is_damaged(scans, tmp_path):
    path = tmp_path / "odd.evidence"
    gather_evidence(asbuilt.read(*scans)).core.save(path, "no json")
    with pytest.raises(InputError, match=r"odd\.evidence.*damaged"):
        Evidence.load(path)
    with pytest.raises(InputError, match=r"odd\.evidence.*damaged"):
        asbuilt.read(path)
