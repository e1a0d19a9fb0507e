# Particle tracing: a beam that fills the block, its caustic on a white receiver, seen by a pinhole between block and receiver.
run = int(sys.argv[-1]) if sys.argv[-1].isdigit() else 1
(x0, y0), (x1, y1) = WINDOW_FROM, WINDOW_TO
columns, rows = PIXELS
eye_z = (TOP_Z + DISTANCE) / 2
centre = [UNIT * (x0 + x1) / 2, UNIT * (y0 + y1) / 2]
look = mi.ScalarTransform4f().look_at(
    origin=[*centre, UNIT * eye_z], target=[*centre, UNIT * DISTANCE], up=[0, 1, 0]
)
emitter = rectangle(*BLOCK_FROM, *BLOCK_TO, ENTRY_Z - 1)
emitter["to_world"] = emitter["to_world"].rotate([1, 0, 0], 180)  # Its light goes +z.
emitter["emitter"] = {"type": "directionalarea", "radiance": {"type": "rgb", "value": 1.0}}
scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "ptracer", "max_depth": 8, "hide_emitters": True},
    "block": block(),
    "light": emitter,
    "receiver": rectangle(x0 - REACH, y0 - REACH, x1 + REACH, y1 + REACH, DISTANCE, bsdf={"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.8}}),
    "sensor": {
        "type": "perspective",
        "fov_axis": "x",
        "fov": float(2 * np.degrees(np.arctan2((x1 - x0) / 2, DISTANCE - eye_z))),
        "near_clip": 1e-3,
        "far_clip": 100.0,
        "to_world": look,
        "film": {
            "type": "hdrfilm",
            "width": columns,
            "height": rows,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "independent", "sample_count": SAMPLES},
    },
})
picture = np.array(mi.render(scene, spp=SAMPLES, seed=run))[:, :, :3]
mi.Bitmap(np.ascontiguousarray(picture, np.float32), mi.Bitmap.PixelFormat.RGB).write(os.path.join(FOLDER, f"image-{run}.exr"))
