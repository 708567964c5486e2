"""Models of bodies for the eye: what is refused before a page is sent one. Everything is read from headers."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping
from typing import Any, Protocol

from steptwin.errors import Misuse
from steptwin.messages import Message

LARGEST = 10_000_000
"""Bytes."""
MOST_TRIANGLES = 200_000
LARGEST_IMAGE = 2048
"""Pixels along each side."""
PACKED = frozenset(
    {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression", "KHR_texture_basisu", "EXT_texture_webp"}
)
"""Extensions of glTF for which the page has no decoder."""
_STL_HEAD, _STL_TRIANGLE = 84, 50
_GLB_HEAD = struct.Struct("<4sIIII")
_JSON_CHUNK = 0x4E4F534A
_TRIANGLES, _STRIP, _FAN = 4, 5, 6

MODEL_TOO_LARGE = Message("studio.model-too-large", "{name}: a model has at most {most} bytes, not {size}")
NO_MODEL = Message("studio.no-model", "{name}: expected a binary STL (.stl) or glTF 2.0 (.glb): {why}")
TOO_MANY_TRIANGLES = Message("studio.too-many-triangles", "{name}: a model has at most {most} triangles, not {count}")
IMAGE_TOO_LARGE = Message(
    "studio.image-too-large", "{name}: an image of {width} x {height} pixels; permitted are {most} along each side"
)
PACKED_MODEL = Message("studio.packed-model", "{name}: needs {extension}, which the page cannot unpack: export it without")
EXTERNAL_PART = Message("studio.external-part", "{name}: refers to {address}: a model has all its parts in its file")


class ModelFiles(Protocol):
    """Files of models that a description names."""

    async def file(self, name: str) -> str:
        """The path of one that a page may be sent. Raises `Misuse`."""
        ...


def check_model(name: str, data: bytes) -> None:
    """Raises `Misuse` for a model that a page is not sent."""
    if len(data) > LARGEST:
        raise Misuse(MODEL_TOO_LARGE(name=name, most=LARGEST, size=len(data)))
    count = _stl(name, data) if name.lower().endswith(".stl") else _glb(name, data)
    if count > MOST_TRIANGLES:
        raise Misuse(TOO_MANY_TRIANGLES(name=name, most=MOST_TRIANGLES, count=count))


def _stl(name: str, data: bytes) -> int:
    """Its triangles. The text form, which begins with ``solid``, has no count."""
    if len(data) < _STL_HEAD:
        raise Misuse(NO_MODEL(name=name, why="it is too short"))
    (count,) = struct.unpack_from("<I", data, _STL_HEAD - 4)
    if len(data) != _STL_HEAD + count * _STL_TRIANGLE:
        raise Misuse(
            NO_MODEL(name=name, why=f"{len(data)} bytes are not those of {count} triangles; a text STL is to be saved as binary")
        )
    return int(count)


def _glb(name: str, data: bytes) -> int:
    """Its triangles, each as often as it is shown."""
    if len(data) < _GLB_HEAD.size:
        raise Misuse(NO_MODEL(name=name, why="it is too short"))
    magic, version, length, size, kind = _GLB_HEAD.unpack_from(data)
    if magic != b"glTF" or version != 2 or length != len(data) or kind != _JSON_CHUNK:
        raise Misuse(NO_MODEL(name=name, why="it does not begin as one"))
    end = _GLB_HEAD.size + size
    try:
        scene = json.loads(data[_GLB_HEAD.size : end])
        for extension in (*scene.get("extensionsUsed", ()), *scene.get("extensionsRequired", ())):
            if extension in PACKED:
                raise Misuse(PACKED_MODEL(name=name, extension=extension))
        for part in (*scene.get("buffers", ()), *scene.get("images", ())):
            if "uri" in part:
                raise Misuse(EXTERNAL_PART(name=name, address=str(part["uri"])[:60]))
        for width, height in _images(scene, data[end + 8 :]):
            if max(width, height) > LARGEST_IMAGE:
                raise Misuse(IMAGE_TOO_LARGE(name=name, width=width, height=height, most=LARGEST_IMAGE))
        counts = [sum(_count(scene, one) for one in mesh["primitives"]) for mesh in scene.get("meshes", ())]
        return sum(counts[node["mesh"]] for node in scene.get("nodes", ()) if "mesh" in node)
    except Misuse:
        raise
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError, struct.error) as error:
        raise Misuse(NO_MODEL(name=name, why=f"{type(error).__name__} in its scene")) from None


def _count(scene: Mapping[str, Any], primitive: Mapping[str, Any]) -> int:
    accessor = primitive["indices"] if "indices" in primitive else primitive["attributes"]["POSITION"]
    count = int(scene["accessors"][accessor]["count"])
    mode = primitive.get("mode", _TRIANGLES)
    return count // 3 if mode == _TRIANGLES else max(0, count - 2) if mode in (_STRIP, _FAN) else count


def _images(scene: Mapping[str, Any], parts: bytes) -> Iterator[tuple[int, int]]:
    """Their sizes in pixels."""
    for image in scene.get("images", ()):
        view = scene["bufferViews"][image["bufferView"]]
        begin = int(view.get("byteOffset", 0))
        data = parts[begin : begin + int(view["byteLength"])]
        yield struct.unpack_from(">II", data, 16) if data.startswith(b"\x89PNG") else _jpeg(data)


def _jpeg(data: bytes) -> tuple[int, int]:
    """Raises `struct.error` and `ValueError` for anything else."""
    at = 2
    while data.startswith(b"\xff\xd8"):
        marker, length = struct.unpack_from(">HH", data, at)
        if 0xFFC0 <= marker <= 0xFFCF and marker not in (0xFFC4, 0xFFC8, 0xFFCC):
            height, width = struct.unpack_from(">HH", data, at + 5)
            return width, height
        at += 2 + length
    raise ValueError("neither PNG nor JPEG")
