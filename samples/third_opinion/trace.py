"""A third opinion on a block: traces its STL with nothing but numpy and what docs/side-file.md says.

    python3 trace.py block.stl [--image light.exr] [--rays 6] [--write light.png]

Reads block.toml beside the block and the picture that it names, follows light through the blocks before it and through the block, and
prints how far the light is from the picture (the relative RMS that `glasswarp verify block.stl` states) and, with --image, from the
image that `glasswarp verify block.stl -o light.exr` has written.

Between the vertices the face is a C2 bicubic spline: heights err with the fourth power of their spacing, slopes with the third.
Landing points and the light that goes there are linear between rays, which errs with the square of their spacing; where a later block
cuts light off, with the spacing itself.
Not followed: light that another part of a face keeps away, partial reflection, lamps with a size, rough faces.
"""

import argparse
import pathlib
import tomllib

import numpy as np

import files


class Block:
    """A block as docs/side-file.md describes it: its planar entry face, and the exit face through the vertices of the file."""

    def __init__(self, path, side, gap=0.0):
        self.side, self.frame = side, side["frame"]
        bench = side["bench"]
        self.mirror, self.ior, self.entry_z = bench["mirror"], bench["ior"], bench["entry-z-mm"]
        self.before_z = self.entry_z - gap  # the mean exit plane of the block before, in the frame of this one
        self.half = 0.5 * np.array([bench["width-mm"], bench["height-mm"]]) + bench["skirt-mm"]
        self.corner = np.array(bench["corner-radius-mm"])
        vertices = files.stl(path) + self.frame["origin-mm"]
        thickness = self.frame["stock-thickness-mm"]
        exit_side = vertices[:, 2] > self.entry_z + 1e-4 * thickness
        if "rim-z-mm" in self.frame:
            exit_side &= abs(vertices[:, 2] - self.frame["rim-z-mm"]) > 1e-4 * thickness
        face = vertices[exit_side]
        self.n = np.array(bench["nodes"])
        self.pitch = 2 * self.half / (self.n - 1)
        at = (face[:, :2] + self.half) / self.pitch
        node = np.rint(at).astype(int)
        on_grid = (abs(at - node) < 0.02).all(1) & (node >= 0).all(1) & (node < self.n).all(1)
        heights = np.full(self.n[::-1], np.nan)
        heights[node[on_grid, 1], node[on_grid, 0]] = face[on_grid, 2]
        if np.isnan(heights).any():
            if not self.corner.any():
                raise SystemExit(f"{path}: {np.isnan(heights).sum()} nodes of the exit face have no vertex")
            outline = np.concatenate([at[~on_grid], face[~on_grid, 2:]], 1)
            heights = beyond_the_outline(heights, outline)
        self.spline = Spline(heights)

    def lattice(self, across, up):
        """Points of the plan on rows that end on the outline: (up + 1) x (across + 1) x 2."""
        (half_x, half_y), (radius_x, radius_y) = self.half, self.corner
        if radius_y > 0:
            bends = np.linspace(0, np.pi / 2, max(2, int(1.5 * up * radius_y / half_y / 2)) + 1)
            cap = half_y - radius_y + radius_y * np.sin(bends)
            flat = np.linspace(-1, 1, max(1, round(up * (1 - radius_y / half_y))) + 1) * (half_y - radius_y)
            y = np.unique(np.concatenate([-cap, flat, cap]).round(12))
        else:
            y = np.linspace(-half_y, half_y, up + 1)
        x = np.linspace(-1, 1, across + 1) * self.half_width(y)[:, None]
        return np.stack([x, np.broadcast_to(y[:, None], x.shape)], 2)

    def half_width(self, y):
        (half_x, half_y), (radius_x, radius_y) = self.half, self.corner
        into = np.clip((abs(y) - (half_y - radius_y)) / radius_y, 0, 1) if radius_y > 0 else 0 * y
        return half_x - radius_x + radius_x * np.sqrt(1 - into**2)

    def surface(self, at):
        """Heights and slopes."""
        z, zx, zy = self.spline((at + self.half) / self.pitch)
        return z, np.stack([zx, zy], -1) / self.pitch

    def enter(self, direction):
        """Unit vectors behind the entry face."""
        across = direction[..., :2] / self.ior
        return np.concatenate([across, np.sqrt(1 - (across**2).sum(-1, keepdims=True))], -1)

    def leave(self, direction, slopes):
        """Unit vectors behind the exit face; not numbers where light is totally reflected."""
        normal = np.concatenate([-slopes, np.ones(slopes.shape[:-1] + (1,))], -1)
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        along = (direction * normal).sum(-1, keepdims=True)
        if self.mirror:
            return direction - 2 * along * normal
        across = self.ior * (direction - along * normal)
        with np.errstate(invalid="ignore"):
            return across + np.sqrt(1 - (across**2).sum(-1, keepdims=True)) * normal

    def through(self, point, direction):
        """Light from the block before: where it leaves this one, the unit vectors behind it, and whether it comes so far."""
        entry = point + direction * ((self.entry_z - point[..., 2:]) / direction[..., 2:])
        direction = self.enter(direction)
        point = entry
        for _ in range(10):  # Newton's method, on a face that goes on beyond its border with the slopes that it has there
            within = np.clip(point[..., :2], -self.half, self.half)
            z, slopes = self.surface(within)
            above = z + (slopes * (point[..., :2] - within)).sum(-1) - point[..., 2]
            climb = direction[..., 2] - (slopes * direction[..., :2]).sum(-1)
            point = point + direction * (above / climb)[..., None]
        return point, self.leave(direction, slopes), self.lets_in(point, entry)

    def lets_in(self, point, entry):
        """Whether a point lies on the exit face, and light comes to it by the entry face and under the rim."""
        reach = 0.5 * np.array([self.frame["stock-width-mm"], self.frame["stock-height-mm"]]) + 1e-9
        rim = self.frame.get("rim-width-mm", 0.0)
        inside = rounded(entry[..., :2], reach, self.corner + rim if self.corner.any() else self.corner)
        inside &= rounded(point[..., :2], self.half + 1e-9, self.corner)
        if not rim:
            return inside
        # Where the way back crosses the border of the exit face, it must be below the rim.
        step = entry - point
        share = np.zeros(point.shape[:-1])
        for k in range(1, 65):
            at = point + step * (k / 64)
            share = np.where(rounded(at[..., :2], self.half + 1e-9, self.corner), k / 64, share)
        crosses = share < 1
        below = (point + step * share[..., None])[..., 2] <= self.frame["rim-z-mm"] + 1e-9
        return inside & (~crosses | below)


