"""The command line: what it prints, where, and with which exit code."""

from __future__ import annotations

import contextlib
import os
import pty
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import laspy
import numpy as np
import pytest

import asbuilt
from asbuilt.cli.histogram import draw_heights
from asbuilt.export import known_suffixes
from asbuilt.storeys import HeightHistogram, Level
from rooms import write_las

ASBUILT = [sys.executable, "-m", "asbuilt"]


@pytest.fixture(scope="module")
def room(tmp_path_factory) -> Path:
    """A room of 6 m x 4 m x 2.5 m as LAS, a point each 4 cm, with 3 mm of noise."""
    x, y, z = (np.arange(0, length, 0.04) for length in (6.0, 4.0, 2.5))
    surfaces = [np.stack(np.meshgrid(x, y, [level]), -1) for level in (0.0, 2.5)]
    surfaces += [np.stack(np.meshgrid(x, [side], z), -1) for side in (0.0, 4.0)]
    surfaces += [np.stack(np.meshgrid([side], y, z), -1) for side in (0.0, 6.0)]
    points = np.concatenate([surface.reshape(-1, 3) for surface in surfaces])
    points += np.random.default_rng(1).normal(0.0, 0.003, points.shape)
    return write_las(tmp_path_factory.mktemp("clouds") / "room.las", points + 0.05)


def test_version(run):
    assert run("--version") == (0, f"asbuilt {asbuilt.__version__}\n", "")


@pytest.mark.parametrize("command", ["plan", "info", "evaluate", "label"])
def test_help_teaches_by_example(command, run):
    code, out, _ = run(command, "--help")
    assert code == 0
    assert out.count(f"    asbuilt {command} ") >= 2


def test_plan_writes_each_format_and_says_what_it_found(room, run, tmp_path):
    outputs = [tmp_path / f"plan{suffix}" for suffix in (".geojson", ".dxf", ".svg", ".png")]
    code, out, err = run("plan", room, *(part for path in outputs for part in ("-o", path)))
    assert code == 0, err
    assert err == ""
    assert "storey 0: floor 0.05 m" in out
    assert [line for line in out.splitlines() if line.startswith("wrote")] == [f"wrote {path}" for path in outputs]
    assert all(path.stat().st_size > 0 for path in outputs)


