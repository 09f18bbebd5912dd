"""One secured daemon with a running mission of the vehicle `hull`, and a session for each role."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from secured import HULL, ROLES, Secured, answers, make_certificates, session_as, start_secured
from survey import config


@pytest.fixture(scope="package")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_certificates(tmp_path_factory.mktemp("certificates") / "tls")


@pytest.fixture(scope="module")
def secured(certificates: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Secured]:
    daemon = start_secured(certificates, tmp_path_factory.mktemp("secured"))
    with (
        session_as("vehicle", certificates, daemon.endpoint) as vehicle,
        session_as("operator", certificates, daemon.endpoint) as operator,
        session_as("observer", certificates, daemon.endpoint) as observer,
    ):
        sessions = dict(zip(ROLES, (vehicle, operator, observer), strict=True))
        assert answers(operator, f"{HULL}/op/configure", config("m")) == ["answered"]
        assert answers(operator, f"{HULL}/op/start", {"reason": "test"}) == ["answered"]
        yield Secured(daemon, certificates, sessions)
    assert daemon.stop() == 0, daemon.log.read_text()
