"""`asbuilt export` and the drawing options of `asbuilt plan`: what is written, and errors of one line."""

from __future__ import annotations

import signal

import numpy as np
import pypdf
import pytest
from PIL import Image

import asbuilt
from asbuilt import load_plan
from asbuilt.cli import main
from asbuilt.export import export, known_suffixes
from plans import complete_plan


@pytest.fixture
def run(capsys, monkeypatch):
    """Run the command line in this process; gives the exit code, standard output and standard error."""
    monkeypatch.setattr(signal, "signal", lambda *_: None)  # the pipes of the test run stay as they are

    def run_main(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as leaving:
            main([str(argument) for argument in arguments])
        printed = capsys.readouterr()
        return leaving.value.code, printed.out, printed.err

    return run_main


@pytest.fixture
def saved(tmp_path):
    """The complete plan as asbuilt plan saves it."""
    return export(complete_plan(), tmp_path / "saved.geojson")[0]


def test_export_writes_a_saved_plan_as_it_would_have_been_written_at_once(saved, run, tmp_path):
    outputs = [tmp_path / f"plan{suffix}" for suffix in (".dxf", ".svg", ".pdf", ".geojson")]
    options = ("--scale", "1:50", "--sheet", "A2", "--north", "-12.5", "--date", "2026-11-22", "--title", "School")
    code, out, err = run("export", saved, *(part for path in outputs for part in ("-o", path)), *options)
    assert (code, err) == (0, "")
    names = ["plan.dxf", "plan_s0.svg", "plan_s1.svg", "plan.pdf", "plan.geojson"]
    assert out.splitlines() == [f"wrote {tmp_path / name}" for name in names]
    (tmp_path / "direct").mkdir()
    drawing = {"scale": 50, "sheet": "A2", "north": -12.5, "date": "2026-11-22", "title": "School"}
    for suffix in (".dxf", ".svg", ".pdf"):
        for path in export(complete_plan(), tmp_path / "direct" / f"plan{suffix}", **drawing):
            assert path.read_bytes() == (tmp_path / path.name).read_bytes()
    assert load_plan(tmp_path / "plan.geojson") == complete_plan()


def test_export_of_a_picture_says_that_it_lacks_the_points(saved, run, tmp_path):
    code, _, err = run("export", saved, "-o", tmp_path / "plan.png")
    assert code == 0
    assert "plan.png cannot show the scans' points" in err
    assert err.count("\n") == 1
    with Image.open(tmp_path / "plan_s0.png") as image:
        assert image.size[0] == 1800


def test_export_shows_the_points_of_saved_evidence(run, tmp_path):
    points = np.random.default_rng(2).uniform((0, 0, 112.5), (8, 5, 115.0), (20000, 3))
    asbuilt.evidence_from_points(points).save(tmp_path / "room.evidence")
    (saved,) = export(complete_plan(0.0, 0.0), tmp_path / "saved.geojson")
    (tmp_path / "white").mkdir()
    for folder, more in ((tmp_path, ("--evidence", tmp_path / "room.evidence")), (tmp_path / "white", ())):
        assert run("export", saved, "-o", folder / "plan.png", *more)[0] == 0
    seen, white = (
        np.asarray(Image.open(folder / "plan_s0.png").convert("L")).mean() for folder in (tmp_path, tmp_path / "white")
    )
    assert seen < white - 10


def test_export_of_what_is_no_plan_is_one_line(run, tmp_path):
    (tmp_path / "other.geojson").write_text('{"type": "Feature"}')
    code, _, err = run("export", tmp_path / "other.geojson", "-o", tmp_path / "plan.dxf")
    assert code == 2
    assert "expected a plan that asbuilt wrote as .geojson, found JSON without features" in err
    assert err.count("\n") == 1
    assert not (tmp_path / "plan.dxf").exists()


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--scale", "big", "scale is big, expected a positive number such as 1:100"),
        ("--sheet", "A9", "sheet is 'A9', expected A4"),
        ("--north", "inf", "north is inf"),
    ],
)
@pytest.mark.parametrize("command", ["plan", "export"])
def test_drawing_options_are_checked_before_anything_is_read(command, option, value, message, run, tmp_path):
    code, _, err = run(command, tmp_path / "absent.geojson", "-o", tmp_path / "plan.pdf", option, value)
    assert code == 2
    assert message in err
    assert err.count("\n") == 1


def test_a_drawing_too_large_for_its_sheet_does_not_cost_the_other_outputs(saved, run, tmp_path):
    outputs = [tmp_path / name for name in ("plan.pdf", "again.geojson")]
    arguments = (part for path in outputs for part in ("-o", path))
    code, out, err = run("export", saved, *arguments, "--scale", "1:20", "--sheet", "A4")
    assert code == 2
    assert "what fits: scale 1:100 or sheet A2" in err
    assert err.count("\n") == 1
    assert out == f"wrote {outputs[1]}\n"
    assert [path.exists() for path in outputs] == [False, True]


def test_plan_draws_the_example_to_scale(example, run, tmp_path):
    drawing = ("--scale", "1:100", "--sheet", "A3", "--date", "2026-11-22", "--set", "walls.min_length=0.2")
    code, _, err = run("plan", example / "scans.laz", "-o", tmp_path / "plan.pdf", *drawing)
    assert code == 0, err
    (page,) = pypdf.PdfReader(tmp_path / "plan.pdf").pages
    assert [round(float(side) / 72 * 25.4) for side in page.mediabox[2:]] == [420, 297]
    text = page.extract_text()
    for told in ("1:100", "Source: scans.laz", "Date: 2026-11-22", "preset default", "Changed: walls.min_length=0.2"):
        assert told in text


def test_help_of_export_teaches_by_example_and_names_every_format(run):
    code, out, _ = run("export", "--help")
    assert code == 0
    assert out.count("asbuilt export ") >= 2
    assert all(suffix in out for suffix in known_suffixes())