def test_a_file_name_that_no_encoding_explains_reaches_every_format_as_text(room, tmp_path):
    odd = tmp_path / os.fsdecode(b"sc\xffan\n\xc3\xa4 \xe5\x9b\xb3.las")
    odd.symlink_to(room)
    outputs = [tmp_path / f"plan{suffix}" for suffix in known_suffixes() if suffix != ".csv"]  # those are three
    command = [*ASBUILT, "plan", odd, *(part for path in outputs for part in ("-o", path))]
    done = subprocess.run(command, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert [path for path in outputs if not path.exists()] == []
    (source,) = asbuilt.load_plan(tmp_path / "plan.geojson").inputs
    assert source["name"] == r"sc\udcffan\nä 図.las"
    assert subprocess.run([*ASBUILT, "info", "--headers", odd], capture_output=True, check=True).stderr == b""


def test_options_reach_the_parameters_and_the_plan_file(room, run, tmp_path):
    path = tmp_path / "plan.geojson"
    said = ["--preset", "paper", "-k", 2, "--hough", "batch", "--fill-gap", 0.5, "--min-length", 0.3, "--snap-deg", 3]
    code, _, err = run(
        "plan", room, "-o", path, *said, "--slices", 5, "--crs", "epsg:25832", "--set", "lines.rho_step=0.5"
    )
    assert code == 0, err
    plan = asbuilt.load_plan(path)
    assert plan.crs == "EPSG:25832"
    assert plan.parameters["preset_name"] == "paper"
    assert plan.parameters["cross_sections"]["count"] == 5
    lines = plan.parameters["lines"]
    assert lines["rho_step"] == 0.5
    assert (lines["sigmas"], lines["method"], lines["fill_gap"], lines["min_length"]) == (2, "batch", 0.5, 0.3)
    assert plan.parameters["orientation"]["snap"] == pytest.approx(np.radians(3))


def test_any_number_of_threads_gives_the_same_bytes(room, run, tmp_path):
    for threads in (1, 3):
        assert run("plan", room, "-o", tmp_path / f"{threads}.geojson", "--threads", threads)[0] == 0
    assert (tmp_path / "1.geojson").read_bytes() == (tmp_path / "3.geojson").read_bytes()


def test_nothing_found_writes_the_plan_names_the_stage_and_exits_1(run, tmp_path):
    ground = np.stack(np.meshgrid(np.arange(0, 5, 0.05), np.arange(0, 5, 0.05), [0.05]), -1).reshape(-1, 3)
    cloud = write_las(tmp_path / "ground.las", ground)
    code, _, err = run("plan", cloud, "-o", tmp_path / "plan.geojson", "-o", tmp_path / "plan.png")
    assert code == 1
    assert "storeys:" in err or "lines:" in err
    assert asbuilt.load_plan(tmp_path / "plan.geojson").wall_faces == ()
    assert (tmp_path / "plan.png").exists()


def one_line(err: str, *words: object) -> bool:
    return err.startswith("asbuilt: ") and err.count("\n") == 1 and all(str(word) in err for word in words)


def test_an_unknown_suffix_is_found_before_the_input_is_even_looked_for(run, tmp_path):
    code, out, err = run("plan", tmp_path / "absent.las", "-o", tmp_path / "plan.docx")
    assert (code, out) == (2, "")
    assert one_line(err, "plan.docx", ".geojson", ".dxf", ".svg", ".png")


@pytest.mark.parametrize(
    ("name", "content"),
    [("empty.las", b""), ("text.las", b"1 2 3\n" * 100), ("short.las", None), ("absent.las", ...), ("folder", ...)],
)
@pytest.mark.parametrize("command", ["plan", "info"])
def test_a_bad_input_is_one_line_that_names_the_file(command, name, content, room, run, tmp_path):
    path = tmp_path / name
    if name == "folder":
        path.mkdir()
    elif content is None:
        path.write_bytes(room.read_bytes()[:20000])
    elif content is not ...:
        path.write_bytes(content)
    code, _, err = run(command, path, *(["-o", tmp_path / "plan.dxf"] if command == "plan" else []))
    assert code == 2
    assert one_line(err, path)
    assert not (tmp_path / "plan.dxf").exists()


@pytest.mark.parametrize(
    "wrong",
    [
        ["--unit", "mile"], ["--up", "w"], ["--crs", "25832"], ["--preset", "best"], ["--storey", 7],
        ["--fill-gap", -1], ["--hough", "both"], ["--slices", 0], ["--band", 2, 1], ["--cross-sections", "some"],
        ["--set", "rho=1"], ["--set", "lines.rho=1"], ["--set", "no.rho=1"], ["--set", "lines.rho_step=wide"],
        ["--set", "lines.max_lines=3.5"], ["--set", "lines.rho_step=true"], ["--set", "walls.bridge=wide"],
        ["--max-lines", 3], ["--hough", "batch"], ["--set", "storeys.slab=0"], ["--snap-deg", 3],
        ["--voxel", 0.03], ["--voxel", 0.2], ["--voxel", 0.1, "--set", "storeys.voxel=0.25"],
        ["--preset", "paper", "--unseen-thickness", 0.2], ["--preset", "paper", "--band", 1, 2, "--slices", 3],
    ],
    ids=lambda wrong: " ".join(map(str, wrong)),
)  # fmt: skip
def test_a_bad_argument_is_one_line_and_leaves_no_output(wrong, room, run, tmp_path):
    code, _, err = run("plan", room, "-o", tmp_path / "plan.dxf", *wrong)
    assert code == 2
    assert one_line(err)
    assert list(tmp_path.iterdir()) == []


def test_an_option_that_the_preset_or_the_outputs_do_not_read_is_told_with_the_one_that_does(room, run, tmp_path):
    _, _, err = run("plan", room, "-o", tmp_path / "plan.dxf", "--max-lines", 3)
    assert err.startswith("asbuilt: lines.max_lines = 3: preset default does not read it;")
    assert "preset paper" in err
    code, _, err = run("plan", room, "-o", tmp_path / "plan.geojson", "--scale", "1:50", "--north", 3)
    assert (code, err.partition(":")[2].strip()[:16]) == (2, "--scale, --north")
    assert one_line(err)


def test_skip_bad_goes_on_lists_what_it_left_out_and_exits_3(room, run, tmp_path):
    bad = tmp_path / "bad.las"
    bad.write_bytes(b"not a cloud")
    code, _, err = run("plan", room, bad, "-o", tmp_path / "plan.geojson")
    assert (code, one_line(err, bad), "--skip-bad" in err) == (2, True, True)
    assert "--skip-bad" not in run("plan", bad, "-o", tmp_path / "plan.geojson")[2]
    code, _, err = run("plan", room, bad, "-o", tmp_path / "plan.geojson", "--skip-bad")
    assert code == 3
    assert err.startswith(f"asbuilt: left out: {bad}")
    assert run("plan", room, "-o", tmp_path / "alone.geojson")[0] == 0
    assert (tmp_path / "plan.geojson").read_bytes() == (tmp_path / "alone.geojson").read_bytes()
    assert run("info", bad, room, "--skip-bad")[0] == 3
    assert run("plan", bad, "-o", tmp_path / "none.geojson", "--skip-bad")[0] == 2  # nothing left


def crc32c(data: bytes) -> bytes:
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return (crc ^ 0xFFFFFFFF).to_bytes(4, "little")


def test_skip_bad_leaves_out_evidence_that_is_wrong_behind_its_head(run, tmp_path):
    good, bad = tmp_path / "good.evidence", tmp_path / "bad.evidence"
    asbuilt.evidence_from_points(np.random.default_rng(0).random((50, 3))).save(good)
    content = good.read_bytes()[:-4]
    content = content[:-1] + bytes([content[-1] | 0x80])  # a number that does not end
    bad.write_bytes(content + crc32c(content))
    for inputs in ([bad, good], [good, bad]):
        code, _, err = run("info", *inputs)
        assert (code, one_line(err)) == (2, True)
        code, _, err = run("info", *inputs, "--skip-bad")
        assert code == 3
        assert f"\nasbuilt: left out: {bad}" in err


def test_the_page_on_the_command_line_tells_every_command(run):
    page = (Path(__file__).parent.parent / "docs" / "cli.md").read_text()
    listed = re.findall(r"^  ([a-z]+)  ", run("--help")[1].partition("Commands:")[2], re.MULTILINE)
    assert re.findall(r"^\| `asbuilt ([a-z]+)` ", page, re.MULTILINE) == listed
    assert re.findall(r"^## asbuilt ([a-z]+)$", page, re.MULTILINE) == listed


def test_what_is_wrong_with_a_command_names_that_command(run):
    for wrong in (["plan", "x.las", "-o"], ["plan", "--skip-bad=1", "x.las"], ["plan", "--hough", "both", "x.las"]):
        code, _, err = run(*wrong)
        assert code == 2
        assert err.endswith("(asbuilt plan -h tells how)\n")


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (["--nope"], "No such option '--nope'. (asbuilt plan -h"),
        (["--scael", "1:50"], "Did you mean '--scale'?"),
        (["--unit", "furlong"], "unit 'furlong': expected m, dm, cm, mm, ft, us-ft, in\n"),
        (["--up", "w"], "up 'w': expected z, y, x, -z, -y, -x\n"),
        (["-o", "plan.dwg"], "take .dxf"),
        (["-o", "plan.LAZ"], "asbuilt label writes points with their classes\n"),
    ],
)  # fmt: skip
def test_advice_names_what_was_meant(wrong, told, room, run, tmp_path):
    code, _, err = run("plan", room, "-o", tmp_path / "plan.dxf", *wrong)
    assert (code, told in err) == (2, True), err
    assert err.count("Did you mean") == told.count("Did you mean")