def rounded(at, half, corner):
    """Whether points lie within a rectangle with elliptic corners."""
    out = np.maximum(abs(at) - (half - corner), 0)
    within = (abs(at) <= half).all(-1)
    if corner.any():
        within &= ((out / np.maximum(corner, 1e-12)) ** 2).sum(-1) <= 1 + 1e-9
    return within


def beyond_the_outline(heights, outline):
    """Heights at the nodes that the file leaves out: near the outline a cubic in x and y through what is known around each, by least
    squares; further away, where only the spline's last digits come from, those of the neighbours."""
    rows, columns = np.nonzero(~np.isnan(heights))
    known = np.concatenate([np.stack([columns, rows, heights[rows, columns]], 1), outline])
    filled = heights.copy()
    for j, i in zip(*np.nonzero(np.isnan(heights))):
        near = known[(abs(known[:, :2] - (i, j)) < 2 * REACH).all(1)]
        distance = np.hypot(*(near[:, :2] - (i, j)).T)
        if len(near) < 16 or distance.min() > REACH:
            continue
        near = near[distance < distance.min() + REACH]
        (x, y), z = (near[:, :2] - (i, j)).T, near[:, 2]
        weight = np.exp(-0.25 * (x**2 + y**2 - distance.min() ** 2) / WIDTH**2)
        powers = np.stack([x**a * y**b for a in range(4) for b in range(4 - a)], 1)
        filled[j, i] = np.linalg.lstsq(powers * weight[:, None], z * weight, rcond=None)[0][0]
    while np.isnan(filled).any():
        padded = np.pad(filled, 1, constant_values=np.nan)
        around = np.stack([padded[1:-1, :-2], padded[1:-1, 2:], padded[:-2, 1:-1], padded[2:, 1:-1]])
        count = (~np.isnan(around)).sum(0)
        mean = np.nansum(around, 0) / np.maximum(count, 1)
        filled = np.where(np.isnan(filled) & (count > 0), mean, filled)
    return filled


