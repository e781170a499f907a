"""Tables, figures and the command."""

import json

import matplotlib.image
import numpy as np
import pytest
from click.testing import CliRunner
from rich.console import Console

from asbuilt.cli.evaluate import evaluate_command
from asbuilt.errors import InputError, OutputError, ParameterError
from asbuilt.evaluate import associate, evaluate
from asbuilt.evaluate.figures import draw_evaluation, truth_stretches, write_figure
from asbuilt.evaluate.table import evaluation_tables
from asbuilt.plan import FloorPlan

runner = CliRunner()


def run(*arguments):
    result = runner.invoke(evaluate_command, [str(argument) for argument in arguments], catch_exceptions=True)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.fixture
def truth():
    walls = [
        {"p": [0, 0, 4, 0], "side": "interior", "observed": 1.0},
        {"p": [4, 0, 4, 3], "side": "interior", "observed": 1.0},
        {"p": [0, -0.2, 4, -0.2], "side": "exterior", "observed": 0.0},
    ]
    return {"storeys": [{"floor": 0.0, "height": 2.5, "walls": walls, "jambs": [[0, 0, 0, -0.2]]}]}


@pytest.fixture
def files(tmp_path, truth):
    plan = {
        "type": "FeatureCollection",
        "features": [
            {
                "type": "Feature",
                "geometry": {"type": "LineString", "coordinates": ends},
                "properties": {"kind": "wall_face", "storey": 0, "id": f"f{i}"},
            }
            for i, ends in enumerate([[[0, 0.01], [3, 0.01]], [[2, 0.02], [3, 0.02]], [[0, 2], [2, 2]]])
        ],
    }
    (tmp_path / "plan.geojson").write_text(json.dumps(plan))
    (tmp_path / "truth.json").write_text(json.dumps(truth))
    return tmp_path / "plan.geojson", tmp_path / "truth.json"


def test_stretches_cut_a_face_where_its_cover_changes():
    detected, truth = np.array([[0, 0, 3, 0], [2, 0.1, 5, 0.1]]), np.array([[0, 0, 6, 0]])
    found = associate(detected, truth)
    stretches = list(truth_stretches(found, np.ones(2, dtype=bool), 0, 6.0))
    assert [depth for *_, depth in stretches] == [1, 2, 1, 0]
    assert [low for low, *_ in stretches] == pytest.approx([0, 2, 3, 5])


def test_figure_shows_found_missed_and_false(files, tmp_path):
    result = evaluate(*files)
    figure = draw_evaluation(result)
    labels = {text.get_text() for axes in figure.axes for text in axes.get_legend().get_texts()}
    assert {"found", "found more than once", "missed", "not scored", "true", "false"} <= labels
    assert any("0.5 m" in text.get_text() for text in figure.axes[0].texts)
    path = tmp_path / "figure.png"
    write_figure(result, path)
    pixels = matplotlib.image.imread(path)[:, :, :3]
    for colour in ("#1a9850", "#2b6cd4", "#d6202a"):
        rgb = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
        assert (np.abs(pixels - rgb).max(axis=2) < 0.02).sum() > 20, colour


def test_figure_of_nothing(tmp_path):
    write_figure(evaluate(FloorPlan(), {"storeys": []}), tmp_path / "empty.svg")
    with pytest.raises(OutputError, match=r"\.png, \.svg, \.pdf"):
        write_figure(evaluate(FloorPlan(), {"storeys": []}), tmp_path / "figure.gif")


def test_tables(files, truth):
    console = Console(width=80)
    with console.capture() as captured:
        console.print(evaluation_tables(evaluate(*files)))
        console.print(evaluation_tables(evaluate(FloorPlan(), truth)))
    text = captured.get()
    assert "pooled" in text
    assert "E_OS" in text
    assert "0.667" in text  # precision, observed
    assert "5cm" in text
    assert "…" not in text  # fits a terminal of 80 columns


def test_command_writes_json_and_figure(files, tmp_path):
    plan, truth = files
    report, figure = tmp_path / "scores.json", tmp_path / "scores.pdf"
    result = run(plan, truth, "--json", report, "--figure", figure, "--figure-truth", "all")
    assert result.exit_code == 0
    assert "pooled" in result.output
    data = json.loads(report.read_text())
    assert set(data) == {"pooled", "storeys", "parameters"}
    observed = data["pooled"]["observed"]
    assert observed["precision"] == pytest.approx(4 / 6)
    assert observed["recall"] == pytest.approx(3 / 7)
    assert observed["overlap"] == pytest.approx(1 / 6)
    assert data["pooled"]["doors"] is None
    assert figure.read_bytes().startswith(b"%PDF")


def test_command_limits(files, tmp_path):
    plan, truth = files
    report = tmp_path / "scores.json"
    run(plan, truth, "--json", report, "--no-distance-limit")
    data = json.loads(report.read_text())
    assert data["parameters"]["max_distance"] is None
    assert data["pooled"]["all"]["precision"] == 1
    run(plan, truth, "--json", report, "--max-distance", "0.015", "--storey", "0")
    assert json.loads(report.read_text())["pooled"]["observed"]["precision"] == pytest.approx(3 / 6)


def test_command_refuses_before_it_reads(files, tmp_path):
    plan, truth = files
    with pytest.raises(OutputError, match=r"\.gif"):
        run(plan, truth, "--figure", tmp_path / "x.gif")
    with pytest.raises(ParameterError, match="observed or all"):
        run(plan, truth, "--figure-truth", "some")
    with pytest.raises(ParameterError, match="storey 3"):
        run(plan, truth, "--storey", "3")
    with pytest.raises(InputError, match=r"absent\.geojson"):
        run(tmp_path / "absent.geojson", truth)


def test_help_teaches_by_example():
    assert "asbuilt evaluate plan.geojson truth.json --json scores.json" in " ".join(run("--help").output.split())
