# Mitsuba's own intersections, normals and materials, followed from the light to the receiver, one ray for every pixel; red and
# green say where on it the ray lands, in the receiver's own coordinates, from LANDED_FROM to LANDED_TO, blue is 1 where it does.
scene = mi.load_dict({"type": "scene", "block": block({"type": "conductor"} if MIRROR else None)})
columns, rows = PIXELS
kind = mi.BSDFFlags.DeltaReflection if MIRROR else mi.BSDFFlags.DeltaTransmission
passing = mi.BSDFContext(mi.TransportMode.Importance, int(kind))
location, centre, looks = np.array(VIEW_LOCATION), np.array(VIEW_CENTRE), np.array(VIEW_LOOKS)
right, up = np.array(VIEW_RIGHT), np.array(VIEW_UP)
axes = np.array([RECEIVER_X, RECEIVER_Y, RECEIVER_Z])
picture = np.zeros((rows, columns, 3), np.float32)
landed_from, landed_to = np.array(LANDED_FROM), np.array(LANDED_TO)
for row in range(rows):
    for column in range(columns):
        aside = ((column + 0.5) / columns - 0.5) * right + (0.5 - (row + 0.5) / rows) * up
        if AT_SOURCE:
            towards = centre + aside - location
            begin, direction = location, towards / np.linalg.norm(towards)
        else:
            begin, direction = location + aside, looks
        ray = mi.Ray3f(mi.Point3f(UNIT * begin), mi.Vector3f(direction))
        faces = 0
        while faces < 8:
            found = scene.ray_intersect(ray)
            if not found.is_valid():
                break
            sample, weight = found.bsdf(ray).sample(passing, found, 0.5, mi.Point2f(0.5, 0.5))
            if max(weight) == 0:
                break
            ray = found.spawn_ray(found.to_world(sample.wo))
            faces += 1
        # In the receiver's own axes.
        origin = axes @ (np.array(ray.o, float) / UNIT - np.array([0, 0, DISTANCE]))
        direction = axes @ np.array(ray.d, float)
        if faces == (1 if MIRROR else 2) and direction[2] > 0:
            place = (origin - origin[2] / direction[2] * direction)[:2]
            share = (place - landed_from) / (landed_to - landed_from)
            if (share >= 0).all() and (share <= 1).all():
                picture[row, column] = share[0], share[1], 1
mi.Bitmap(picture, mi.Bitmap.PixelFormat.RGB).write(os.path.join(FOLDER, "map.exr"))
