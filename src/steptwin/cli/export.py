"""``steptwin export``: a recorded trace as files for other programs.

From Python: `steptwin.files.export.write_trace`.
"""

from __future__ import annotations

import enum
from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.device import Json, print_json
from steptwin.cli.writtenfiles import written
from steptwin.errors import Misuse


class ExportFormat(enum.StrEnum):
    HTML = "html"
    PNG = "png"
    SVG = "svg"
    GLB = "glb"
    VCD = "vcd"
    PCAPNG = "pcapng"
    CSV = "csv"
    PARQUET = "parquet"
    JSONL = "jsonl"


def command(
    trace: Annotated[Path, typer.Argument(help="A trace (.jsonl), or the directory that has trace.jsonl.")],
    to: Annotated[list[ExportFormat] | None, typer.Option(help="Format; may be given more than once.")] = None,
    output: Annotated[
        Path | None, written("--output", "-o", help="File or directory; default: beside the trace, named alike.")
    ] = None,
    begin: Annotated[str, typer.Option("--from", metavar="TIME", help="Where to begin: 9.5, 500ms, 2min.")] = "0",
    until: Annotated[
        str | None,
        typer.Option(
            metavar="TIME", help="Where to end. Default: the end of the run; of pictures, shortly after the last change."
        ),
    ] = None,
    controller: Annotated[
        list[str] | None, typer.Option("--machine", help="Only this controller; may be given more than once.")
    ] = None,
    texts: Annotated[
        bool, typer.Option("--texts/--no-texts", help="Signals of type string (vcd): GTKWave shows them, sigrok refuses them.")
    ] = True,
    period: Annotated[str, typer.Option(metavar="TIME", help="Between two samples (csv, parquet).")] = "1ms",
    json: Json = False,
) -> None:
    """Write a recorded trace as timeline (html), picture (png, svg), machine in motion (glb), signals (vcd), frames (pcapng) or
    samples (csv, parquet)."""
    from steptwin.files.export import bar, read_trace, write_trace
    from steptwin.files.timedinputs import parse_duration

    if not to and output is None:
        raise Misuse(f"nothing to write: name formats with --to ({', '.join(ExportFormat)}) or a file with --output")
    saved = read_trace(trace)
    formats = [form.value for form in to or ()]
    begin_ns = parse_duration(begin, "--from")
    until_ns = None if until is None else parse_duration(until, "--until")
    period_ns = parse_duration(period, "--period")
    source = trace / "trace.jsonl" if trace.is_dir() else trace
    targets = [source.with_suffix(f".{name}") for name in formats] if output is None else [output]
    files: list[Path] = []
    for i, target in enumerate(targets):
        files += write_trace(
            saved.trace,
            target,
            views=saved.views,
            scene=saved.scene,
            title=saved.title,
            ended=saved.until,
            formats=(formats or None) if output is not None else [formats[i]],
            begin=begin_ns,
            until=until_ns,
            controllers=controller or None,
            period=period_ns,
            texts=texts,
            watch=bar,
        )
    if json:
        print_json([{"file": str(path), "bytes": _bytes(path)} for path in files])
        return
    for path in files:
        size = _bytes(path)
        typer.echo(f"{path}: written" if size is None else f"{path}: {size:,} bytes")


def _bytes(path: Path) -> int | None:
    """The size of a file; None of a pipe or device, which has none."""
    return path.stat().st_size if path.is_file() else None
