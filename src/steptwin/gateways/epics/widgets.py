"""Widgets of displays for Phoebus (``.bob``), with the names and properties of its Display Builder (app/display/model)."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree

VERSIONS = {
    "action_button": "3.0.0",
    "bool_button": "2.0.0",
    "combo": "2.0.0",
    "group": "3.0.0",
    "label": "2.0.0",
    "led": "2.0.0",
    "textentry": "3.0.0",
    "textupdate": "2.0.0",
}
"""The types of widgets that are used, with the version that their properties have."""
RED, GREEN, GREY = (220, 60, 60), (60, 200, 60), (150, 150, 150)
PUSH = 1
"""Of a ``bool_button``: 1 while it is pressed."""


class BobElement:
    """A display or a group: widgets are put into it at places in pixels."""

    def __init__(self, node: ElementTree.Element) -> None:
        self.node = node

    def widget(
        self, kind: str, name: str, place: tuple[int, int, int, int], properties: Mapping[str, object] | None = None
    ) -> BobElement:
        """``place``: x, y, width, height. A property is a text, a number, a truth, or a colour of red, green and blue."""
        node = ElementTree.SubElement(self.node, "widget", type=kind, version=VERSIONS[kind])
        _add(node, "name", name)
        for key, number in zip(("x", "y", "width", "height"), place, strict=True):
            _add(node, key, number)
        for key, value in (properties or {}).items():
            _add(node, key, value)
        return BobElement(node)

    def label(self, text: str, place: tuple[int, int, int, int], *, size: float | None = None) -> None:
        node = self.widget("label", text, place, {"text": text, "vertical_alignment": 1}).node
        if size is not None:
            font = ElementTree.SubElement(ElementTree.SubElement(node, "font"), "font")
            font.attrib |= {"family": "Liberation Sans", "style": "BOLD", "size": f"{size:.1f}"}

    def value(self, pv: str, place: tuple[int, int, int, int], *, is_entry: bool = False) -> None:
        """Shows a value, and with ``is_entry`` takes one."""
        self.widget("textentry" if is_entry else "textupdate", pv, place, {"pv_name": pv, "vertical_alignment": 1})

    def led(self, pv: str, place: tuple[int, int, int, int], *, colour: tuple[int, int, int] = GREEN) -> None:
        self.widget("led", pv, place, {"pv_name": pv, "off_color": GREY, "on_color": colour})

    def switch(self, pv: str, text: str, place: tuple[int, int, int, int], *, is_held: bool = False) -> None:
        """Toggles a value between 0 and 1; one that ``is_held`` is 1 while it is pressed."""
        labels = {"on_label": text, "off_label": text, "show_led": not is_held}
        self.widget("bool_button", pv, place, {"pv_name": pv, **labels, **({"mode": PUSH} if is_held else {})})

    def button(self, text: str, pv: str, place: tuple[int, int, int, int], *, is_stop: bool = False) -> None:
        """Puts 1."""
        node = self.widget("action_button", f"{text} {pv}", place, {"text": text, "pv_name": pv}).node
        if is_stop:
            _add(node, "background_color", RED)
        self._action(node, "write_pv", {"description": text, "pv_name": pv, "value": "1"})

    def opening(self, text: str, file: str, place: tuple[int, int, int, int]) -> None:
        """Opens another display."""
        node = self.widget("action_button", file, place, {"text": text}).node
        self._action(node, "open_display", {"description": text, "file": file, "target": "tab"})

    @staticmethod
    def _action(node: ElementTree.Element, kind: str, properties: Mapping[str, str]) -> None:
        action = ElementTree.SubElement(ElementTree.SubElement(node, "actions"), "action", type=kind)
        for key, value in properties.items():
            _add(action, key, value)


def _add(node: ElementTree.Element, key: str, value: object) -> None:
    child = ElementTree.SubElement(node, key)
    if isinstance(value, tuple):
        ElementTree.SubElement(
            child, "color", {name: str(part) for name, part in zip(("red", "green", "blue"), value, strict=True)}
        )
    else:
        child.text = str(value).lower() if isinstance(value, bool) else str(value)


class BobDisplay(BobElement):
    """A display that is called ``name``, with its title."""

    def __init__(self, name: str) -> None:
        super().__init__(ElementTree.Element("display", version="2.0.0"))
        _add(self.node, "name", name)
        self.label(name, (10, 10, 600, 30), size=22.0)

    def text(self, width: int, height: int) -> str:
        """As a file."""
        for position, (key, number) in enumerate((("width", width), ("height", height)), 1):
            size = ElementTree.Element(key)
            size.text = str(number)
            self.node.insert(position, size)
        ElementTree.indent(self.node)
        return ElementTree.tostring(self.node, encoding="unicode", xml_declaration=True) + "\n"
