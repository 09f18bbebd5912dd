"""Published pose graphs, streamed keyframe by keyframe through the client, reach the published optimum."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from conftest import Daemon, shared_data
from json_zenoh import JsonVehicle, open_session

# What the published figures are held to: two independent computations of them agree to 1e-11, and the
# smoother re-linearises until its steps are below 1e-7, so 1e-6 leaves room for neither to be wrong.
RELATIVE_CHI2 = 1e-6
SCALED_MARGINAL = 1e-6

# The published marginals have the rotation first.
TRANSLATION_FIRST = [3, 4, 5, 0, 1, 2]


NAMES = ["sphere2500", "sphere2500_toro", "parking-garage", "smallGrid3D", "tinyGrid3D"]
"""The longest first: they are streamed side by side, each as a vehicle of its own, and none waits for
another.
"""


def import_graph(daemon: Daemon, name: str) -> None:
    path = shared_data("pose_graphs", f"{name}.txt" if name.endswith("_toro") else f"{name}.g2o")
    command = [sys.executable, "-m", "pdn.cli", "import", str(path), "--vehicle", name.lower(),
               "--connect", daemon.endpoint, "--json"]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=1500, check=False)
    assert done.returncode == 0, done.stderr
    json.loads(done.stdout)


@pytest.fixture(scope="module")
def imports(request: pytest.FixtureRequest, daemon: Daemon) -> Iterator[dict[str, Future[None]]]:
    """What is under way; of the graphs, those whose tests were asked for."""
    asked = [name for name in NAMES if any(f"[{name}]" in item.name for item in request.session.items)]
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        yield {name: pool.submit(import_graph, daemon, name) for name in asked}


def graph_of(daemon: Daemon, name: str) -> dict[str, Any]:
    with open_session(daemon.endpoint) as session:
        return JsonVehicle(session, name.lower(), "").ask("rpc/graph", marginals="true", timeout_s=60)


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", NAMES)
def test_streamed_graph_reaches_the_optimum(
    daemon: Daemon, imports: dict[str, Future[None]], name: str
) -> None:
    published = json.loads(shared_data("pose_graphs", "expected", f"{name}.json").read_text())["result"]
    optimum = published["optimal"]["se3log"]
    imports[name].result()
    graph = graph_of(daemon, name)
    assert len(graph["keyframes"]) == published["vertices"]
    assert graph["factors"]["relative"] == published["edges"]
    assert graph["chi2"] == pytest.approx(optimum["chi2"], rel=RELATIVE_CHI2)
    truth = np.array(optimum["cov_last_prior_1e-3"])[np.ix_(TRANSLATION_FIRST, TRANSLATION_FIRST)]
    last = next(keyframe for keyframe in graph["keyframes"] if keyframe["id"] == published["last_id"])
    sigma = np.sqrt(np.diag(truth))
    error = np.abs(np.reshape(last["covariance"], (6, 6)) - truth) / np.outer(sigma, sigma)
    assert error.max() < SCALED_MARGINAL