def test_an_output_without_its_own_o_is_told_from_a_scan(room, run, tmp_path):
    code, _, err = run("plan", room, "-o", tmp_path / "plan.dxf", tmp_path / "plan.svg")
    assert (code, one_line(err, tmp_path / "plan.svg", "-o of its own")) == (2, True)
    assert list(tmp_path.iterdir()) == []


def test_a_reader_that_leaves_early_is_no_bug_where_there_is_no_signal_for_it(room):
    script = "import signal; del signal.SIGPIPE; from asbuilt_start import main; main()"
    ours, theirs = os.pipe()
    os.close(ours)
    done = subprocess.run([sys.executable, "-c", script, "info", str(room)], stdout=theirs, stderr=subprocess.PIPE)
    os.close(theirs)
    assert (done.returncode, done.stderr) == (1, b"")


def test_info_prints_what_the_files_hold_and_draws_the_heights(room, run):
    code, out, err = run("info", room)
    assert (code, err) == (0, "")
    assert "LAS 1.4" in out
    assert f"points  {len(laspy.read(room).points):,}" in out
    assert re.search(r"^ +0.00 to 0.10 \|#+ +< floor of storey 0 at 0.05$", out, re.MULTILINE)
    assert "ceiling of storey 0" in out


def test_info_asks_for_the_unit_where_heights_are_those_of_no_building(run, tmp_path):
    x, y = (part.ravel() for part in np.meshgrid(np.arange(0.0, 5000.0, 50.0), np.arange(0.0, 4000.0, 50.0)))
    scan = write_las(tmp_path / "mm.las", np.concatenate([np.column_stack([x, y, 0 * x + z]) for z in (0.0, 2600.0)]))
    code, _, err = run("info", scan)
    assert (code, err.startswith("asbuilt: note: unit: "), "--unit mm" in err) == (0, True, True)


