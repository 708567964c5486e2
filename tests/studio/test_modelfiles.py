"""Models of bodies: what a page is not sent, by their headers."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from tests.support.models import glb, png, stl

from steptwin.errors import Misuse
from steptwin.live.studio.models import FolderModels
from steptwin.studio.modelfiles import check_model

JPEG = b"\xff\xd8\xff\xe0\x00\x04\0\0\xff\xc0\x00\x0b\x08\x00\x10\x0f\xa0\x01\x01\x11\x00"
"""The beginning of one of 4000 x 16 pixels."""


def test_what_fits_is_sent() -> None:
    check_model("a.STL", stl(3))
    check_model("a.glb", glb())
    check_model("a.glb", glb(200_000, png(2048, 1)))


@pytest.mark.parametrize(
    ("name", "data", "problem"),
    [
        ("a.stl", stl(200_001), "a.stl: a model has at most 10000000 bytes, not 10000134"),
        ("a.stl", b"solid cube\n" + b" " * 100, "a text STL is to be saved as binary"),
        ("a.stl", stl(2)[:-1], "183 bytes are not those of 2 triangles"),
        ("a.stl", b"", "it is too short"),
        ("a.glb", b"", "it is too short"),
        ("a.glb", stl(3), "it does not begin as one"),
        ("a.glb", glb()[:-4], "it does not begin as one"),
        ("a.glb", glb(200_001), "a model has at most 200000 triangles, not 200001"),
        ("a.glb", glb(100_001, nodes=[{"mesh": 0}, {"mesh": 0}]), "not 200002"),
        ("a.glb", glb(image=png(1, 2049)), "an image of 1 x 2049 pixels; permitted are 2048 along each side"),
        ("a.glb", glb(image=JPEG), "an image of 4000 x 16 pixels"),
        ("a.glb", glb(image=b"GIF89a"), "ValueError in its scene"),
        ("a.glb", glb(meshes=[{"primitives": [{"attributes": {"POSITION": 7}}]}]), "IndexError in its scene"),
        ("a.glb", glb(nodes=3), "TypeError in its scene"),
        ("a.glb", glb(buffers=[{"uri": "https://example.org/a.bin", "byteLength": 1}]), "refers to https://example.org/a.bin"),
        ("a.glb", glb(images=[{"uri": "wood.png"}]), "refers to wood.png"),
        ("a.glb", glb(extensionsRequired=["KHR_draco_mesh_compression"]), "needs KHR_draco_mesh_compression"),
    ],
)
def test_what_does_not_fit_is_refused(name: str, data: bytes, problem: str) -> None:
    with pytest.raises(Misuse) as error:
        check_model(name, data)
    assert problem in str(error.value)


def test_only_models_of_bodies_beside_their_description_are_read(tmp_path: Path) -> None:
    folder = tmp_path / "machine"
    (folder / "parts").mkdir(parents=True)
    (folder / "parts" / "a.stl").write_bytes(stl(1))
    (folder / "b.stl").write_bytes(stl(1))
    (tmp_path / "c.stl").write_bytes(stl(1))
    (folder / "link.stl").symlink_to(tmp_path / "c.stl")
    models = FolderModels(folder, ["parts/a.stl", "../c.stl", "link.stl", "d.stl"])

    def read(name: str) -> str:
        return asyncio.run(models.file(name))

    assert read("parts/a.stl") == str(folder / "parts" / "a.stl")
    with pytest.raises(Misuse, match=r"no body has the model 'b\.stl'"):
        read("b.stl")
    for name in ("../c.stl", "link.stl"):
        with pytest.raises(Misuse, match="a model lies in the folder of the description"):
            read(name)
    with pytest.raises(Misuse, match=r"cannot read d\.stl: "):
        read("d.stl")
