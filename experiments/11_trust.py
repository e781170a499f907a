"""How far each wall face can be trusted: fits the model of `asbuilt.trust`, and shows how far to believe it.

    python experiments/11_trust.py           fit, and write the figures and the picture
    python experiments/11_trust.py --keep    make this fit the one that plans are trusted by, python/asbuilt/trust.json

The model is fitted on the shared cases and the buildings of the development seeds. What is reported of them is from
models fitted without the building in question; the buildings of the held-back seeds are reported only. Plans are made
by the pipeline as it is, which is looked at where it hands its faces to `trust_faces`.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from typing import Any
from unittest.mock import patch

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import accuracy
import asbuilt
from accuracy import AGAIN, CASES, HELD_BACK, SHARED
from asbuilt import Evidence, Parameters, pipeline
from asbuilt.evaluate import evaluate
from asbuilt.evaluate.faces import FaceScore, coverage, reliability
from asbuilt.grid import FloatArray
from asbuilt.plan import LOA_SIGMAS, loa_band
from asbuilt.trust import FEATURES, MODEL, Looks, look_at

RESULTS = accuracy.KEPT.parent
KEPT_EVIDENCE = accuracy.ROOT / "out" / "trust"
#: Weights are drawn towards zero by this, so that rare features do not run away.
PENALTY = 1.0


@dataclass(frozen=True)
class Planned:
    """The faces of one building: what the evidence shows of them, and how they score; both in the same order."""

    name: str
    group: str
    looks: Looks
    scores: tuple[FaceScore, ...]

    @property
    def real(self) -> FloatArray:
        """Whether each face is (n,), as 0 or 1."""
        return np.array([score.real for score in self.scores], dtype=np.float64)

    @property
    def distance(self) -> FloatArray:
        """Error of each face (n,), m; NaN where it has none."""
        return np.array([np.nan if score.distance is None else score.distance for score in self.scores])

    def trusted(self, model: dict[str, Any]) -> tuple[FaceScore, ...]:
        """The scores with sigma and confidence by a model."""
        weights = np.array([model["weights"][name] for name in FEATURES])
        confidence = 1 / (1 + np.exp(-(model["intercept"] + self.looks.features @ weights)))
        sigma = model["sigma"] * np.sqrt(self.looks.scatter * self.looks.disagreement)
        return tuple(
            replace(score, properties={"confidence": c, **({"sigma": s} if seen else {})})
            for score, c, s, seen in zip(self.scores, confidence, sigma, self.looks.supported, strict=True)
        )


def plan(job: tuple[str, str]) -> Planned:
    """Plan one building, and score its faces."""
    group, name = job
    evidence, truth = _evidence(group, name)
    seen: dict[str, tuple[Looks, int]] = {}

    def looking(wall_faces: Any, faces: Any, elevations: Any, voxels: Any) -> Any:
        looks = look_at(faces, elevations, voxels) if faces else None
        seen.update((face.id, (looks, i)) for i, face in enumerate(wall_faces) if looks is not None)
        return wall_faces

    with patch.object(pipeline, "trust_faces", looking):
        scores = evaluate(asbuilt.extract_floor_plan(evidence), truth).scores.faces
    found = [seen[score.id] for score in scores]
    columns = [
        np.array([getattr(looks, part)[i] for looks, i in found])
        for part in ("scatter", "disagreement", "features", "supported")
    ]
    return Planned(name, group, Looks(*columns), scores)


def _evidence(group: str, name: str) -> tuple[Evidence, dict[str, Any]]:
    """A building's evidence and truth; generated ones are kept, since it is their scanning that takes long."""
    if group == SHARED:
        folder = CASES / name
        evidence = asbuilt.gather_evidence(asbuilt.read(folder / "scans.laz"), threads=1)
        return evidence, json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    kept = KEPT_EVIDENCE / f"{name}.evidence"
    if not kept.exists():
        KEPT_EVIDENCE.mkdir(parents=True, exist_ok=True)
        building = accuracy.generate(name)
        kept.with_suffix(".json").write_text(json.dumps(building.truth), encoding="utf-8")
        accuracy._evidence(building, Parameters()).save(kept)
    return Evidence.load(kept), json.loads(kept.with_suffix(".json").read_text(encoding="utf-8"))


def fit(buildings: Sequence[Planned]) -> dict[str, Any]:
    """The model that suits some buildings best: logistic regression, and the factor that covers 95 % of the errors."""
    x = np.concatenate([building.looks.features for building in buildings])
    real = np.concatenate([building.real for building in buildings])
    terms = np.column_stack([np.ones(len(x)), x])
    ridge = PENALTY * np.diag([0.0, *np.ones(x.shape[1])])
    weights = np.zeros(terms.shape[1])
    for _ in range(50):
        likely = 1 / (1 + np.exp(-terms @ weights))
        slope = terms.T @ (likely - real) + ridge @ weights
        curvature = (terms * (likely * (1 - likely))[:, None]).T @ terms + ridge
        weights -= np.linalg.solve(curvature, slope)
    # The factor must cover 95 % in each group by itself: cases that were scanned better would hide what others need.
    groups = dict.fromkeys(building.group for building in buildings)
    factor = max(_factor([b for b in buildings if b.group == group]) for group in groups)
    named = {name: round(float(w), 4) for name, w in zip(FEATURES, weights[1:], strict=True)}
    return {"sigma": round(factor, 4), "intercept": round(float(weights[0]), 4), "weights": named}


