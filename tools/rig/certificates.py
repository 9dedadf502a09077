"""Certificates for the tests: an authority, and what it signs. Nothing of it is kept."""

import datetime
import ipaddress
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID


class Authority:
    """A certificate authority of its own, or a certificate that nobody has signed."""

    def __init__(self, folder: Path, name: str = "ca") -> None:
        """Make the authority's key and certificate: ``<name>.pem`` in the folder."""
        self._folder, self._key = folder, ec.generate_private_key(ec.SECP256R1())
        self._name = _common_name("pneuarm test authority")
        certificate = _certificate(self._name, self._name, self._key, self._key, True)
        (folder / f"{name}.pem").write_bytes(_pem(certificate))

    def sign(self, common_name: str, file: str = "") -> None:
        """Write ``<file>.pem`` and ``<file>.key`` for somebody on 127.0.0.1."""
        key = ec.generate_private_key(ec.SECP256R1())
        certificate = _certificate(_common_name(common_name), self._name, key, self._key, False)
        path = self._folder / (file or common_name)
        path.with_suffix(".pem").write_bytes(_pem(certificate))
        path.with_suffix(".key").write_bytes(
            key.private_bytes(
                serialization.Encoding.PEM,
                serialization.PrivateFormat.PKCS8,
                serialization.NoEncryption(),
            )
        )


def _common_name(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _pem(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(serialization.Encoding.PEM)


def _certificate(
    subject: x509.Name,
    issuer: x509.Name,
    key: ec.EllipticCurvePrivateKey,
    signing_key: ec.EllipticCurvePrivateKey,
    authority: bool,
) -> x509.Certificate:
    now, day = datetime.datetime.now(datetime.UTC), datetime.timedelta(days=1)
    here = x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))])
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - day)
        .not_valid_after(now + day)
        .add_extension(x509.BasicConstraints(ca=authority, path_length=None), critical=True)
        .add_extension(here, critical=False)
        .sign(signing_key, hashes.SHA256())
    )
