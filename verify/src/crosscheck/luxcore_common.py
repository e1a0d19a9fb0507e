import os
import sys
import time

try:
    import numpy as np
    import pyluxcore
except ImportError as error:
    print(f"{error}\nLuxCoreRender is the package 'pyluxcore' of PyPI: pip install pyluxcore numpy")
    sys.exit(77)

pyluxcore.Init()
FOLDER = os.path.dirname(os.path.abspath(__file__))
UNIT = 0.01  # Scene units per millimetre: numbers near 1 keep single precision accurate.


def numbers(name, kind):
    """A file of little-endian triples, as a list of tuples."""
    return [tuple(row) for row in np.fromfile(os.path.join(FOLDER, name), kind).reshape(-1, 3).tolist()]


def properties(values):
    made = pyluxcore.Properties()
    for key, value in values.items():
        made.Set(pyluxcore.Property(key, value))
    return made


def rectangle(scene, name, material, x0, y0, x1, y1, z):
    """A rectangle that faces -z, against the light."""
    corners = [(UNIT * x, UNIT * y, UNIT * z) for x, y in ((x0, y0), (x0, y1), (x1, y1), (x1, y0))]
    scene.DefineMesh(name, corners, [(0, 1, 2), (0, 2, 3)], None, None, None, None)
    scene.Parse(properties({f"scene.objects.{name}.ply": name, f"scene.objects.{name}.shape": name, f"scene.objects.{name}.material": material}))


def block(scene):
    """The block with its normals; corners of flat faces have vertices of their own."""
    positions = [(UNIT * x, UNIT * y, UNIT * z) for x, y, z in numbers("positions.f32", "<f4")]
    scene.DefineMesh("block", positions, numbers("triangles.u32", "<u4"), numbers("normals.f32", "<f4"), None, None, None)
    scene.Parse(properties({
        "scene.materials.glass.type": "glass",
        "scene.materials.glass.interiorior": INDEX,
        "scene.materials.glass.exteriorior": 1.0,
        "scene.materials.glass.kt": [1.0, 1.0, 1.0],
        "scene.materials.glass.kr": [1.0, 1.0, 1.0],
        "scene.objects.block.shape": "block",
        "scene.objects.block.material": "glass",
    }))


def camera(x0, y0, x1, y1, z):
    """An orthographic camera that looks along +z at this rectangle, one row lower: light tracing paints a row too low."""
    middle = [UNIT * (x0 + x1) / 2, UNIT * (y0 + y1) / 2]
    half = UNIT * (x1 - x0) / 2, UNIT * (y1 - y0) / 2
    row = UNIT * (y1 - y0) / PIXELS[1]
    return {
        "scene.camera.type": "orthographic",
        "scene.camera.lookat.orig": [*middle, UNIT * z],
        "scene.camera.lookat.target": [*middle, UNIT * z + 1],
        "scene.camera.up": [0.0, 1.0, 0.0],
        "scene.camera.screenwindow": [-half[0], half[0], -half[1] - row, half[1] - row],
        "scene.camera.clipping.hither": 1e-4,
        "scene.camera.clipping.yon": 1e4,
        "scene.camera.autovolume.enable": 0,
    }


def render(scene, settings, name):
    """Renders until its halt condition, and writes the linear picture, top row first."""
    columns, rows = PIXELS
    config = pyluxcore.RenderConfig(
        properties({
            "film.width": columns,
            "film.height": rows,
            "film.filter.type": "NONE",
            "film.outputs.0.type": "RGB",
            "film.outputs.0.filename": os.path.join(FOLDER, name),
            **settings,
        }),
        scene,
    )
    session = pyluxcore.RenderSession(config)
    session.Start()
    while not session.HasDone():
        time.sleep(0.1)
        session.UpdateStats()
    session.Stop()
    session.GetFilm().SaveOutput(os.path.join(FOLDER, name), pyluxcore.FilmOutputType.RGB, pyluxcore.Properties())