REACH = 4.5  # cells
WIDTH = 2.0  # standard deviation of the weights, cells


class Spline:
    """The C2 bicubic spline through values on a unit grid, not-a-knot at its ends, by values, slopes and twists at the nodes."""

    def __init__(self, values):
        slopes = lambda f: np.linalg.solve(*self.conditions(f))
        self.z = values
        self.zx = slopes(values.T).T
        self.zy = slopes(values)
        self.zxy = slopes(self.zy.T).T

    @staticmethod
    def conditions(f):
        """Equations for the slopes along the first axis."""
        n = len(f)
        matrix = np.zeros((n, n))
        right = np.zeros_like(f)
        inner = np.arange(1, n - 1)
        matrix[inner, inner - 1], matrix[inner, inner], matrix[inner, inner + 1] = 1, 4, 1
        right[inner] = 3 * (f[inner + 1] - f[inner - 1])
        # The third derivative is continuous at the second node from either end.
        matrix[0, :2] = 1, 2
        right[0] = (-5 * f[0] + 4 * f[1] + f[2]) / 2
        matrix[-1, -2:] = 2, 1
        right[-1] = (5 * f[-1] - 4 * f[-2] - f[-3]) / 2
        return matrix, right

    def __call__(self, at):
        n = np.array(self.z.shape[::-1])
        cell = np.clip(np.nan_to_num(at), 0, n - 2).astype(int)
        i, j = cell[..., 0], cell[..., 1]
        t = at - cell

        def hermite(t):
            """Weights of value and slope at both ends, and their derivatives."""
            s = 1 - t
            return (
                ((1 + 2 * t) * s * s, t * s * s, (3 - 2 * t) * t * t, -s * t * t),
                (-6 * t * s, s * (1 - 3 * t), 6 * t * s, t * (3 * t - 2)),
            )

        (x, dx), (y, dy) = hermite(t[..., 0]), hermite(t[..., 1])

        def row(j):
            """On a grid line: height and slope along y at this x, each with its derivative along x."""
            along = lambda f, fx, w: f[j, i] * w[0] + fx[j, i] * w[1] + f[j, i + 1] * w[2] + fx[j, i + 1] * w[3]
            return [along(f, fx, w) for w in (x, dx) for f, fx in ((self.z, self.zx), (self.zy, self.zxy))]

        below, above = row(j), row(j + 1)
        across = lambda k, w: below[k] * w[0] + below[k + 1] * w[1] + above[k] * w[2] + above[k + 1] * w[3]
        return across(0, y), across(2, y), across(0, dy)


