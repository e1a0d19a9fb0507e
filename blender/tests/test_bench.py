"""The add-on's bench and normals are those of the scenes in which other renderers are compared with the verifier."""

import glasswarp as gw
import numpy as np
import pytest

from caustic_block.bench import FAR_MM, Bench, angle_of
from caustic_block.solid import exported

BENCHES = {
    "straight": {},
    "from the top": {"tilt_deg": (15, 0)},
    "from the right": {"tilt_deg": (20, 90), "window_mm": 120, "shift_mm": (10, -5)},
    "a lamp": {"light": "point", "source_distance_mm": 200},
    "a lamp aside": {"light": "point", "source_distance_mm": 300, "tilt_deg": (10, 200)},
}


def told(file):
    """The numbers at the head of a scene."""
    found = {}
    for line in file.read_text().splitlines():
        name, equals, value = line.partition(" = ")
        if equals and name.isupper():
            found[name] = eval(value)
        elif line.startswith("import "):
            return found
    raise AssertionError(f"no numbers in {file}")


@pytest.mark.parametrize("bench", BENCHES)
def test_light_block_and_receiver_stand_where_the_crosscheck_has_them(bench, picture, tmp_path):
    block = gw.design(picture, nodes=65, offset=0.3, source_size="none", **BENCHES[bench])
    block.save(tmp_path / "block.stl")
    gw.crosscheck(tmp_path / "block.stl", with_="blender", mode="image", write_only=True, scene=tmp_path / "scene")
    truth = told(tmp_path / "scene" / "image.py")
    solid, side = exported(block)
    mine = Bench.from_text(Bench.of(side, solid, "none", block.target.max()).to_text())
    assert mine.index == truth["INDEX"] and mine.distance == truth["DISTANCE"]
    close = {"rtol": 1e-6, "atol": 1e-4}
    assert np.allclose(mine.lower[2], truth["ENTRY_Z"], **close) and np.allclose(mine.upper[2], truth["TOP_Z"], **close)
    assert np.allclose(mine.window, [truth["WINDOW_FROM"], truth["WINDOW_TO"]], **close)
    assert np.allclose(mine.hole, [truth["HOLE_FROM"], truth["HOLE_TO"]], **close)
    assert np.allclose(mine.reach, truth["REACH"], **close)
    if truth["AT_SOURCE"]:
        assert np.allclose(mine.lamp, truth["LIGHT_SOURCE"], **close)
    else:
        assert np.allclose((mine.entry - mine.lamp) / FAR_MM, truth["LIGHT_DIRECTION"], rtol=0, atol=1e-9)
    # Normals: the verifier's, of the spline through the vertices in single precision.
    positions, normals = (
        np.frombuffer((tmp_path / "scene" / name).read_bytes(), "<f4").reshape(-1, 3)
        for name in ("positions.f32", "normals.f32")
    )
    up = normals[:, 2] > 0.5
    order = np.lexsort(np.round(positions[up][:, :2], 3).T)
    nx, ny = block.size.nodes
    face = slice(0, up.sum())
    mine_order = np.lexsort(np.round(solid.vertices[face][:, :2], 3).T)
    assert up.sum() >= nx * ny
    assert np.abs(solid.vertices[face][mine_order] - positions[up][order]).max() < 1e-4
    assert np.abs(solid.normals[face][mine_order] - normals[up][order]).max() < 2e-6


def test_every_face_has_vertices_and_unit_normals_of_its_own(picture):
    solid, _ = exported(gw.design(picture, nodes=65, source_size="none"))
    assert np.abs(np.linalg.norm(solid.normals, axis=1) - 1).max() < 1e-6
    a, b, c = (solid.vertices[solid.triangles[:, k]] for k in range(3))
    flat = np.cross(b - a, c - a)
    flat /= np.linalg.norm(flat, axis=1)[:, None]
    # Triangles face as their normals do.
    assert (np.einsum("ij,ikj->ik", flat, solid.normals[solid.triangles]) > 0.8).all()


@pytest.mark.parametrize(
    "size, distance, degrees",
    [("", None, 0), ("none", 500, 0), ("sun", None, 0.53), ("0.5deg", None, 0.5), ("5mm", 500, 0.5729530)],
)
def test_sizes_of_light_are_angles(size, distance, degrees):
    assert np.degrees(angle_of(size, distance)) == pytest.approx(degrees)


@pytest.mark.parametrize("size, distance", [("5x3mm", 500), ("5mm", None), ("large", 500)])
def test_light_that_is_not_round_is_refused_by_name(size, distance):
    with pytest.raises(ValueError, match=size):
        angle_of(size, distance)


def test_defaults_of_the_panel_are_those_of_glasswarp():
    # Those that the add-on hands over unasked; `inside/work.py` compares the block that they make.
    bench = gw.Bench()
    assert (bench.size_mm, bench.distance_mm, bench.ior) == (100, 250, gw.Bench(material="pmma").ior)
