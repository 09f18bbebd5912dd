"""Why there is no session, or no answer, and what to do: found out by trying, since Zenoh says only that
time ran out.
"""

from __future__ import annotations

import contextlib
import socket
import ssl
from pathlib import Path

from pdn import wire

from .certificates import Certificate
from .errors import ConnectionFailed

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
"""Where `pdnd` listens when nothing else is said."""

DEFAULT_VEHICLE = "vehicle"
"""Who is meant on the command line where no vehicle is named."""

PROBE_S = 1.5
"""Longest wait for each step of a probe, s."""

NO_TLS = "what listens there does not speak TLS: is it a pdnd without security (tcp/...)?"

ROLE_OF = {"in": "vehicle", "rpc": "vehicle or operator", "op": "operator"}
"""Which role deploy/secured lets speak under a prefix."""


def why_no_session(endpoint: str, certificate: Certificate | None) -> str:
    """One sentence on why a session could not be opened, found by a plain socket."""
    protocol, _, address = endpoint.partition("/")
    address = address.split("?")[0].split("#")[0]
    if protocol == "unixsock-stream":
        if not Path(address).exists():
            return f"the socket {address} does not exist; is pdnd running, and does it listen there?"
        return "nobody answers on the socket; is pdnd running, and may this user open the socket?"
    host, _, port = address.rpartition(":")
    if protocol not in ("tcp", "tls") or not port.isdigit():
        return f"is that the address? The usual form is {DEFAULT_ENDPOINT}."
    host = host.strip("[]")
    try:
        with socket.create_connection((host, int(port)), timeout=PROBE_S) as opened:
            return (
                _why_no_tls(opened, host, certificate) if protocol == "tls" else _why_no_tcp(opened, endpoint)
            )
    except ConnectionRefusedError:
        return "nothing listens there. Is the daemon running (start it with `pdnd`), and is the port right?"
    except socket.gaierror:
        return f"the host name {host!r} is not known."
    except TimeoutError:
        return f"{host} does not answer; is the address right, and does a firewall stand between?"
    except OSError as error:
        return f"{error.strerror or error}."


def why_not_allowed(topic: wire.Topic, certificate: Certificate | None) -> str:
    """What is probably wrong where the planner is there but does not hear this."""
    prefix = topic.value.split("/")[0]
    needed = ROLE_OF.get(prefix, "another")
    role = certificate.role() if certificate else None
    if role is None:
        return (
            f"access rules probably keep this client from {topic.value}; it takes a certificate of the role "
            f"{needed} (--certificate)."
        )
    return (
        f"access rules probably keep this client from {topic.value}: its certificate is of the role "
        f"{role!r}, and it takes {needed}."
    )


def _why_no_tcp(opened: socket.socket, endpoint: str) -> str:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    opened.settimeout(PROBE_S)
    with contextlib.suppress(OSError), context.wrap_socket(opened):
        secured = "tls/" + endpoint.removeprefix("tcp/")
        return f"what listens there speaks TLS: write {secured}, and give a certificate (--certificate)."
    return "the port is open, but what listens there does not speak Zenoh, or has no room for another client."


def _why_no_tls(opened: socket.socket, host: str, certificate: Certificate | None) -> str:
    if certificate is None:
        return (
            "a secured daemon asks for a certificate: give one with --certificate (or PDN_CERTIFICATE), or "
            "in a Zenoh configuration."
        )
    try:
        context = certificate.context()
    except ConnectionFailed as error:
        return f"{error}."
    opened.settimeout(PROBE_S)
    try:
        with context.wrap_socket(opened, server_hostname=host, do_handshake_on_connect=False) as secured:
            try:
                secured.do_handshake()
            except TimeoutError:
                return NO_TLS
            # With TLS 1.3 the daemon judges the client's certificate once the client thinks that all is well.
            secured.recv(1)
    except ssl.SSLCertVerificationError as error:
        return _why_daemon_not_trusted(error, host, certificate)
    except ssl.SSLError as error:
        return _why_client_not_trusted(error, certificate)
    except TimeoutError:
        return "the certificates are well, but the daemon does not answer; has it room for another client?"
    return "the certificates are well, but the connection was closed; has the daemon room for another client?"


def _why_daemon_not_trusted(error: ssl.SSLCertVerificationError, host: str, certificate: Certificate) -> str:
    message = error.verify_message
    if "mismatch" in message or "not valid for" in message:
        return (
            f"the daemon's certificate is not made out for {host!r}; connect by a name that it has, or make "
            f"one with --host {host} (deploy/secured/make-certificates.sh)."
        )
    if "expired" in message or "not yet valid" in message:
        return f"the daemon's certificate is out of date ({message}); renew it, and look at the clock here."
    return (
        f"the daemon's certificate is not of the authority {certificate.authority} ({message}); take the "
        "ca.pem that belongs to this daemon."
    )


def _why_client_not_trusted(error: ssl.SSLError, certificate: Certificate) -> str:
    reason = (error.reason or str(error)).upper()
    if "WRONG_VERSION" in reason or "UNEXPECTED_EOF" in reason or "RECORD" in reason:
        return NO_TLS
    if "EXPIRED" in reason:
        return f"the daemon says that {certificate.certificate} has expired; renew it."
    if "REQUIRED" in reason:
        return "the daemon asks for a certificate and got none; give one with --certificate."
    return (
        f"the daemon does not accept {certificate.certificate} ({reason.lower().replace('_', ' ')}); was it "
        "signed by the daemon's authority?"
    )
