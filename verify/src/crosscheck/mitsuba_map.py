# Mitsuba's own intersections, normals and dielectric, followed from the entry face to the receiver, one ray for every pixel;
# red and green say where on it the ray lands, from LANDED_FROM to LANDED_TO, blue is 1 where it does.
scene = mi.load_dict({"type": "scene", "block": block()})
columns, rows = PIXELS
transmitted = mi.BSDFContext(mi.TransportMode.Importance, int(mi.BSDFFlags.DeltaTransmission))
picture = np.zeros((rows, columns, 3), np.float32)
landed_from, landed_to = np.array(LANDED_FROM), np.array(LANDED_TO)
for row in range(rows):
    for column in range(columns):
        x = BLOCK_TO[0] - (column + 0.5) / columns * (BLOCK_TO[0] - BLOCK_FROM[0])
        y = BLOCK_TO[1] - (row + 0.5) / rows * (BLOCK_TO[1] - BLOCK_FROM[1])
        ray = mi.Ray3f(mi.Point3f(UNIT * x, UNIT * y, UNIT * (ENTRY_Z - 10)), mi.Vector3f(0, 0, 1))
        faces = 0
        while faces < 8:
            found = scene.ray_intersect(ray)
            if not found.is_valid():
                break
            sample, weight = found.bsdf(ray).sample(transmitted, found, 0.5, mi.Point2f(0.5, 0.5))
            if max(weight) == 0:
                break
            ray = found.spawn_ray(found.to_world(sample.wo))
            faces += 1
        origin, direction = np.array(ray.o), np.array(ray.d)
        if faces == 2 and direction[2] > 0:
            place = (origin + (UNIT * DISTANCE - origin[2]) / direction[2] * direction)[:2] / UNIT
            share = (place - landed_from) / (landed_to - landed_from)
            if (share >= 0).all() and (share <= 1).all():
                picture[row, column] = share[0], share[1], 1
mi.Bitmap(picture, mi.Bitmap.PixelFormat.RGB).write(os.path.join(FOLDER, "map.exr"))
