"""Options of the shell from annotated fields and parameters (`steptwin.options`)."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from dataclasses import fields
from functools import wraps
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer
from typer.core import TyperCommand

from steptwin.cli import completion
from steptwin.cli.writtenfiles import keep_apart
from steptwin.options import Option, OptionGroup, option_of

REPEATED = tuple[str, ...]


class GroupedCommand(TyperCommand):
    """A command whose help shows each group of options under its heading."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        sections: dict[str, list[tuple[str, str]]] = {"Arguments": [], "Options": []}
        for parameter in self.get_params(ctx):
            row = parameter.get_help_record(ctx)
            if row is not None:
                own = "Arguments" if parameter.param_type_name == "argument" else "Options"
                sections.setdefault(_heading(parameter) or own, []).append(row)
        for heading, rows in sections.items():
            if rows:
                with formatter.section(heading):
                    formatter.write_dl(rows)


def _heading(parameter: Any) -> str | None:
    return vars(parameter).get("rich_help_panel")  # an option that is no field, such as --help, has none


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """A command with the options of its groups in the place of each parameter that is an `OptionGroup`."""
    types = get_type_hints(command, include_extras=True)
    groups: dict[str, type[Any]] = {}
    parameters: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        annotation = types[name]
        if get_origin(annotation) is None and issubclass(annotation, OptionGroup):
            groups[name] = annotation
            parameters += _options(annotation)
        else:
            parameters.append(_parameter(name, annotation, parameter.default))
    repeated = [parameter.name for parameter in parameters if parameter.default == ()]
    for number, parameter in enumerate(parameters):
        if parameter.name in repeated:
            parameters[number] = parameter.replace(default=None)

    @wraps(command)
    def flat(**values: Any) -> None:
        for name in repeated:
            values[name] = tuple(values[name] or ())
        for name, group in groups.items():
            values[name] = group(**{field.name: values.pop(field.name) for field in fields(group) if field.name in values})
        command(**values)

    vars(flat)["__signature__"] = inspect.Signature(parameters)
    return flat


def _options(group: type[OptionGroup]) -> Iterator[inspect.Parameter]:
    types = get_type_hints(group, include_extras=True)
    for field in fields(group):
        if get_origin(types[field.name]) is Annotated:  # the others are for Python programs
            yield _parameter(field.name, types[field.name], field.default, group.heading)


def _parameter(name: str, annotation: Any, default: Any, heading: str | None = None) -> inspect.Parameter:
    """The parameter as typer takes it."""
    if get_origin(annotation) is Annotated:
        base, text = get_args(annotation)
        if isinstance(text, Option):
            flags = text.flags or ((option_of(name),) if base is bool and default is False else ())
            shown = typer.Option(
                *flags,
                help=text.help,
                metavar=text.metavar,
                autocompletion=None if text.completion is None else getattr(completion, text.completion),
                callback=keep_apart if text.is_written else None,
                rich_help_panel=heading,
            )
            annotation = Annotated[list[str] | None if base == REPEATED else base, shown]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
