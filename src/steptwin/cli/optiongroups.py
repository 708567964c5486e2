"""Groups of options: a frozen dataclass whose fields are options of a command, which takes the group as one argument."""

from __future__ import annotations

import copy
import inspect
from collections.abc import Callable, Iterator
from dataclasses import Field, fields
from functools import wraps
from typing import Annotated, Any, ClassVar, get_args, get_origin, get_type_hints

from typer.core import TyperCommand

from steptwin.errors import Misuse


class OptionGroup:
    """Base of the groups. A field is ``name: Annotated[type, typer.Option(...)] = default``.

    The option of a field is its name; a field whose option is a word of Python, such as ``--from``, ends in ``_`` and names it.
    """

    heading: ClassVar[str] = "Options"
    """Of its section in the help of a command."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def given(self) -> dict[str, Any]:
        """The values of the fields that have another value than their default."""
        return {field.name: value for field in fields(self) if (value := vars(self)[field.name]) != field.default}

    def refuse(self, what: str) -> None:
        """Raises `Misuse` if an option has been given, because the options do not apply to ``what``."""
        for name in self.given():
            raise Misuse(f"{option_of(name)} is not for {what}")


def option_of(name: str) -> str:
    """``start_stop`` → ``--start-stop``."""
    return f"--{name.strip('_').replace('_', '-')}"


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
            parameters.append(parameter.replace(annotation=annotation, kind=inspect.Parameter.KEYWORD_ONLY))

    @wraps(command)
    def flat(**values: object) -> None:
        for name, group in groups.items():
            values[name] = group(**{field.name: values.pop(field.name) for field in fields(group)})
        command(**values)

    vars(flat)["__signature__"] = inspect.Signature(parameters)
    return flat


def _options(group: type[OptionGroup]) -> Iterator[inspect.Parameter]:
    types = get_type_hints(group, include_extras=True)
    for field in fields(group):
        base, option = get_args(types[field.name])
        headed = copy.copy(option)
        headed.rich_help_panel = group.heading
        yield inspect.Parameter(
            field.name, inspect.Parameter.KEYWORD_ONLY, default=field.default, annotation=Annotated[base, headed]
        )
