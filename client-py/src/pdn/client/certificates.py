"""A client's certificate: the three files that belong together, checked before they are used."""

from __future__ import annotations

import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .errors import ConnectionFailed

COMMON_NAME = bytes.fromhex("0603550403")
"""The object identifier 2.5.4.3 as it stands in a certificate, before a name."""


@dataclass(frozen=True)
class Certificate:
    """Who the client is, and whose daemon it trusts; PEM files."""

    certificate: Path
    key: Path
    authority: Path

    @classmethod
    def beside(cls, certificate: str | Path) -> Certificate:
        """The files as `deploy/secured/make-certificates.sh` leaves them: `operator.pem`, `operator.key` and
        `ca.pem` in one folder.
        """
        path = Path(certificate)
        return cls(path, path.with_suffix(".key"), path.with_name("ca.pem"))

    @classmethod
    def of_settings(cls, tls: dict[str, Any]) -> Certificate | None:
        """What a Zenoh configuration names under `transport/link/tls`; None if it lacks any of the three."""
        names = ("connect_certificate", "connect_private_key", "root_ca_certificate")
        certificate, key, authority = (tls.get(name) for name in names)
        if not (certificate and key and authority):
            return None
        return cls(Path(certificate), Path(key), Path(authority))

    def settings(self) -> dict[str, Any]:
        """The same for a Zenoh configuration."""
        root = "transport/link/tls"
        return {
            f"{root}/connect_certificate": str(self.certificate),
            f"{root}/connect_private_key": str(self.key),
            f"{root}/root_ca_certificate": str(self.authority),
            f"{root}/enable_mtls": True,
            f"{root}/verify_name_on_connect": True,
        }

    def context(self) -> ssl.SSLContext:
        """What a connection of this client is made with; raises `ConnectionFailed` if the files are no
        use.
        """
        for path in (self.certificate, self.key, self.authority):
            try:
                path.read_bytes()
            except OSError as error:
                raise ConnectionFailed(
                    f"{path} cannot be read ({error.strerror}); a client needs its certificate, its key "
                    f"beside it ({self.key.name}) and the authority's certificate ({self.authority.name})"
                ) from error
        try:
            context = ssl.create_default_context(ssl.Purpose.SERVER_AUTH, cafile=self.authority)
        except ssl.SSLError as error:
            raise ConnectionFailed(f"{self.authority} is no certificate of an authority (PEM)") from error
        try:
            context.load_cert_chain(self.certificate, self.key)
        except ssl.SSLError as error:
            raise ConnectionFailed(
                f"{self.certificate} and {self.key} are no certificate and the key that belongs to it: "
                f"{error.reason or error}"
            ) from error
        return context

    def role(self) -> str | None:
        """The certificate's common name, by which the daemon knows the role; None if it cannot be read."""
        try:
            body = ssl.PEM_cert_to_DER_cert(_first_certificate(self.certificate.read_text()))
        except (OSError, ValueError):
            return None
        # The issuer's name stands before the subject's, and both have one.
        at = body.rfind(COMMON_NAME, 0, body.find(COMMON_NAME) + 512) + len(COMMON_NAME)
        length = body[at + 1]
        return body[at + 2 : at + 2 + length].decode(errors="replace")


def _first_certificate(text: str) -> str:
    end = "-----END CERTIFICATE-----"
    return text[: text.index(end) + len(end)]
