# Light tracing: a wide parallel beam, cut to the block's outline by a black plate, and its caustic on a white receiver, seen
# by an orthographic camera between block and receiver.
run = int(sys.argv[-1]) if sys.argv[-1].isdigit() else 1
scene = pyluxcore.Scene()
block(scene)
(x0, y0), (x1, y1) = BLOCK_FROM, BLOCK_TO
middle = [UNIT * (x0 + x1) / 2, UNIT * (y0 + y1) / 2]
scene.Parse(properties({
    "scene.materials.white.type": "matte",
    "scene.materials.white.kd": [0.8, 0.8, 0.8],
    "scene.materials.black.type": "matte",
    "scene.materials.black.kd": [0.0, 0.0, 0.0],
    "scene.lights.beam.type": "laser",
    "scene.lights.beam.position": [*middle, UNIT * (ENTRY_Z - 20)],
    "scene.lights.beam.target": [*middle, UNIT * DISTANCE],
    "scene.lights.beam.radius": UNIT * 0.501 * float(np.hypot(x1 - x0, y1 - y0)),
    "scene.lights.beam.gain": [1.0, 1.0, 1.0],
    **camera(*WINDOW_FROM, *WINDOW_TO, (TOP_Z + DISTANCE) / 2),
}))
rectangle(scene, "receiver", "white", -2 * REACH, -2 * REACH, 2 * REACH, 2 * REACH, DISTANCE)
bars = [(-REACH, -REACH, x0, REACH), (x1, -REACH, REACH, REACH), (x0, -REACH, x1, y0), (x0, y1, x1, REACH)]
for number, bar in enumerate(bars):
    rectangle(scene, f"plate{number}", "black", *bar, ENTRY_Z - 1)
render(scene, {
    "renderengine.type": "LIGHTCPU",
    "renderengine.seed": run,
    "sampler.type": "RANDOM",
    "light.maxdepth": 6,
    "batch.haltspp": SAMPLES,
}, f"image-{run}.exr")