class Light:
    """The light of the last block's bench in the frame of the first: which ray meets a point of its face, and how much light it brings
    to a unit of the face's plan."""

    def __init__(self, row, folder):
        first, side = row[0], row[-1].side
        bench = side["bench"]
        self.first, self.bench = first, bench
        first_z = sum(block.before_z for block in row[1:])
        self.direction = np.array(bench["light-direction"])
        self.source = bench["source-mm"] - np.array([0, 0, first_z]) if "source-mm" in bench else None
        self.plane = 0.0 if first.mirror else first.entry_z
        beam = side["design"].get("beam")
        self.beam = files.picture(folder / beam, "linear") if beam else None

    def at(self, point):
        """Direction at the point, where the ray enters (of a mirror the point), irradiance times Jacobian."""
        if self.first.mirror:
            direction = self.in_air(point)
            return direction, point, self.irradiance(point)
        if self.source is None:
            direction = np.broadcast_to(self.direction, point.shape)
            inside = self.first.enter(direction)
            entry = point - inside * ((point[..., 2:] - self.plane) / inside[..., 2:])
            return inside, entry, self.irradiance(entry)
        aside = point[..., :2] - self.source[:2]
        rho = np.hypot(*np.moveaxis(aside, -1, 0))
        air, glass, n = self.plane - self.source[2], point[..., 2] - self.plane, self.first.ior
        # The share of the way aside that is made in air, by Newton's method on Snell's law.
        share = n * air / (n * air + glass)
        for _ in range(20):
            a, b = np.hypot(share * rho, air), np.hypot((1 - share) * rho, glass)
            miss = share / a - n * (1 - share) / b
            share = np.clip(share - miss / (air**2 / a**3 + n * glass**2 / b**3), 0, 1)
        entry = np.concatenate([self.source[:2] + share[..., None] * aside, np.full(point.shape[:-1] + (1,), self.plane)], -1)
        a, b = np.hypot(share * rho, air), np.hypot((1 - share) * rho, glass)
        by_air, by_glass = air**2 / a**3, n * glass**2 / b**3
        jacobian = share * by_glass / (by_air + by_glass)
        return self.first.enter(self.in_air(entry)), entry, self.irradiance(entry) * jacobian

    def in_air(self, at):
        if self.source is None:
            return np.broadcast_to(self.direction, at.shape)
        ray = at - self.source
        return ray / np.linalg.norm(ray, axis=-1, keepdims=True)

    def irradiance(self, at):
        """Of a plane z = const in air."""
        if self.beam is not None:
            direction = self.in_air(at)
            measured = at + direction * ((self.plane - at[..., 2:]) / direction[..., 2:])
            value = self.measured(measured)
            if self.source is None:
                return value
            return value * (((measured - self.source) ** 2).sum(-1) / ((at - self.source) ** 2).sum(-1))
        if self.source is None:
            return np.ones(at.shape[:-1])
        direction = self.in_air(at)
        angle = np.arccos(np.clip(direction @ self.direction, -1, 1))
        return self.intensity(angle) * abs(direction[..., 2]) / ((at - self.source) ** 2).sum(-1)

    def intensity(self, angle):
        kind = self.bench.get("emission", "isotropic")
        if kind == "isotropic":
            return np.ones_like(angle)
        if kind == "lambertian":
            return np.maximum(np.cos(angle), 0)
        if kind == "gaussian":
            return 2.0 ** -((angle / self.bench["emission-half-angle"]) ** 2)
        if kind == "table":
            angles, values = np.array(self.bench["emission-table"]).T
            return np.interp(angle, angles, values, right=0.0)
        raise SystemExit(f"emission '{kind}' is not one of docs/side-file.md")

    def measured(self, at):
        rows, columns = self.beam.shape
        size = np.array([self.bench["width-mm"], self.bench["height-mm"]])
        share = 0.5 - at[..., :2] / size
        place = np.clip(share * (columns, rows) - 0.5, 0, (columns - 1, rows - 1))
        corner = np.minimum(place.astype(int), (columns - 2, rows - 2))
        (i, j), (s, t) = np.moveaxis(corner, -1, 0), np.moveaxis(place - corner, -1, 0)
        b = self.beam
        value = (b[j, i] * (1 - s) + b[j, i + 1] * s) * (1 - t) + (b[j + 1, i] * (1 - s) + b[j + 1, i + 1] * s) * t
        return np.where((abs(share - 0.5) <= 1.5).all(-1), value, 0)


