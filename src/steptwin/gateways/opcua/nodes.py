"""Puts nodes into the address space of the server.

The service AddNodes of the library looks at 24 attributes of each node and at all children of its parent: two thirds of the time
of a start.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from typing import Any

from asyncua import ua
from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData

from steptwin.gateways.opcua.addressspace import NodeReference
from steptwin.gateways.opcua.nodetypes import standard

_TYPES: Mapping[str, ua.VariantType | None] = {
    "AccessLevel": ua.VariantType.Byte,
    "DataType": ua.VariantType.NodeId,
    "Description": ua.VariantType.LocalizedText,
    "DisplayName": ua.VariantType.LocalizedText,
    "EventNotifier": ua.VariantType.Byte,
    "Executable": ua.VariantType.Boolean,
    "IsAbstract": ua.VariantType.Boolean,
    "UserAccessLevel": ua.VariantType.Byte,
    "UserExecutable": ua.VariantType.Boolean,
    "UserWriteMask": ua.VariantType.UInt32,
    "Value": None,
    "ValueRank": ua.VariantType.Int32,
    "WriteMask": ua.VariantType.UInt32,
}
"""The attributes that nodes of machines have, and their types; a value brings its own."""


@cache
def _given(specified: int) -> Sequence[tuple[str, ua.AttributeIds, ua.VariantType | None]]:
    """The attributes of a mask."""
    return [(name, ua.AttributeIds[name], kind) for name, kind in _TYPES.items() if specified & ua.NodeAttributesMask[name].value]


class NodeMaker:
    """Makes nodes of ``space`` as its service AddNodes would."""

    def __init__(self, space: AddressSpace) -> None:
        self._space = space
        self._to: dict[tuple[ua.NodeId, ua.NodeId, bool], Any] = {}
        """References to parents and types, which nodes share."""
        self._alike: dict[tuple[int, int], tuple[ua.AddNodesItem, Mapping[ua.AttributeIds, AttributeValue]]] = {}
        """By the objects of which they were made, which the item keeps."""

    def add(self, items: Iterable[ua.AddNodesItem]) -> None:
        """Each after its parent."""
        for item in items:
            self._add(item)

    def refer(self, references: Iterable[NodeReference]) -> None:
        """Give nodes that are there references to others."""
        for source, kind, target in references:
            self._space[source].references.append(self._reference(kind, target, is_forward=True))

    def _add(self, item: ua.AddNodesItem) -> None:
        space, node = self._space, item.RequestedNewNodeId
        if node in space:
            raise AssertionError(f"{node} is there already")
        parent = space[item.ParentNodeId]
        made = NodeData(node)
        given: Any = item.NodeAttributes
        attributes = made.attributes
        attributes[ua.AttributeIds.NodeId] = _value(node, ua.VariantType.NodeId)
        attributes.update(self._shared(item))
        if isinstance(given, ua.VariableAttributes):
            attributes[ua.AttributeIds.Value] = _value(given.Value, None)
        space[node] = made
        child = ua.ReferenceDescription()
        child.ReferenceTypeId = item.ReferenceTypeId
        child.NodeId = node
        child.NodeClass = item.NodeClass
        child.BrowseName = item.BrowseName
        child.DisplayName = given.DisplayName
        child.TypeDefinition = item.TypeDefinition
        child.IsForward = True
        parent.references.append(child)
        made.references.append(self._reference(item.ReferenceTypeId, item.ParentNodeId, is_forward=False))
        if not item.TypeDefinition.is_null():
            made.references.append(self._reference(_TYPE_DEFINITION, item.TypeDefinition, is_forward=True))

    def _shared(self, item: ua.AddNodesItem) -> Mapping[ua.AttributeIds, AttributeValue]:
        """The attributes of a node but its id and value: nobody writes them, so nodes that are alike have the same ones."""
        given: Any = item.NodeAttributes
        known = self._alike.get((id(given), id(item.BrowseName)))
        if known is not None:
            return known[1]
        found = {
            ua.AttributeIds.BrowseName: _value(item.BrowseName, ua.VariantType.QualifiedName),
            ua.AttributeIds.NodeClass: _value(item.NodeClass, ua.VariantType.Int32),
        }
        for name, attribute, kind in _given(given.SpecifiedAttributes):
            if attribute is not ua.AttributeIds.Value:
                found[attribute] = _value(getattr(given, name), kind)
        self._alike[id(given), id(item.BrowseName)] = item, found
        return found

    def _reference(self, kind: ua.NodeId, target: ua.NodeId, *, is_forward: bool) -> Any:
        key = kind, target, is_forward
        found = self._to.get(key)
        if found is None:
            found = self._to[key] = ua.ReferenceDescription()
            there = self._space[target]
            found.ReferenceTypeId = kind
            found.IsForward = is_forward
            found.NodeId = target
            found.NodeClass = _of(there, ua.AttributeIds.NodeClass)
            found.BrowseName = _of(there, ua.AttributeIds.BrowseName)
            found.DisplayName = _of(there, ua.AttributeIds.DisplayName)
            if found.NodeClass in (ua.NodeClass.Object, ua.NodeClass.Variable):
                types = (one for one in there.references if one.IsForward and one.ReferenceTypeId == _TYPE_DEFINITION)
                found.TypeDefinition = next((one.NodeId for one in types), found.TypeDefinition)
        return found


_TYPE_DEFINITION = standard(ua.ObjectIds.HasTypeDefinition)


def _value(value: Any, kind: ua.VariantType | None) -> AttributeValue:
    """A variable begins with a moment of its own, as with the service."""
    if kind is None:
        now: Any = datetime.now(UTC)
        return AttributeValue(ua.DataValue(value, SourceTimestamp=now))
    return AttributeValue(ua.DataValue(ua.Variant(value, kind)))


def _of(node: NodeData, attribute: ua.AttributeIds) -> Any:
    found: Any = node.attributes[attribute].value
    return found.Value.Value
