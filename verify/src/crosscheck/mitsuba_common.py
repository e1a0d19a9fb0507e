import os
import sys

try:
    import mitsuba as mi
    import numpy as np
except ImportError as error:
    print(f"{error}\nMitsuba is the package 'mitsuba' of PyPI: pip install mitsuba numpy")
    sys.exit(77)

mi.set_variant("scalar_rgb")
FOLDER = os.path.dirname(os.path.abspath(__file__))
UNIT = 0.01  # Scene units per millimetre: numbers near 1 keep single precision accurate.


def numbers(name, kind):
    """A file of little-endian triples."""
    return np.fromfile(os.path.join(FOLDER, name), kind).reshape(-1, 3)


def block(bsdf=None):
    """The block with its normals; corners of flat faces have vertices of their own."""
    positions, normals, triangles = numbers("positions.f32", "<f4"), numbers("normals.f32", "<f4"), numbers("triangles.u32", "<u4")
    glass = mi.Properties()
    glass["bsdf"] = mi.load_dict(bsdf or {"type": "dielectric", "int_ior": INDEX, "ext_ior": 1.0})
    mesh = mi.Mesh("block", len(positions), len(triangles), has_vertex_normals=True, props=glass)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = (UNIT * positions).ravel()
    parameters["vertex_normals"] = normals.ravel()
    parameters["faces"] = triangles.ravel()
    parameters.update()
    return mesh


def rectangle(x0, y0, x1, y1, z, **more):
    """A rectangle that faces -z, against the light."""
    middle = mi.ScalarTransform4f().translate([UNIT * (x0 + x1) / 2, UNIT * (y0 + y1) / 2, UNIT * z])
    shape = middle.rotate([1, 0, 0], 180).scale([UNIT * (x1 - x0) / 2, UNIT * (y1 - y0) / 2, 1])
    return {"type": "rectangle", "to_world": shape, **more}
