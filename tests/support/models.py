"""Files of models, as small as they can be."""

from __future__ import annotations

import json
import struct
import zlib
from typing import Any

GREEN = (30, 160, 90)


def stl(triangles: int) -> bytes:
    return bytes(80) + struct.pack("<I", triangles) + bytes(50) * triangles


def png(width: int, height: int) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    rows = zlib.compress((b"\0" + bytes(GREEN) * width) * height)
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def glb(triangles: int = 1, image: bytes = b"", **more: Any) -> bytes:
    """A triangle of 200 mm, upright in x and y, which is said to be several, with an image if there is one."""
    corners = struct.pack("<9f", 0, 0, 0, 0.2, 0, 0, 0, 0.2, 0)
    scene: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "materials": [{"doubleSided": True}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 3 * triangles,
                "type": "VEC3",
                "min": [0, 0, 0],
                "max": [0.2, 0.2, 0],
            },
            {"bufferView": 1, "componentType": 5126, "count": 3 * triangles, "type": "VEC2"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 24}],
        "buffers": [{"byteLength": 60 + len(image)}],
    }
    if image:
        scene["bufferViews"].append({"buffer": 0, "byteOffset": 60, "byteLength": len(image)})
        scene["images"] = [{"bufferView": 2, "mimeType": "image/png"}]
        scene["textures"] = [{"source": 0}]
        scene["materials"][0]["pbrMetallicRoughness"] = {"baseColorTexture": {"index": 0}, "metallicFactor": 0}
    text = json.dumps({**scene, **more}).encode()
    text += b" " * (-len(text) % 4)
    parts = corners + struct.pack("<6f", 0, 0, 1, 0, 0, 1) + image
    parts += bytes(-len(parts) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(parts), 0x004E4942) + parts
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
