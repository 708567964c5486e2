"""What clients of a gateway may do: the roles of `steptwin.access`, by tokens."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.access.commands import PERMITS
from steptwin.access.roles import Role
from steptwin.errors import Refusal
from steptwin.gateways.contract import GatewaySubject
from steptwin.subject.commands import Command, row_of
from steptwin.subject.contract import Result


class NotPermitted(Refusal):
    """The role of a client is not high enough."""


@dataclass(frozen=True, slots=True)
class GatewayClient:
    """A client that has been admitted."""

    name: str
    role: Role

    async def do(self, subject: GatewaySubject, wanted: Command) -> Result:
        """Raises `NotPermitted`, `Misuse`, `Refusal` and `LineFailure`."""
        self.check(wanted)
        return await subject.do(wanted)

    def check(self, wanted: Command) -> None:
        """Raises `NotPermitted`."""
        name = row_of(wanted).name
        self.check_role(name, PERMITS[name].role)

    def check_role(self, name: str, needed: Role) -> None:
        """Raises `NotPermitted` for what ``name`` stands for."""
        if self.role < needed:
            raise NotPermitted(f"{name} is for the role {needed.title}; {self.name} has the role {self.role.title}")
