"""The nodes of a subject: one object for each controller, with its status, program, axes, pins, details and registers.

Node ids are texts: ``table.M1.position``, as the control endpoint names points. Axes have the components ``ParameterSet`` and
``MotionProfile`` of OPC 40010-1 (Robotics), where clients look for ``ActualPosition`` and ``ActualSpeed``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

from asyncua import Server, ua

from steptwin.gateways.methods import METHODS, MethodArgument, MethodRow, methods_of
from steptwin.gateways.opcua.nodetypes import VARIANTS, ZEROS, engineering_unit, standard, value_range
from steptwin.gateways.points import CLOCK, CLOCK_POINTS, GatewayPoint, PointType, points_of
from steptwin.subject.contract import ControllerDescription, Description

NAMESPACE_URI = "urn:steptwin:machines"
NAMESPACE: Any = 2
"""Its number: 0 is OPC UA, 1 the server."""
ROOT = "machines"
LEAST_LIST = 16
"""Words of a point that is shown as an array."""

_ROBOTICS: Mapping[str, tuple[str, str]] = {
    "position": ("ParameterSet", "ActualPosition"),
    "velocity": ("ParameterSet", "ActualSpeed"),
}
_MOTION_PROFILES = {"rotary": 1, "linear": 3}
"""OPC 40010-1, AxisMotionProfileEnumeration; 0 is any other."""
_OTHER_PROFILE = 0


@dataclass(frozen=True, slots=True)
class PointNode:
    """A variable that shows a point."""

    id: ua.NodeId
    point: GatewayPoint


@dataclass(frozen=True, slots=True)
class ArrayNode:
    """A variable that shows all elements of a point that is a list, such as the user registers of a controller."""

    controller: str
    path: str
    count: int

    @property
    def elements(self) -> tuple[str, ...]:
        return tuple(f"{self.controller}.{self.path}[{number}]" for number in range(self.count))


@dataclass(frozen=True, slots=True)
class BoundMethod:
    """A method of an object, which is a controller, its program, or one of its axes."""

    row: MethodRow
    part: ControllerDescription
    axis: int | None


@lru_cache(maxsize=1 << 12)
def node_id(path: Any) -> ua.NodeId:
    return ua.NodeId(path, NAMESPACE)


class AddressSpaceBuilder:
    """Collects the nodes of ``description``; ``registers``: the names of further points to show, by controller.
    ``is_kept``: whether there is a history of them."""

    def __init__(self, description: Description, registers: Mapping[str, Iterable[str]], *, is_kept: bool = False) -> None:
        self._is_kept = is_kept
        self.items: list[ua.AddNodesItem] = []
        self.references: list[ua.AddReferencesItem] = []
        """To the methods of types, which their objects share."""
        self.points: dict[str, tuple[PointNode, ...]] = {}
        """By controller, and of the clock."""
        self.arrays: dict[ua.NodeId, ArrayNode] = {}
        self.methods: dict[tuple[ua.NodeId, ua.NodeId], BoundMethod] = {}
        """By the ids of object and method."""
        self._description = description
        self._kinds = {(one.controller, int(one.axis)): one.kind for one in description.axes}
        self._types()
        self._object(ROOT, standard(ua.ObjectIds.ObjectsFolder), description.name, ua.ObjectIds.FolderType)
        if "time" in description.commands:
            self._object(CLOCK, node_id(ROOT), _title(CLOCK), ua.ObjectIds.FolderType)
            self.points[CLOCK] = tuple(self._point(CLOCK, point, is_of_axis=False) for point in CLOCK_POINTS)
        for part in description.controllers:
            self._controller(part, registers.get(part.name, ()))

    async def add_to(self, server: Server) -> None:
        session = server.iserver.isession
        for result in await session.add_nodes(self.items):
            result.StatusCode.check()
        for code in await session.add_references(self.references):
            code.check()

    def nodes(self) -> dict[ua.NodeId, tuple[str, PointNode]]:
        """The variables, with the controller (or the clock) of each."""
        return {node.id: (controller, node) for controller, nodes in self.points.items() for node in nodes}

    # ------------------------------------------------------------------ types

    def _types(self) -> None:
        """The types of objects, with their methods, which are shared by all objects of the type."""
        for name, rows in METHODS.items():
            path = f"types.{name}"
            self._item(path, standard(ua.ObjectIds.BaseObjectType), f"{name}Type", ua.ObjectIds.HasSubtype, ua.NodeId())
            self.items[-1].NodeClass = ua.NodeClass.ObjectType
            self.items[-1].NodeAttributes = _attributes(ua.ObjectTypeAttributes, f"{name}Type", "", IsAbstract=False)
            for row in rows:
                self._method(f"{path}.{row.name}", node_id(path), row)

    def _method(self, path: str, parent: ua.NodeId, row: MethodRow) -> None:
        self._item(path, parent, row.name, ua.ObjectIds.HasComponent, ua.NodeId())
        self.items[-1].NodeClass = ua.NodeClass.Method
        self.items[-1].NodeAttributes = _attributes(
            ua.MethodAttributes, row.name, row.meaning, Executable=True, UserExecutable=True
        )
        if row.arguments:
            given = ua.Variant([_argument(one) for one in row.arguments], ua.VariantType.ExtensionObject)
            self._property(f"{path}.InputArguments", node_id(path), "InputArguments", given, ua.ObjectIds.Argument, rank=1)

    # ------------------------------------------------------------------ objects

    def _controller(self, part: ControllerDescription, registers: Iterable[str]) -> None:
        name, sheet = part.name, part.datasheet
        self._object(name, node_id(ROOT), name, "types.Controller", sheet.title)
        self._bind(part, name, "Controller", None)
        for what, text in (("Model", sheet.kind), ("SoftwareRevision", sheet.variant)):
            self._property(f"{name}.{what}", node_id(name), what, ua.Variant(text), ua.ObjectIds.String)
        points = points_of(part, self._description, registers)
        lists = [point for point in sheet.points if len(point.addresses) == 1 and point.addresses[0].words >= LEAST_LIST]
        groups = dict.fromkeys(point.path[0] for point in points if len(point.path) > 1)
        groups |= dict.fromkeys(("registers",) if lists else ())
        axes = {axis.name: axis for axis in sheet.axes}
        for group in groups:
            path = f"{name}.{group}"
            axis = axes.get(group)
            if axis is not None:
                self._object(path, node_id(name), group, "types.Axis")
                self._bind(part, path, "Axis", axis.number)
                self._axis(path, self._kinds.get((name, axis.number)))
            elif group == "program":
                self._object(path, node_id(name), _title(group), "types.Program")
                self._bind(part, path, "Program", None)
            else:
                self._object(path, node_id(name), _title(group), ua.ObjectIds.FolderType)
        for one in lists:
            self._array(ArrayNode(name, one.path, one.addresses[0].words), one.meaning)
        self.points[name] = tuple(self._point(name, point, is_of_axis=point.path[0] in axes) for point in points)

    def _array(self, node: ArrayNode, meaning: str) -> None:
        path = f"{node.controller}.registers.{node.path}"
        kind = standard(ua.ObjectIds.BaseDataVariableType)
        self._item(path, node_id(f"{node.controller}.registers"), node.path, ua.ObjectIds.HasComponent, kind)
        self.items[-1].NodeClass = ua.NodeClass.Variable
        nothing = ua.Variant([], ua.VariantType.UInt16, is_array=True)
        self.items[-1].NodeAttributes = _variable(node.path, meaning, nothing, rank=1)
        self.arrays[node_id(path)] = node

    def _axis(self, path: str, kind: str | None) -> None:
        self._object(f"{path}.ParameterSet", node_id(path), "ParameterSet", ua.ObjectIds.BaseObjectType)
        profile = ua.Variant(_MOTION_PROFILES.get(kind or "", _OTHER_PROFILE), ua.VariantType.Int32)
        self._property(f"{path}.MotionProfile", node_id(path), "MotionProfile", profile, ua.ObjectIds.Int32)

    def _bind(self, part: ControllerDescription, path: str, kind: str, axis: int | None) -> None:
        """Give an object those methods of its type that its controller takes."""
        for row in methods_of(part, METHODS[kind], axis):
            method = node_id(f"types.{kind}.{row.name}")
            reference = ua.AddReferencesItem(IsForward=True, TargetNodeClass=ua.NodeClass.Method)
            reference.SourceNodeId, reference.TargetNodeId = node_id(path), method
            reference.ReferenceTypeId = standard(ua.ObjectIds.HasComponent)
            self.references.append(reference)
            self.methods[node_id(path), method] = BoundMethod(row, part, axis)

    def _point(self, controller: str, point: GatewayPoint, *, is_of_axis: bool) -> PointNode:
        path = f"{controller}.{point.name}"
        above = f"{controller}.{point.path[0]}" if len(point.path) > 1 else controller
        name = (
            _title(point.path[-1])
            if is_of_axis or point.path[0] in ("program", "details") or above == controller
            else point.path[-1]
        )
        if is_of_axis and point.path[-1] in _ROBOTICS:
            group, name = _ROBOTICS[point.path[-1]]
            above = f"{above}.{group}"
        has_unit = bool(point.unit) and point.type in (PointType.NUMBER, PointType.WHOLE)
        kind = ua.ObjectIds.AnalogUnitType if has_unit else ua.ObjectIds.BaseDataVariableType
        self._item(path, node_id(above), name, ua.ObjectIds.HasComponent, standard(kind))
        access = ua.AccessLevel.CurrentRead.mask
        if point.write is not None:
            access |= ua.AccessLevel.CurrentWrite.mask
        if self._is_kept:
            access |= ua.AccessLevel.HistoryRead.mask
        self.items[-1].NodeClass = ua.NodeClass.Variable
        zero = ua.Variant(ZEROS[point.type], VARIANTS[point.type])
        self.items[-1].NodeAttributes = _variable(name, point.meaning, zero, access=access)
        if has_unit:
            unit = _extension(engineering_unit(point.unit))
            self._property(f"{path}.EngineeringUnits", node_id(path), "EngineeringUnits", unit, ua.ObjectIds.EUInformation)
            bounds = None if point.limits is None else value_range(point.limits)
            if bounds is not None:
                self._property(f"{path}.EURange", node_id(path), "EURange", _extension(bounds), ua.ObjectIds.Range)
        return PointNode(node_id(path), point)

    # ------------------------------------------------------------------ nodes

    def _object(self, path: str, parent: ua.NodeId, name: str, kind: str | int, meaning: str = "") -> None:
        reference = ua.ObjectIds.Organizes if path == ROOT or parent == node_id(ROOT) else ua.ObjectIds.HasComponent
        self._item(path, parent, name, reference, node_id(kind) if isinstance(kind, str) else standard(kind))
        self.items[-1].NodeClass = ua.NodeClass.Object
        self.items[-1].NodeAttributes = _attributes(ua.ObjectAttributes, name, meaning, EventNotifier=0)

    def _property(self, path: str, parent: ua.NodeId, name: str, value: ua.Variant, kind: int, *, rank: int = -1) -> None:
        self._item(path, parent, name, ua.ObjectIds.HasProperty, standard(ua.ObjectIds.PropertyType))
        item = self.items[-1]
        if name in _STANDARD_NAMES:
            item.BrowseName = _name(name, 0)
        item.NodeClass = ua.NodeClass.Variable
        item.NodeAttributes = _variable(name, "", value, data_type=kind, rank=rank)

    def _item(self, path: str, parent: ua.NodeId, name: str, reference: int, kind: ua.NodeId) -> None:
        item = ua.AddNodesItem()
        item.RequestedNewNodeId = node_id(path)
        item.BrowseName = _name(name, NAMESPACE)
        item.ParentNodeId = parent
        item.ReferenceTypeId = standard(reference)
        item.TypeDefinition = kind
        self.items.append(item)


def _extension(value: Any) -> ua.Variant:
    return ua.Variant(value, ua.VariantType.ExtensionObject)


_STANDARD_NAMES = frozenset({"InputArguments", "EngineeringUnits", "EURange"})


def _title(name: str) -> str:
    """``status_code`` is StatusCode."""
    return "".join(word[:1].upper() + word[1:] for word in name.split("_"))


@cache
def _text(text: str) -> ua.LocalizedText:
    return ua.LocalizedText(text)


@cache
def _name(name: str, namespace: int) -> ua.QualifiedName:
    return ua.QualifiedName(name, namespace)


def _attributes(kind: Any, name: str, meaning: str, **others: object) -> Any:
    """Those that are given; every one that a node has takes time and memory."""
    given = {"DisplayName": _text(name), **others}
    if meaning:
        given["Description"] = _text(meaning)
    return kind(**given, SpecifiedAttributes=sum(ua.NodeAttributesMask[attribute].value for attribute in given))


def _variable(
    name: str, meaning: str, value: ua.Variant, *, data_type: int | None = None, rank: int = -1, access: int = 1
) -> Any:
    kind = standard(value.VariantType.value if data_type is None else data_type)
    return _attributes(
        ua.VariableAttributes,
        name,
        meaning,
        Value=value,
        DataType=kind,
        ValueRank=rank,
        AccessLevel=access,
        UserAccessLevel=access,
    )


def _argument(one: MethodArgument) -> ua.Argument:
    found: Any = ua.Argument()
    found.Name = one.name
    found.DataType = standard(VARIANTS[one.type].value)
    found.ValueRank = -1
    found.Description = ua.LocalizedText(one.meaning)
    return found