def rotation(vector):
    """The matrix of a rotation vector (Rodrigues)."""
    angle = np.linalg.norm(vector)
    if angle == 0:
        return np.eye(3)
    x, y, z = np.array(vector) / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def image_of(row, light, pixels, rays):
    """Irradiance on the window, in the order of pictures."""
    bench = light.bench
    first, *later = row
    nx, ny = pixels
    plan = first.lattice(max(rays * nx, first.n[0] - 1), max(rays * ny, first.n[1] - 1))
    z, slopes = first.surface(plan)
    point = np.concatenate([plan, z[..., None]], -1)
    direction, entry, brings = light.at(point)
    flux = brings * (1 - (direction[..., :2] / direction[..., 2:] * slopes).sum(-1))
    if not first.mirror:
        flux = np.where(first.lets_in(point, entry), flux, 0)
    flux = np.maximum(flux, 0)
    onwards = first.leave(direction, slopes)
    for block in later:
        point, onwards, arrives = block.through(point + [0, 0, block.before_z], onwards)
        flux = np.where(arrives, flux, 0)
    turned = rotation(bench["receiver-turned"])
    centre, normal = np.array([0, 0, bench["distance-mm"]]), turned[:, 2]
    way = ((centre - point) @ normal / (onwards @ normal))[..., None]
    landing = ((point + way * onwards - centre) @ turned)[..., :2]
    window = np.array([bench["window-width-mm"], bench["window-height-mm"]])
    place = (0.5 - (landing - bench["window-centre-mm"]) / window) * (nx, ny)
    # Two triangles for every cell of the lattice; each brings the mean of its corners to the area of its plan.
    corners = [(slice(0, -1), slice(0, -1)), (slice(0, -1), slice(1, None)), (slice(1, None), slice(1, None)), (slice(1, None), slice(0, -1))]
    image = np.zeros((ny, nx))
    for halves in ((0, 1, 2), (0, 2, 3)):
        a, b, c = (plan[corners[k]] for k in halves)
        area = 0.5 * abs((b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0])
        power = area * sum(flux[corners[k]] for k in halves) / 3
        image += spread(np.stack([place[corners[k]].reshape(-1, 2) for k in halves], 1), power.ravel(), pixels)
    return image


def spread(triangles, power, pixels):
    """Light spread evenly over triangles (m x 3 x 2, in pixels), on an image: what a pixel gets is summed up along its row from
    what the edges to its left enclose."""
    nx, ny = pixels
    good = np.isfinite(triangles).all((1, 2)) & (power > 0)
    triangles, power = triangles[good], power[good]
    (ax, ay), (bx, by), (cx, cy) = (triangles[:, k].T for k in range(3))
    area = 0.5 * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
    thin = abs(area) < 1e-9
    image = np.zeros((ny, nx))
    middle = triangles[thin].mean(1)
    inside = ((middle >= 0) & (middle < (nx, ny))).all(1)
    i, j = middle[inside].astype(int).T
    np.add.at(image, (j, i), power[thin][inside])
    triangles, density = triangles[~thin], power[~thin] / area[~thin]
    begin = triangles.reshape(-1, 2)
    end = triangles[:, (1, 2, 0)].reshape(-1, 2)
    segments = np.concatenate([begin, end, np.repeat(density, 3)[:, None]], 1)  # x0 y0 x1 y1 density
    segments = segments[segments[:, 1] != segments[:, 3]]
    # Above and below the image nothing counts; on its left all of it is to the right of an edge, on its right nothing.
    segments = cut(cut(segments, 1, 0.0), 1, float(ny))
    height = 0.5 * (segments[:, 1] + segments[:, 3])
    segments = segments[(height > 0) & (height < ny)]
    segments = cut(cut(segments, 0, 0.0), 0, float(nx))
    across = 0.5 * (segments[:, 0] + segments[:, 2])
    segments = segments[across < nx]
    segments[:, [0, 2]] = np.maximum(segments[:, [0, 2]], 0)
    for axis in (1, 0):
        while True:
            low = np.minimum(segments[:, axis], segments[:, axis + 2])
            high = np.maximum(segments[:, axis], segments[:, axis + 2])
            line = np.floor(low + 1e-12) + 1
            crosses = line < high - 1e-12
            if not crosses.any():
                break
            segments = np.concatenate([segments[~crosses], *cut_at(segments[crosses], axis, line[crosses])])
    x, y = 0.5 * (segments[:, 0] + segments[:, 2]), 0.5 * (segments[:, 1] + segments[:, 3])
    i, j = np.clip(x.astype(int), 0, nx - 1), np.clip(y.astype(int), 0, ny - 1)
    # Light to the right of an edge that goes down the picture: a part of its own pixel, all of those that follow.
    rise = (segments[:, 1] - segments[:, 3]) * segments[:, 4]
    own = i + 1 - x
    gain = np.zeros((ny, nx + 1))
    np.add.at(gain, (j, i), rise * own)
    np.add.at(gain, (j, i + 1), rise * (1 - own))
    return image + np.cumsum(gain, 1)[:, :nx]


