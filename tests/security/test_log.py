"""What pdnd's log says of a client that does not come in."""

import pytest
import zenoh

from conftest import wait_until
from secured import Secured, session_as


def test_a_refused_certificate_is_told_as_one(secured: Secured) -> None:
    """Zenoh speaks of the limit of open files, whatever the reason."""
    authority = secured.certificates / "ca.pem"
    with (
        pytest.raises(zenoh.ZError),
        session_as("", secured.certificates, secured.daemon.endpoint, authority),
    ):
        pass
    told = "A client has not got through the TLS handshake"
    wait_until(lambda: told in secured.daemon.log.read_text(), "the log to tell of the client")
    assert "open file limit" not in secured.daemon.log.read_text()