def _factor(buildings: Sequence[Planned]) -> float:
    """What sigma takes to cover 95 % of the errors of the real faces."""
    misfit = np.concatenate([np.sqrt(b.looks.scatter * b.looks.disagreement) for b in buildings])
    distance = np.concatenate([building.distance for building in buildings])
    known = np.concatenate([(b.real > 0) & b.looks.supported for b in buildings]) & np.isfinite(distance)
    return float(np.quantile(distance[known] / (LOA_SIGMAS * misfit[known]), 0.95))


def left_out(buildings: Sequence[Planned]) -> list[tuple[FaceScore, ...]]:
    """The faces of each building, trusted by a model that has not seen it."""
    return [b.trusted(fit([other for other in buildings if other is not b])) for b in buildings]


def summary(scores: Sequence[FaceScore]) -> dict[str, Any]:
    """How far confidence and sigma of faces can be believed."""
    confidence = np.array([score.properties["confidence"] for score in scores])
    real = np.array([score.real for score in scores], dtype=np.float64)
    sure = confidence >= 0.9
    sigma = np.array([score.properties["sigma"] for score in scores if "sigma" in score.properties])
    bands = [loa_band(LOA_SIGMAS * value) for value in sigma.tolist()]
    return {
        "faces": len(scores),
        "real": round(float(real.mean()), 4),
        "mean_confidence": round(float(confidence.mean()), 4),
        "given_0.9_or_more": {"faces": int(sure.sum()), "real": round(float(real[sure].mean()), 4)},
        "brier": round(float(np.mean((confidence - real) ** 2)), 4),
        "reliability": _rounded(reliability(scores)),
        "coverage": _rounded([coverage(scores)])[0],
        "median_sigma_mm": round(1000 * float(np.median(sigma)), 2),
        "bands": {band: bands.count(band) for band in sorted(set(bands), reverse=True)},
    }


def _rounded(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [{key: round(v, 4) if isinstance(v, float) else v for key, v in row.items()} for row in rows]


def picture(groups: dict[str, Sequence[FaceScore]]) -> Figure:
    """Reliability, and how errors compare with what was claimed, for each group."""
    figure = Figure(figsize=(9, 4.2), dpi=100, layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot([0, 1], [0, 1], color="#9a9a9a", lw=0.8)
    right.axvline(LOA_SIGMAS, color="#9a9a9a", lw=0.8)
    right.axhline(0.95, color="#9a9a9a", lw=0.8)
    for (name, scores), colour in zip(groups.items(), ("#d6004f", "#0077b6", "#e8a33d"), strict=False):
        rows = reliability(scores)
        x, y, n = (np.array([row[key] for row in rows]) for key in ("confidence", "real", "faces"))
        left.plot(x, y, color=colour, lw=1, label=f"{name}, {len(scores)} faces")
        left.scatter(x, y, s=6 + 3 * np.sqrt(n), color=colour)
        ratios = [
            score.distance / score.properties["sigma"]
            for score in scores
            if score.real and score.distance is not None and score.properties.get("sigma")
        ]
        right.plot(np.sort(ratios), np.arange(1, len(ratios) + 1) / len(ratios), color=colour, lw=1.2)
    left.set(xlabel="confidence", ylabel="share that is real", title="Reliability (dots by number of faces)")
    right.set(xlabel="error over sigma", ylabel="share of the real faces", xlim=(0, 4), title="Coverage of the errors")
    left.legend(fontsize=7)
    return figure


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", action="store_true", help=f"write the model to {MODEL.name} of the package")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes")
    arguments = parser.parse_args()
    work = [job for job in accuracy.jobs([]) if job[0] != AGAIN]
    with ProcessPoolExecutor(arguments.jobs, mp_context=get_context("spawn")) as processes:
        planned = []
        for done in processes.map(plan, work):
            planned.append(done)
            print(f"{len(planned)} of {len(work)}: {done.name}, {len(done.scores)} faces", file=sys.stderr)
    tuned = [building for building in planned if building.group != HELD_BACK]
    held_back = [building for building in planned if building.group == HELD_BACK]
    model = fit(tuned)
    fair = dict(zip([b.name for b in tuned], left_out(tuned), strict=True))
    groups: dict[str, Sequence[FaceScore]] = {
        group: [score for building in tuned if building.group == group for score in fair[building.name]]
        for group in dict.fromkeys(building.group for building in tuned)
    }
    groups[HELD_BACK] = [score for building in held_back for score in building.trusted(model)]
    report = {
        "command": "python experiments/11_trust.py",
        "version": asbuilt.__version__,
        "model": model,
        **{name: summary(scores) for name, scores in groups.items()},
    }
    print(json.dumps(report, indent=1))
    (RESULTS / "11_trust.json").write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    FigureCanvasAgg(picture(groups)).print_figure(RESULTS / "figure_reliability.png", metadata={"Software": None})
    if arguments.keep:
        MODEL.write_text(json.dumps(model, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
