"""Evidence by the workers of a dask cluster: the same bytes as on one machine, whatever becomes of a worker."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest

import asbuilt
from asbuilt import AsBuiltError, Evidence, InputError, ParameterError, cluster, gather_evidence
from asbuilt.cli import main
from asbuilt.cluster import gather_evidence_on_cluster
from asbuilt.read import InputFile

distributed = pytest.importorskip("distributed")
DATA = Path(__file__).parent / "data"
pytestmark = [
    pytest.mark.filterwarnings("ignore"),  # dask's own, about its housekeeping
    pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="kill is a matter of Unix"),
]


@pytest.fixture(scope="module")
def workers():
    """A cluster of two processes on this machine."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as local:
        yield local


@pytest.fixture
def scans(tmp_path: Path) -> list[Path]:
    """LAZ in several chunks, E57 in scans and packets, COPC in nodes, and text of several parts."""
    rng = np.random.default_rng(0)
    text = tmp_path / "long.xyz"
    np.savetxt(text, rng.uniform(-5, 5, (400_000, 3)), fmt="%.7f")  # 12 MB: two parts
    names = ["laz_three_chunks_format6.laz", "laz_three_chunks_format0.laz", "e57_packets_scaled.e57", "copc.laz"]
    return [text, *(DATA / name for name in [*names, "e57_double.e57", "text_two_scans.ptx", "ply_meshio_ascii.ply"])]


@pytest.fixture(autouse=True)
def small_tasks(monkeypatch):
    monkeypatch.setattr(cluster, "TASK_POINTS", 60_000)
    monkeypatch.setattr(cluster, "TASK_PARTS", 1)
    monkeypatch.setattr(cluster, "FAN_IN", 2)


def as_bytes(evidence: Evidence) -> bytes:
    return evidence.core.to_bytes(evidence.provenance.to_text())


def test_the_same_bytes_as_on_one_machine(workers, scans, tmp_path):
    cloud = asbuilt.read(*scans)
    steps = []
    found = gather_evidence_on_cluster(
        cloud, workers.scheduler_address, progress=lambda done, promised: steps.append((done, promised))
    )
    assert as_bytes(found) == as_bytes(gather_evidence(cloud))
    assert len(steps) > len(scans)  # files were read in parts
    assert steps == sorted(steps)
    with pytest.raises(SystemExit) as leaving:
        main(["evidence", str(scans[1]), "--dask", workers.scheduler_address, "-o", str(tmp_path / "a.evidence")])
    assert leaving.value.code == 0
    expected = gather_evidence(asbuilt.read(scans[1]))
    assert (tmp_path / "a.evidence").read_bytes() == as_bytes(expected)


def test_a_killed_worker_costs_only_its_tasks(workers, scans):
    cloud = asbuilt.read(*scans)
    killed = []

    def kill(_done: int, _promised: int) -> None:
        if not killed:
            worker = next(iter(workers.workers.values()))
            killed.append(worker.pid)
            os.kill(worker.pid, signal.SIGKILL)

    found = gather_evidence_on_cluster(cloud, workers.scheduler_address, progress=kill)
    assert killed
    assert as_bytes(found) == as_bytes(gather_evidence(cloud))


def test_a_file_missing_on_a_worker_is_named(workers, scans, monkeypatch):
    cloud = asbuilt.read(*scans)
    # the client saw it, and it is gone when the workers come
    checksums = {file.path: file.checksum() for file in cloud.files}
    monkeypatch.setattr(InputFile, "checksum", lambda self: checksums[self.path])
    scans[0].unlink()
    with pytest.raises(InputError, match=r"long\.xyz: No such file.*\(on worker tcp://"):
        gather_evidence_on_cluster(cloud, workers.scheduler_address)
    found = gather_evidence_on_cluster(cloud, workers.scheduler_address, skip_bad=True)
    assert [str(error).split(":")[0] for error in found.errors] == [str(scans[0])]
    assert as_bytes(found) == as_bytes(gather_evidence(asbuilt.read(*scans[1:])))


def test_nobody_there(tmp_path, monkeypatch, scans):
    monkeypatch.setattr(cluster, "SECONDS_TO_ANSWER", 1)
    with pytest.raises(ParameterError, match=r"tcp://127\.0\.0\.1:9: no dask scheduler answers"):
        gather_evidence_on_cluster(asbuilt.read(*scans[1:2]), "tcp://127.0.0.1:9")
    assert issubclass(ParameterError, AsBuiltError)
