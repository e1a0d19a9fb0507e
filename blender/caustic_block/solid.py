"""The block as triangles with the normals of its smooth surface, and the numbers of its bench: what glasswarp's files say of them."""

import ast
import json
import os
import struct
import tempfile

import numpy as np


def exported(block):
    """Solid and bench of a block, from the GLB that glasswarp writes, where alone are the exact normals, and its side file."""
    with tempfile.TemporaryDirectory(prefix="caustic-block-") as folder:
        file = os.path.join(folder, "block.glb")
        block.save(file)
        with open(file, "rb") as glb, open(os.path.join(folder, "block.toml"), encoding="utf-8") as side:
            return Solid.read(glb.read()), read_bench(side.read())


def read_bench(side):
    """Numbers and lists of numbers of the bench in a side file. (Blender before 4.2 has no reader of TOML.)"""
    found = {}
    section = ""
    for line in side.splitlines():
        if line.startswith("["):
            section = line
        name, equals, rest = line.partition(" = ")
        value = rest.partition(" #")[0].strip()
        if section == "[bench]" and equals and not value.startswith(('"', "true", "false")):
            found[name] = ast.literal_eval(value)
    return found


class Solid:
    """Vertices, mm, in the frame of the bench (light along +z); unit normals of the smooth face and of the flat ones; triangles.

    Every face has vertices of its own, because normals differ along its border.
    """

    def __init__(self, vertices, normals, triangles):
        self.vertices = vertices
        self.normals = normals
        self.triangles = triangles

    @classmethod
    def read(cls, glb):
        """Reads one mesh of one primitive, as glasswarp writes it."""
        magic, version, _, length, kind = struct.unpack_from("<4sIII4s", glb)
        if (magic, version, kind) != (b"glTF", 2, b"JSON"):
            raise ValueError("this is no GLB")
        document = json.loads(glb[20 : 20 + length])
        body = 20 + length + 8
        ((primitive,),) = (mesh["primitives"] for mesh in document["meshes"])

        def array(accessor, kind, across):
            told = document["accessors"][accessor]
            start = body + document["bufferViews"][told["bufferView"]]["byteOffset"]
            return np.frombuffer(glb, kind, told["count"] * across, start)

        positions = array(primitive["attributes"]["POSITION"], "<f4", 3).reshape(-1, 3)
        normals = array(primitive["attributes"]["NORMAL"], "<f4", 3).reshape(-1, 3)
        triangles = array(primitive["indices"], "<u4", 1).reshape(-1, 3)
        return cls(1000 * _upright(positions), _upright(normals), triangles.astype(np.int32))

    @property
    def lower(self):
        return self.vertices.min(axis=0)

    @property
    def upper(self):
        return self.vertices.max(axis=0)


def _upright(vectors):
    """From glTF's frame, y up, to that of the bench."""
    return np.stack([vectors[:, 0], -vectors[:, 2], vectors[:, 1]], axis=1).astype(np.float64)