def test_info_of_headers_reads_no_points(room, run, monkeypatch):
    monkeypatch.setattr(asbuilt, "gather_evidence", None)
    code, out, _ = run("info", "--headers", room)
    assert code == 0
    assert "bounds  x " in out


def test_heights_are_drawn_highest_first_and_fit_the_terminal():
    histogram = HeightHistogram(-100.0, 0.1, np.r_[np.ones(1000, int), 50, np.full(24, 5), 40, np.zeros(2000, int), 1])
    lines = draw_heights(histogram, [Level(0, 0.02, 2.55)], columns=70, rows=40)
    assert len(lines) <= 40
    assert all(len(line) <= 70 for line in lines)
    assert "ceiling of storey 0 at 2.55" in next(line for line in lines if "####" in line)
    assert draw_heights(HeightHistogram(0.0, 0.1, np.zeros(0, int)), [], 80, 40) == []


def test_a_bug_is_one_line_too(room, run, monkeypatch):
    monkeypatch.setattr(asbuilt, "gather_evidence", lambda *_, **__: 1 / 0)
    code, _, err = run("info", room)
    assert code == 70
    assert one_line(err, "ZeroDivisionError", "report")


def rest_of(terminal: int) -> bytes:
    """All that is still written to a terminal."""
    seen = b""
    with contextlib.suppress(OSError):  # its end
        while more := os.read(terminal, 65536):
            seen += more
    return seen


def heed_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def test_ctrl_c_while_reading_stops_at_once_and_leaves_nothing(example, tmp_path):
    scans = tmp_path / "scans"
    scans.mkdir()
    content = bytearray((example / "scans.laz").read_bytes())
    for i in range(24):  # some 20 s of reading, of different files: the GUID in the header
        content[8] = i
        (scans / f"{i}.laz").write_bytes(content)
    command = [*ASBUILT, "plan", str(scans), "-o", str(tmp_path / "plan.dxf")]
    ours, theirs = pty.openpty()
    env = {**os.environ, "TERM": "xterm"}
    # What runs in the background is started with interrupts ignored.
    with subprocess.Popen(command, stderr=theirs, env=env, preexec_fn=heed_interrupts) as process:
        os.close(theirs)
        try:
            seen = b""
            while not re.search(rb"[1-9]%", seen):  # of the bar: points are being read
                seen += os.read(ours, 65536)
            started = time.monotonic()
            process.send_signal(signal.SIGINT)
            seen += rest_of(ours)
        finally:
            os.close(ours)
    assert time.monotonic() - started < 15.0  # half a second, on a machine with nothing else to do
    assert process.returncode == 130
    assert seen.endswith(b"asbuilt: interrupted\r\n")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scans"]


def test_ctrl_c_while_the_library_is_loaded_is_one_line():
    script = """
import sys
class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == "click":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interrupt())
from asbuilt_start import main
main()
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "asbuilt: interrupted\n")


def test_a_reader_that_leaves_early_is_no_error(room):
    with subprocess.Popen([*ASBUILT, "info", room], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == b""


def test_printing_to_a_full_disk_is_one_line(room):
    with open("/dev/full", "w") as full:
        done = subprocess.run([*ASBUILT, "info", room], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert one_line(done.stderr, "standard output", "no space")


def test_progress_is_drawn_on_a_terminal_only(room, tmp_path):
    command = [*ASBUILT, "plan", str(room), "-o", str(tmp_path / "plan.geojson")]
    assert subprocess.run(command, capture_output=True, check=True).stderr == b""
    ours, theirs = pty.openpty()
    terminal = {**os.environ, "TERM": "xterm"}
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=theirs, env=terminal) as process:
        os.close(theirs)
        seen = rest_of(ours)  # while it runs: a terminal that nobody reads is full soon
    os.close(ours)
    assert process.returncode == 0
    assert b"reading" in seen


def test_help_and_errors_do_not_wait_for_heavy_imports():
    heavy = ("numpy", "matplotlib", "ezdxf", "scipy", "shapely", "rich.progress")
    script = f"import sys, asbuilt.cli, asbuilt.export; print([name for name in {heavy} if name in sys.modules])"
    assert subprocess.check_output([sys.executable, "-c", script], text=True) == "[]\n"


def test_the_console_script_is_installed():
    script = Path(sys.executable).with_name("asbuilt")
    assert subprocess.check_output([script, "--version"], text=True).startswith("asbuilt ")