def cut(segments, axis, line):
    """Segments that end where they cross a line x = const or y = const."""
    crosses = (segments[:, axis] - line) * (segments[:, axis + 2] - line) < 0
    return np.concatenate([segments[~crosses], *cut_at(segments[crosses], axis, np.full(crosses.sum(), line))])


def cut_at(segments, axis, line):
    share = (line - segments[:, axis]) / (segments[:, axis + 2] - segments[:, axis])
    middle = segments[:, :2] + share[:, None] * (segments[:, 2:4] - segments[:, :2])
    middle[:, axis] = line
    first, second = segments.copy(), segments.copy()
    first[:, 2:4], second[:, 0:2] = middle, middle
    return first, second


def row_up_to(path):
    """The blocks that light goes through up to this one, in that order."""
    side = tomllib.loads(path.with_suffix(".toml").read_text(encoding="utf-8"))
    if "behind" not in side["design"]:
        return [Block(path, side)]
    before, gap = side["design"]["behind"].rsplit(",", 1)
    return [*row_up_to(path.parent / before), Block(path, side, float(gap.removesuffix("mm")))]


def wanted(side, folder):
    """The picture as light, framed, with its constant; mean 1."""
    design = side["design"]
    light = files.picture(folder / design["picture"], design.get("transfer"))
    kind, _, soft = design.get("vignette", "none").partition(":")
    rows, columns = light.shape
    if kind == "circle":
        parts = (np.arange(8) + 0.5) / 8
        x = ((np.arange(columns)[:, None] + parts) * 2 / columns - 1).ravel()
        y = ((np.arange(rows)[:, None] + parts) * 2 / rows - 1).ravel()
        distance = np.hypot(x[None, :], y[:, None])
        soft = float(soft or 0)
        t = np.clip((1 - distance) / soft, 0, 1) if soft else (distance <= 1).astype(float)
        light = light * (t * t * (3 - 2 * t)).reshape(rows, 8, columns, 8).mean((1, 3))
    margin = design.get("margin", 0.0)
    pad = [int(np.floor(n * margin / (1 - 2 * margin) + 0.5)) for n in (rows, columns)]
    light = np.pad(light, [(pad[0],) * 2, (pad[1],) * 2]) + design["offset"]
    return light / light.mean()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("block", type=pathlib.Path, help="a binary STL with its side file")
    parser.add_argument("--image", type=pathlib.Path, help="what `glasswarp verify -o` has written: .exr")
    parser.add_argument("--rays", type=int, default=6, help="rays per pixel along each side")
    parser.add_argument("--write", type=pathlib.Path, help="write the light as a linear 16-bit PNG")
    asked = parser.parse_args()
    row = row_up_to(asked.block)
    side, folder = row[-1].side, asked.block.parent
    spread_light, edits = ("source-size", "roughness", "psf"), ("background", "layer", "crop", "rotate", "flip", "levels", "invert")
    for name in (*spread_light, *edits):
        if side["design"].get(name, "none") != "none":
            raise SystemExit(f"{asked.block}: {name} is not followed here")
    target = wanted(side, folder)
    rows, columns = target.shape
    image = image_of(row, Light(row, folder), (columns, rows), asked.rays)
    image /= image.mean()
    print(f"relative RMS from the picture {np.sqrt(np.mean((image - target) ** 2)):.6f}")
    if asked.image:
        other = files.exr(asked.image)
        other = other / other.mean()
        if other.shape != image.shape:
            raise SystemExit(f"{asked.image}: {other.shape[1]} x {other.shape[0]} pixels instead of {columns} x {rows}")
        print(f"relative RMS from the image {np.sqrt(np.mean((image - other) ** 2)):.6f}")
    if asked.write:
        files.write_png(asked.write, image / target.max())


if __name__ == "__main__":
    main()
