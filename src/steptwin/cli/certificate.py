"""``steptwin certificate``: a certificate for encrypted connections to gateways and to the studio."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    folder: Annotated[Path, typer.Argument(help="Folder for certificate.pem and key.pem.")],
    host: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Another host name or address of this computer; may be repeated.")
    ] = None,
    days: Annotated[int, typer.Option(help="How long it is valid.")] = 1825,
    role: Annotated[
        str | None,
        typer.Option(
            metavar="ROLE", help="Of a client of Modbus TCP Security: viewer (reads), operator or engineer (write, too)."
        ),
    ] = None,
    name: Annotated[str, typer.Option(help="Who has it, as others see it.")] = "steptwin",
) -> None:
    """Make a certificate, signed by itself, and its key: for [gateway.opcua], tls_tcp of a [[line]], steptwin studio."""
    from steptwin.files.certificate import make_certificate

    for file in make_certificate(folder, host or [], days, role=role, name=name):
        typer.echo(file)
