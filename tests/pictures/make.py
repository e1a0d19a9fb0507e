#!/usr/bin/env python3
"""Makes the pictures of this folder, and the light that each is, from the formats' specifications and not from glasswarp.

    pip install pillow numpy OpenEXR
    python3 make.py

A chart of numbers (a letter F, ramps, a wedge) is encoded by Pillow (libjpeg, libtiff, libwebp), by OpenEXR, or by the few lines
below where those cannot. `list.tsv` says of every file: options, outcome (`light/NAME` or `refused: WORDS`), tolerance, and where
such files come from.
"""
import io, json, os, struct, zlib
import numpy as np
from PIL import Image, ImageCms
import OpenEXR

here = os.path.dirname(os.path.abspath(__file__))
os.makedirs(f'{here}/light', exist_ok=True)
NX, NY = 26, 18
rows = []

# --- the chart, as encoded numbers 0..255
j, i = np.mgrid[0:NY, 0:NX]
V = (10 * i) % 256
F = ((i >= 4) & (i < 6) & (j >= 3) & (j < 14)) | ((i >= 4) & (i < 11) & (j >= 3) & (j < 5)) | ((i >= 4) & (i < 9) & (j >= 7) & (j < 9))
V = np.where(F, 255, V)
V = np.where(j >= 15, 51 * (i // 5), V).clip(0, 255)
RGB = np.stack([V, (255 - V // 2), (V * 3 // 4 + 4 * j) % 256], -1)
A = (40 + 8 * i + 3 * j).clip(0, 255)
A = np.where(F, 0, A)
SMOOTH = (20 + 6 * i + 3 * j).clip(0, 255)

srgb = lambda v: np.where(v <= .04045, v / 12.92, ((v + .055) / 1.055) ** 2.4)
W709 = np.array([.2126, .7152, .0722])
grey = lambda v, curve=srgb: curve(np.asarray(v, float))
lum = lambda rgb, curve=srgb, w=W709: (curve(np.asarray(rgb, float)) * w).sum(-1)
linear = lambda v: v
power = lambda p: (lambda v: v ** p)
def rec709(v):
    a, b = 1.09929682680944, .018053968510807
    return np.where(v < 4.5 * b, v / 4.5, ((v + a - 1) / a) ** (1 / .45))
def weights(xy, white):
    m = np.array([[x / y, 1, (1 - x - y) / y] for x, y in xy]).T
    return np.linalg.solve(m, np.array([white[0] / white[1], 1, (1 - white[0] - white[1]) / white[1]]))

def entry(name, outcome, source, tolerance=1e-6, options=''):
    if not isinstance(outcome, str):
        light = np.ascontiguousarray(outcome, '<f4')
        key = f'{zlib.crc32(light.tobytes()):08x}'
        with open(f'{here}/light/{key}', 'wb') as f: f.write(struct.pack('<II', light.shape[1], light.shape[0]) + light.tobytes())
        outcome = f'light/{key}'
    rows.append((name, options, outcome, f'{tolerance:g}', source))
def write(name, data, *args, **kw):
    with open(f'{here}/{name}', 'wb') as f: f.write(data)
    entry(name, *args, **kw)

# --- PNG, by hand
chunk = lambda t, d: struct.pack('>I', len(d)) + t + d + struct.pack('>I', zlib.crc32(t + d))
def packed(a, depth):
    if depth == 16: return a.astype('>u2').reshape(a.shape[0], -1).view(np.uint8)
    a = a.astype(np.uint8).reshape(a.shape[0], -1)
    if depth == 8: return a
    per = 8 // depth
    a = np.pad(a, ((0, 0), (0, -a.shape[1] % per))).reshape(a.shape[0], -1, per)
    return sum(a[..., k].astype(np.uint8) << (8 - depth * (k + 1)) for k in range(per)).astype(np.uint8)
def scan(a, depth): return b''.join(b'\0' + row.tobytes() for row in packed(a, depth)) if a.size else b''
def png(a, kind, depth=8, extra=(), interlaced=False, behind=()):
    data = scan(a, depth)
    if interlaced:
        data = b''.join(scan(a[y::dy, x::dx], depth) for x, y, dx, dy in
                        [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)])
    head = struct.pack('>IIBBBBB', a.shape[1], a.shape[0], depth, kind, 0, 0, int(interlaced))
    return (b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', head) + b''.join(chunk(*e) for e in extra)
            + chunk(b'IDAT', zlib.compress(data)) + b''.join(chunk(*e) for e in behind) + chunk(b'IEND', b''))
V16, RGB16, A16 = V * 257 + i * 3 - (V > 250) * i * 3, RGB * 256 + j[..., None], A * 257
few = lambda n: V * ((1 << n) - 1) // 255
write('grey8.png', png(V, 0), grey(V / 255), 'any program')
write('grey16.png', png(V16, 0, 16), grey(V16 / 65535), 'scanners, GIMP, depth maps')
for n in (1, 2, 4):
    write(f'grey{n}.png', png(few(n), 0, n), grey(few(n) / ((1 << n) - 1)), 'line art, optimisers (oxipng, pngcrush)')
write('rgb8.png', png(RGB, 2), lum(RGB / 255), 'any program')
write('rgb16.png', png(RGB16, 2, 16), lum(RGB16 / 65535), 'raw developers (darktable, RawTherapee)')
over = lambda light, alpha, back=0.0: alpha * light + (1 - alpha) * back
write('grey_alpha8.png', png(np.stack([V, A], -1), 4), over(grey(V / 255), A / 255), 'logos in grey')
write('grey_alpha16.png', png(np.stack([V16, A16], -1), 4, 16), over(grey(V16 / 65535), A16 / 65535), 'GIMP, 16 bits')
write('rgba8.png', png(np.dstack([RGB, A]), 6), over(lum(RGB / 255), A / 255), 'logos, screenshots of windows')
write('rgba8_white.png', png(np.dstack([RGB, A]), 6), over(lum(RGB / 255), A / 255, 1), 'the same on white', options='background=white')
write('rgba8_colour.png', png(np.dstack([RGB, A]), 6), over(lum(RGB / 255), A / 255, lum(np.array([64, 128, 192]) / 255)),
      'the same on a colour', options='background=#4080c0')
write('rgba16.png', png(np.dstack([RGB16, A16]), 6, 16), over(lum(RGB16 / 65535), A16 / 65535), 'Krita, Blender')
palette = np.array([[(k * 37) % 256, (k * 91 + 20) % 256, (255 - k)] for k in range(256)])
index = (V // 2 + j) % 256
PLTE = lambda n: (b'PLTE', palette[:n].astype(np.uint8).tobytes())
write('palette8.png', png(index, 3, 8, [PLTE(256)]), lum(palette[index] / 255), 'pngquant, screenshots')
for n in (1, 2, 4):
    write(f'palette{n}.png', png(few(n), 3, n, [PLTE(1 << n)]), lum(palette[few(n)] / 255), 'optimised logos')
alphas = np.array([(k * 5) % 256 for k in range(100)]); full = np.concatenate([alphas, np.full(156, 255)])
write('palette_alpha.png', png(index, 3, 8, [PLTE(256), (b'tRNS', alphas.astype(np.uint8).tobytes())]),
      over(lum(palette[index] / 255), full[index] / 255), 'pngquant with transparency')
write('grey_colour_key.png', png(V, 0, 8, [(b'tRNS', struct.pack('>H', 255))]), over(grey(V / 255), V != 255, 0), 'old web graphics')
write('grey1_colour_key.png', png(few(1), 0, 1, [(b'tRNS', struct.pack('>H', 0))]), over(grey(few(1) * 1.), few(1) != 0, 1),
      'the same with one bit', options='background=white')
write('rgb_colour_key.png', png(RGB, 2, 8, [(b'tRNS', struct.pack('>HHH', 255, 128, 191))]),
      over(lum(RGB / 255), ~((RGB == [255, 128, 191]).all(-1)), 0), 'old web graphics')
write('interlaced_rgb.png', png(RGB, 2, 8, interlaced=True), lum(RGB / 255), 'pictures for the web')
write('interlaced_grey1.png', png(few(1), 0, 1, interlaced=True), grey(few(1) * 1.), 'line art for the web')
write('interlaced_rgba16.png', png(np.dstack([RGB16, A16]), 6, 16, interlaced=True), over(lum(RGB16 / 65535), A16 / 65535), 'rare')
gama = lambda g: (b'gAMA', struct.pack('>I', round(g * 1e5)))
chrm = lambda white, *rgb: (b'cHRM', struct.pack('>8I', *[round(v * 1e5) for p in (white, *rgb) for v in p]))
D65 = (.3127, .329)
ADOBE = [(.64, .33), (.21, .71), (.15, .06)]
write('gama_linear.png', png(V16, 0, 16, [gama(1)]), grey(V16 / 65535, linear), 'renderers (POV-Ray), scientific tools')
write('gama_22.png', png(RGB, 2, 8, [gama(.45455)]), lum(RGB / 255, power(1 / .45455)), 'old Photoshop, ImageMagick')
write('gama_mac.png', png(RGB, 2, 8, [gama(.55556)]), lum(RGB / 255, power(1 / .55556)), 'old Macintosh programs')
write('gama_chrm.png', png(RGB, 2, 8, [gama(.45455), chrm(D65, *ADOBE)]), lum(RGB / 255, power(1 / .45455), weights(ADOBE, D65)), 'libpng programs')
write('chrm_alone.png', png(RGB, 2, 8, [chrm(D65, *ADOBE)]), lum(RGB / 255, srgb, weights(ADOBE, D65)), 'rare')
write('srgb_over_gama.png', png(RGB, 2, 8, [(b'sRGB', b'\0'), gama(1)]), lum(RGB / 255), 'sRGB decides before gAMA')
write('gama_zero.png', png(RGB, 2, 8, [gama(0)]), lum(RGB / 255), 'broken writers')
cicp = lambda *n: (b'cICP', bytes(n))
P3 = [(.68, .32), (.265, .69), (.15, .06)]; R2020 = [(.708, .292), (.17, .797), (.131, .046)]
write('cicp_p3.png', png(RGB, 2, 8, [cicp(12, 13, 0, 1)]), lum(RGB / 255, srgb, weights(P3, D65)), 'phones, browsers')
write('cicp_2020.png', png(RGB16, 2, 16, [cicp(9, 1, 0, 1)]), lum(RGB16 / 65535, rec709, weights(R2020, D65)), 'video stills')
write('cicp_linear.png', png(RGB16, 2, 16, [cicp(1, 8, 0, 1), (b'sRGB', b'\0')]), lum(RGB16 / 65535, linear), 'cICP decides before sRGB')
write('cicp_open.png', png(RGB, 2, 8, [cicp(2, 2, 0, 1), gama(1)]), lum(RGB / 255, linear), 'unspecified: the next decides')
write('cicp_pq.png', png(RGB16, 2, 16, [cicp(9, 16, 0, 1)]), 'refused: PQ', 'HDR screenshots')
write('cicp_hlg.png', png(RGB16, 2, 16, [cicp(9, 18, 0, 1)]), 'refused: HLG', 'HDR cameras')
write('cicp_narrow.png', png(RGB, 2, 8, [cicp(1, 1, 0, 0)]), 'refused: full range', 'video stills')

# --- ICC profiles, by hand (ICC.1:2010)
s15 = lambda *v: struct.pack(f'>{len(v)}i', *[round(x * 65536) for x in v])
def profile(space, pcs, tags, version=(2, 0x40), cls=b'mntr'):
    tags = [(b'desc', b'desc' + bytes(4) + struct.pack('>I', 8) + b'glass w\0' + bytes(4 + 4 + 2 + 1 + 67))] + tags
    at, table, body = 128 + 4 + 12 * len(tags), b'', b''
    for sig, data in tags:
        data += bytes(-len(data) % 4)
        table += sig + struct.pack('>II', at + len(body), len(data)); body += data
    size = at + len(body)
    head = struct.pack('>I4sBBH', size, bytes(4), *version, 0) + cls + space + pcs + bytes(12) + b'acsp' + bytes(28) + s15(.9642, 1, .8249)
    return head.ljust(128, b'\0') + struct.pack('>I', len(tags)) + table + body
xyz = lambda v: b'XYZ ' + bytes(4) + s15(*v)
curv = lambda *v: b'curv' + bytes(4) + struct.pack('>I', len(v)) + struct.pack(f'>{len(v)}H', *v)
para = lambda kind, *v: b'para' + bytes(4) + struct.pack('>HH', kind, 0) + s15(*v)
SRGB_PARA = para(3, 2.4, 1 / 1.055, .055 / 1.055, 1 / 12.92, .04045)
BRAD = np.array([[.8951, .2664, -.1614], [-.7502, 1.7135, .0367], [.0389, -.0685, 1.0296]])
def white_xyz(w): return np.array([w[0] / w[1], 1, (1 - w[0] - w[1]) / w[1]])
def adapt(src, dst): return np.linalg.inv(BRAD) @ np.diag((BRAD @ dst) / (BRAD @ src)) @ BRAD
D50 = np.array([.9642, 1, .8249])
def rgb_profile(xy, white, curves, version=(2, 0x40), chad=False):
    w = weights(xy, white); m = np.array([[x / y, 1, (1 - x - y) / y] for x, y in xy]).T * w
    a = adapt(white_xyz(white), D50); m = a @ m
    tags = [(b'rXYZ', xyz(m[:, 0])), (b'gXYZ', xyz(m[:, 1])), (b'bXYZ', xyz(m[:, 2]))] + list(zip((b'rTRC', b'gTRC', b'bTRC'), curves))
    tags += [(b'wtpt', xyz(D50)), (b'chad', b'sf32' + bytes(4) + s15(*a.ravel()))] if chad else [(b'wtpt', xyz(white_xyz(white)))]
    return profile(b'RGB ', b'XYZ ', tags, version)
iccp = lambda p: (b'iCCP', b'x\0\0' + zlib.compress(p))
R709 = [(.64, .33), (.3, .6), (.15, .06)]
ICC_SRGB = rgb_profile(R709, D65, [SRGB_PARA] * 3, (4, 0x20), chad=True)
ICC_SRGB2 = rgb_profile(R709, D65, [curv(*[round(65535 * float(srgb(np.float64(k / 1023)))) for k in range(1024)])] * 3)
ICC_ADOBE = rgb_profile(ADOBE, D65, [curv(round(2.19921875 * 256))] * 3)
ICC_GREY = lambda g: profile(b'GRAY', b'XYZ ', [(b'wtpt', xyz(D50)), (b'kTRC', curv(round(g * 256)) if g != 1 else curv())])
write('icc_srgb4.png', png(RGB, 2, 8, [iccp(ICC_SRGB)]), lum(RGB / 255), 'sRGB by a profile of version 4 is sRGB', 5e-5)
write('icc_srgb2.png', png(RGB, 2, 8, [iccp(ICC_SRGB2)]), lum(RGB / 255), 'sRGB by a profile of version 2 (HP) is sRGB', 5e-5)
write('icc_adobe.png', png(RGB, 2, 8, [iccp(ICC_ADOBE)]), lum(RGB / 255, power(2.19921875), weights(ADOBE, D65)), 'cameras set to Adobe RGB', 3e-5)
write('icc_over_gama.png', png(RGB, 2, 8, [gama(1), iccp(ICC_ADOBE)]), lum(RGB / 255, power(2.19921875), weights(ADOBE, D65)), 'ICC decides before gAMA', 3e-5)
write('icc_grey18.png', png(V, 0, 8, [iccp(ICC_GREY(1.796875))]), grey(V / 255, power(1.796875)), 'Photoshop: Gray Gamma 1.8', 1e-5)
write('icc_grey_linear.png', png(V16, 0, 16, [iccp(ICC_GREY(1))]), grey(V16 / 65535, linear), 'linear grey', 1e-6)
write('icc_rgb_on_grey.png', png(V, 0, 8, [iccp(ICC_ADOBE)]), grey(V / 255, power(2.19921875)), 'programs that tag grey with an RGB profile', 1e-5)
write('icc_broken.png', png(RGB, 2, 8, [iccp(ICC_ADOBE[:140])]), lum(RGB / 255), 'broken profile: passed over with a word')
write('icc_grey_on_rgb.png', png(RGB, 2, 8, [iccp(ICC_GREY(1))]), lum(RGB / 255), 'profile of other colours: passed over with a word')

# --- table profiles: a smooth function of the inks, by which LittleCMS is asked too
def table_profile(space, n, lab_of, grid):
    axes = np.meshgrid(*[np.linspace(0, 1, grid)] * n, indexing='ij')
    lab = lab_of(*axes)
    clut = np.stack([(lab[0] / 100 * 65280), ((lab[1] + 128) * 256), ((lab[2] + 128) * 256)], -1).clip(0, 65535).round().astype('>u2')
    ramp = np.array([0, 20000, 65535], '>u2')
    lut = (b'mft2' + bytes(4) + bytes([n, 3, grid, 0]) + s15(1, 0, 0, 0, 1, 0, 0, 0, 1) + struct.pack('>HH', 3, 2)
           + ramp.tobytes() * n + clut.tobytes() + np.array([0, 65535], '>u2').tobytes() * 3)
    return profile(space, b'Lab ', [(b'wtpt', xyz(D50)), (b'A2B0', lut), (b'A2B1', lut)], cls=b'prtr' if n == 4 else b'mntr')
ICC_CMYK = table_profile(b'CMYK', 4, lambda c, m, y, k: ((100 - 40 * c - 45 * m - 10 * y + 8 * c * m) * (1 - .93 * k), 60 * (m - c) * (1 - k), 70 * (y - .5 * c) * (1 - k)), 5)
ICC_TABLE = table_profile(b'RGB ', 3, lambda r, g, b: (100 * (.3 * r ** 2 + .6 * g ** 1.5 + .1 * b), 40 * (r - g), 40 * (g - b)), 9)
def l_of(table, n, grid, numbers):
    """L* between the points of the grid, multilinear, in double precision: as ICC says, after the curve 0, 20000, 65535."""
    v = np.interp(numbers, [0, .5, 1], [0, 20000 / 65535, 1]) * (grid - 1)
    start = table.index(b'mft2') + 48 + 4 + 6 * n
    clut = np.frombuffer(table[start:start + 2 * 3 * grid ** n], '>u2').reshape(*[grid] * n, 3)[..., 0] / 652.8
    cell = np.minimum(v.astype(int), grid - 2); part = v - cell
    out = 0
    for corner in np.ndindex(*[2] * n):
        w = np.prod([part[..., k] if c else 1 - part[..., k] for k, c in enumerate(corner)], 0)
        out = out + w * clut[tuple(cell[..., k] + c for k, c in enumerate(corner))]
    return out
y_of = lambda L: np.where(L <= 8, L * 27 / 24389, ((L + 16) / 116) ** 3)
CMYK = np.stack([V, (255 - V) // 2, SMOOTH, (A // 4)], -1).astype(np.uint8)
CMYK_SMOOTH = np.stack([SMOOTH, 255 - SMOOTH, SMOOTH // 2, 3 * j], -1).astype(np.uint8)
naive = lambda c: lum((1 - c[..., :3] / 255) * (1 - c[..., 3:] / 255))
def lcms(profile_bytes, image):
    lab = ImageCms.createProfile('LAB')
    t = ImageCms.buildTransform(ImageCms.ImageCmsProfile(io.BytesIO(profile_bytes)), lab, image.mode, 'LAB', ImageCms.Intent.RELATIVE_COLORIMETRIC)
    return y_of(np.asarray(ImageCms.applyTransform(image, t))[..., 0] / 2.55)
table_cmyk = y_of(l_of(ICC_CMYK, 4, 5, CMYK / 255)); table_rgb = y_of(l_of(ICC_TABLE, 3, 9, RGB / 255))
assert abs(table_cmyk - lcms(ICC_CMYK, Image.fromarray(CMYK, 'CMYK'))).max() < .015, 'LittleCMS says otherwise'
assert abs(table_rgb - lcms(ICC_TABLE, Image.fromarray(RGB.astype(np.uint8), 'RGB'))).max() < .02, 'LittleCMS says otherwise'
print('LittleCMS agrees to', abs(table_cmyk - lcms(ICC_CMYK, Image.fromarray(CMYK, 'CMYK'))).max())
write('icc_table.png', png(RGB, 2, 8, [iccp(ICC_TABLE)]), table_rgb, 'profiles of scanners and printers', 1e-5)

# --- EXIF and orientation: what is stored is the upright chart, turned back
def exif(n): return b'II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0' + struct.pack('<HH', n, 0) + bytes(4)
back = {1: lambda a: a, 2: lambda a: a[:, ::-1], 3: lambda a: a[::-1, ::-1], 4: lambda a: a[::-1], 5: lambda a: a.swapaxes(0, 1),
        6: lambda a: np.rot90(a, 1), 7: lambda a: a[::-1, ::-1].swapaxes(0, 1), 8: lambda a: np.rot90(a, -1)}
jpeg = lambda a, mode=None, **kw: (lambda f: (Image.fromarray(np.ascontiguousarray(a).astype(np.uint8), mode).save(f, 'JPEG', **({'quality': 100, 'subsampling': 0} | kw)), f.getvalue())[1])(io.BytesIO())
webp = lambda a, **kw: (lambda f: (Image.fromarray(np.ascontiguousarray(a).astype(np.uint8)).save(f, 'WEBP', **({'lossless': True, 'exact': True} | kw)), f.getvalue())[1])(io.BytesIO())
SM = SMOOTH.astype(np.uint8); SMRGB = np.stack([SM, 255 - SM, 128 + SM // 4], -1)

# --- TIFF, by hand
def tiff(a, photometric, bits=8, fmt=1, extra=(), big=False, order='<', planar=False, rows=None, data=None, spp=None):
    o = order; a = np.asarray(a); a = a[..., None] if a.ndim == 2 else a
    ny, nx, n = a.shape; n = spp or n
    kind = {(8, 1): 'u1', (16, 1): 'u2', (32, 1): 'u4', (32, 3): 'f4', (64, 3): 'f8', (16, 3): 'f2'}.get((bits, fmt))
    if planar: parts = [a[..., k].astype(o + kind).tobytes() for k in range(n)]
    else:
        step = rows or ny
        parts = [packed(a[t:t + step], bits).tobytes() if bits < 8 else a[t:t + step].astype(o + kind).tobytes() for t in range(0, ny, step)]
    tags = {256: (4, [nx]), 257: (4, [ny]), 258: (3, [bits] * n), 259: (3, [1]), 262: (3, [photometric]), 277: (3, [n]),
            278: (4, [ny if planar else rows or ny]), 284: (3, [2 if planar else 1]), 339: (3, [fmt] * n)} | dict(extra)
    size = {1: 1, 3: 2, 4: 4, 7: 1, 16: 8}; code = {1: 'B', 3: 'H', 4: 'I', 7: 'B', 16: 'Q'}
    head = 16 if big else 8
    blob, offsets = b'', []
    for p in parts: offsets.append(head + len(blob)); blob += p + bytes(len(p) % 2)
    tags[273] = (16 if big else 4, offsets); tags[279] = (16 if big else 4, [len(p) for p in parts])
    outside, entries, inline = b'', [], 8 if big else 4
    at = head + len(blob) + (8 + 20 * len(tags) + 8 if big else 2 + 12 * len(tags) + 4)
    for tag in sorted(tags):
        t, v = tags[tag]; raw = struct.pack(f'{o}{len(v)}{code[t]}', *v)
        if len(raw) <= inline: field = raw.ljust(inline, b'\0')
        else: field = struct.pack(o + ('Q' if big else 'I'), at + len(outside)); outside += raw + bytes(len(raw) % 2)
        entries.append(struct.pack(o + ('HHQ' if big else 'HHI'), tag, t, len(v)) + field)
    mark = b'II' if o == '<' else b'MM'
    if big: return mark + struct.pack(o + 'HHHQ', 43, 8, 0, head + len(blob)) + blob + struct.pack(o + 'Q', len(tags)) + b''.join(entries) + bytes(8) + outside
    return mark + struct.pack(o + 'HI', 42, head + len(blob)) + blob + struct.pack(o + 'H', len(tags)) + b''.join(entries) + bytes(4) + outside

for n in range(1, 9):
    turned = back[n](RGB)
    write(f'turned{n}.png', png(turned, 2, 8, [(b'eXIf', exif(n))]), lum(RGB / 255), 'phones, by way of converters')
    write(f'turned{n}.jpg', jpeg(back[n](SM), exif=b'Exif\0\0' + exif(n)), grey(SM / 255), 'phones and cameras', .012)
    write(f'turned{n}.webp', webp(turned, exif=b'Exif\0\0' + exif(n)), lum(RGB / 255), 'messengers, web services')
    write(f'turned{n}.tif', tiff(turned, 2, extra={274: (3, [n])}), lum(RGB / 255), 'scanners')
for n in (0, 9):
    write(f'turned{n}.png', png(RGB, 2, 8, [(b'eXIf', exif(n))]), lum(RGB / 255), 'out of range: upright')
write('turned6_behind.png', png(back[6](RGB), 2, 8, behind=[(b'eXIf', exif(6))]), lum(RGB / 255), 'exiftool: eXIf behind the picture')
write('turned6_big_endian.jpg', jpeg(back[6](SM), exif=b'Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0'), grey(SM / 255), 'cameras (Motorola order)', .012)

# --- JPEG
write('grey.jpg', jpeg(SM), grey(SM / 255), 'scanners', .012)
write('rgb.jpg', jpeg(SMRGB), lum(SMRGB / 255), 'cameras', .02)
write('progressive.jpg', jpeg(SMRGB, progressive=True), lum(SMRGB / 255), 'the web', .02)
write('adobe_rgb_colours.jpg', jpeg(SMRGB, keep_rgb=True), lum(SMRGB / 255), 'RGB without YCbCr (Adobe)', .012)
write('icc.jpg', jpeg(SMRGB, icc_profile=ICC_ADOBE), lum(SMRGB / 255, power(2.19921875), weights(ADOBE, D65)), 'cameras set to Adobe RGB', .02)
cm = jpeg(CMYK_SMOOTH, 'CMYK')
def without_adobe(data):
    k = data.index(b'\xff\xee'); return data[:k] + data[k + 2 + struct.unpack('>H', data[k + 2:k + 4])[0]:]
assert b'Adobe' in cm
write('cmyk_adobe.jpg', cm, naive(CMYK_SMOOTH), 'Photoshop, for print', .02)
write('cmyk_icc.jpg', jpeg(CMYK_SMOOTH, 'CMYK', icc_profile=ICC_CMYK), y_of(l_of(ICC_CMYK, 4, 5, CMYK_SMOOTH / 255)), 'Photoshop, for print, with its profile', .02)
write('cmyk_plain.jpg', without_adobe(jpeg(255 - CMYK_SMOOTH, 'CMYK')), naive(CMYK_SMOOTH), 'programs that write no marker', .02)
# YCCK: the stored inks are the complements of the colours that YCbCr means.
c, m, y = [255. - CMYK_SMOOTH[..., k] for k in range(3)]          # as Adobe stores them
r, g, b = 255 - c, 255 - m, 255 - y
ycc = np.stack([.299 * r + .587 * g + .114 * b, 128 - .168736 * r - .331264 * g + .5 * b, 128 + .5 * r - .418688 * g - .081312 * b], -1)
raw = np.dstack([ycc.round().clip(0, 255), 255 - CMYK_SMOOTH[..., 3]])
yk = bytearray(jpeg(255 - raw, 'CMYK')); k = yk.index(b'Adobe'); yk[k + 11] = 2
write('ycck.jpg', bytes(yk), naive(CMYK_SMOOTH), 'Photoshop, for print, small files', .03)
write('film_behind.jpg', jpeg(SM) + b'\0\0\0\x18ftypmp42\xff\xd9\xff\xda' + bytes(40), grey(SM / 255), 'phones: a film behind the picture', .012)
whole = jpeg(RGB); write('cut_short.jpg', whole[:len(whole) * 2 // 3], 'refused: ends before', 'downloads that broke off')

# --- TIFF
write('grey8.tif', tiff(V, 1), grey(V / 255), 'scanners')
write('white_is_zero.tif', tiff(255 - V, 0), grey(V / 255), 'fax, scanners')
for n in (1, 2, 4):
    write(f'grey{n}.tif', tiff(few(n), 1, n), grey(few(n) / ((1 << n) - 1)), 'scanned line art')
write('fax1.tif', tiff(1 - few(1), 0, 1), grey(few(1) * 1.), 'fax')
write('grey16_strips.tif', tiff(V16, 1, 16, order='>', rows=5), grey(V16 / 65535), 'microscopes, strips of 5 rows, big endian')
write('grey32.tif', tiff(V16.astype('u4') * 65537, 1, 32), grey(V16 / 65535), 'scientific cameras')
light = V / 255 * 1.5
write('float32_grey.tif', tiff(light, 1, 32, 3), light, 'ImageJ, rendering', 1e-6)
write('float64_grey.tif', tiff(light, 1, 64, 3), light, 'MATLAB', 1e-6)
write('float16_rgb.tif', tiff(RGB / 256, 2, 16, 3), lum(RGB / 256, linear), 'HDR tools', 1e-3)
write('float32_rgb.tif', tiff(RGB / 255, 2, 32, 3), lum(RGB / 255, linear), 'HDR tools', 1e-6)
write('rgb16.tif', tiff(RGB16, 2, 16), lum(RGB16 / 65535), 'raw developers')
write('planar.tif', tiff(RGB, 2, planar=True), lum(RGB / 255), 'satellites, scanners')
write('big.tif', tiff(RGB, 2, big=True), lum(RGB / 255), 'BigTIFF: very large scans')
colormap = np.concatenate([palette[:, k] * 257 for k in range(3)]).tolist()
write('palette8.tif', tiff(index, 3, extra={320: (3, colormap)}), lum(palette[index] / 255), 'old drawing programs')
write('palette4.tif', tiff(few(4), 3, 4, extra={320: (3, np.concatenate([palette[:16, k] * 257 for k in range(3)]).tolist())}),
      lum(palette[few(4)] / 255), 'old drawing programs')
write('rgba.tif', tiff(np.dstack([RGB, A]), 2, extra={338: (3, [2])}), over(lum(RGB / 255), A / 255), 'GIMP')
A2 = A.clip(1); PRE = (RGB * A2[..., None] / 255).round()
write('rgba_premultiplied.tif', tiff(np.dstack([PRE, A2]), 2, extra={338: (3, [1])}), A2 / 255 * lum(PRE / A2[..., None]), 'compositing programs', 1e-5)
write('rgb_extra.tif', tiff(np.dstack([RGB, A]), 2, extra={338: (3, [0])}), lum(RGB / 255), 'Photoshop: a channel that is no alpha')
write('grey_alpha.tif', tiff(np.stack([V, A], -1), 1, extra={338: (3, [2])}), over(grey(V / 255), A / 255, 1), 'GIMP', options='background=white')
write('cmyk.tif', tiff(CMYK, 5), naive(CMYK), 'print')
write('cmyk_icc.tif', tiff(CMYK, 5, extra={34675: (7, list(ICC_CMYK))}), table_cmyk, 'print, with its profile', 1e-5)
write('icc.tif', tiff(RGB, 2, extra={34675: (7, list(ICC_ADOBE))}), lum(RGB / 255, power(2.19921875), weights(ADOBE, D65)), 'Photoshop', 3e-5)
write('lab.tif', tiff(np.stack([V, V * 0 + 128, V * 0 + 128], -1), 9), 'refused: save it as grey or RGB', 'Photoshop: Lab')
write('raw.dng', tiff(V, 1, extra={50706: (1, [1, 4, 0, 0])}), 'refused: raw photograph', 'cameras')
for how in ('tiff_lzw', 'tiff_adobe_deflate', 'packbits'):
    f = io.BytesIO(); Image.fromarray(RGB.astype(np.uint8)).save(f, 'TIFF', compression=how)
    write(f'{how}.tif', f.getvalue(), lum(RGB / 255), 'libtiff, by Pillow')
f = io.BytesIO(); Image.fromarray(few(1).astype(bool)).save(f, 'TIFF', compression='group4')
write('group4.tif', f.getvalue(), grey(few(1) * 1.), 'scanned documents')

# --- WebP, BMP, GIF, PNM
write('lossy.webp', webp(SMRGB, lossless=False, quality=100), lum(SMRGB / 255), 'the web', .05)
write('alpha.webp', webp(np.dstack([RGB, A])), over(lum(RGB / 255), A / 255), 'stickers')
write('icc.webp', webp(RGB, icc_profile=ICC_ADOBE), lum(RGB / 255, power(2.19921875), weights(ADOBE, D65)), 'web services', 3e-5)
def pil(image, kind, **kw): f = io.BytesIO(); image.save(f, kind, **kw); return f.getvalue()
u8 = lambda a: np.asarray(a).astype(np.uint8)
write('rgb.bmp', pil(Image.fromarray(u8(RGB)), 'BMP'), lum(RGB / 255), 'Windows Paint')
write('one.bmp', pil(Image.fromarray(few(1).astype(bool)), 'BMP'), grey(few(1) * 1.), 'engravers')
write('palette.bmp', pil(Image.fromarray(u8(V)), 'BMP'), grey(V / 255), 'Windows Paint')
gif = Image.fromarray(u8(index % 128)); gif.putpalette(u8(palette[:128]).tobytes())
write('palette.gif', pil(gif, 'GIF'), lum(palette[index % 128] / 255), 'the web')
write('transparent.gif', pil(gif, 'GIF', transparency=5), over(lum(palette[index % 128] / 255), index % 128 != 5, 1), 'the web', options='background=white')
write('plain.pgm', f'P2 # plain\n{NX} {NY} 255\n'.encode() + ' '.join(map(str, V.ravel())).encode(), grey(V / 255), 'hand-written')
write('maxval100.pgm', f'P5 {NX} {NY} 100\n'.encode() + u8(V * 100 // 255).tobytes(), grey((V * 100 // 255) / 100), 'netpbm: the decoder rounds to 8 bits', 4.5e-3)
write('maxval1000.pgm', f'P5 {NX} {NY} 1000\n'.encode() + (V * 1000 // 255).astype('>u2').tobytes(), grey((V * 1000 // 255) / 1000), 'netpbm: the decoder rounds to 16 bits', 2e-5)
write('rgb16.ppm', f'P6 {NX} {NY} 65535\n'.encode() + RGB16.astype('>u2').tobytes(), lum(RGB16 / 65535), 'dcraw')
write('bits.pbm', f'P4 {NX} {NY}\n'.encode() + packed(1 - few(1), 1).tobytes(), grey(few(1) * 1.), 'scanners')
write('alpha.pam', f'P7\nWIDTH {NX}\nHEIGHT {NY}\nDEPTH 4\nMAXVAL 255\nTUPLTYPE RGB_ALPHA\nENDHDR\n'.encode() + u8(np.dstack([RGB, A])).tobytes(),
      over(lum(RGB / 255), A / 255), 'netpbm')

# --- OpenEXR
LIN = (RGB / 255).astype(np.float32); Y = (V / 255).astype(np.float32)
def exr(name, channels, *args, header=(), parts=None, **kw):
    head = {'compression': OpenEXR.ZIP_COMPRESSION, 'type': OpenEXR.scanlineimage} | dict(header)
    if parts: OpenEXR.File([OpenEXR.Part(head | {'name': n}, c, n) for n, c in parts]).write(f'{here}/{name}')
    else: OpenEXR.File(head, {k: c if isinstance(c, OpenEXR.Channel) else OpenEXR.Channel(np.ascontiguousarray(c)) for k, c in channels.items()}).write(f'{here}/{name}')
    entry(name, *args, **kw)
rgb = lambda a, p='', s=1: {p + 'RGB'[k]: (a[..., k] * s).astype(a.dtype) for k in range(3)}
peak = lambda l: l / l.max()
exr('rgb.exr', rgb(LIN * np.float32(7)), peak(lum(LIN, linear)), 'renderers: the brightest becomes white', tolerance=2e-6)
for name in ('RLE', 'ZIPS', 'PIZ', 'PXR24', 'B44', 'DWAA'):
    half = np.float16(LIN)
    exr(f'{name.lower()}.exr', rgb(half), peak(lum(half.astype(float), linear)), 'renderers', header={'compression': getattr(OpenEXR, f'{name}_COMPRESSION')}, tolerance=.02 if name in ('B44', 'DWAA') else 2e-6)
exr('grey.exr', {'Y': Y}, Y, 'grey renderings, height maps', tolerance=2e-6)
exr('combined.exr', rgb(LIN, 'ViewLayer.Combined.') | {'ViewLayer.Combined.A': np.ones_like(Y), 'ViewLayer.Depth.Z': np.full_like(Y, 5)},
    peak(lum(LIN, linear)), 'Blender, multilayer', tolerance=2e-6)
exr('depth_and_ids.exr', rgb(LIN) | {'Z': np.full_like(Y, 1e10), 'id': np.full(Y.shape, 7, np.uint32), 'N.X': Y, 'N.Y': Y, 'N.Z': Y},
    peak(lum(LIN, linear)), 'renderers with passes', tolerance=2e-6)
exr('unnamed_first.exr', rgb(LIN) | rgb(1 - LIN, 'diffuse.'), peak(lum(LIN, linear)), 'Arnold, V-Ray: the picture is the layer without a name', tolerance=2e-6)
two = rgb(LIN, 'ViewLayer.Combined.') | rgb(1 - LIN, 'ViewLayer.DiffCol.')
exr('two_layers.exr', two, "refused: 'ViewLayer.Combined', 'ViewLayer.DiffCol'", 'Blender with passes')
exr('two_layers_chosen.exr', two, peak(lum(1 - LIN.astype(float), linear)), 'the same, chosen', options='layer=ViewLayer.DiffCol', tolerance=2e-6)
exr('no_such_layer.exr', two, "refused: no layer 'Beauty'", 'the same, mistyped', options='layer=Beauty')
exr('depth_alone.exr', {'ViewLayer.Depth.Z': Y, 'ViewLayer.Mist.V': Y}, 'refused: no layer of colour', 'Blender, passes alone')
exr('depth_chosen.exr', {'ViewLayer.Depth.Z': Y * 5, 'ViewLayer.Mist.V': Y}, Y, 'the same, a channel chosen', options='layer=ViewLayer.Depth.Z', tolerance=2e-6)
exr('single_channel.exr', {'V': Y}, Y, 'one channel of any name', tolerance=2e-6)
al = (A / 255).astype(np.float32)
exr('alpha.exr', rgb(LIN * al[..., None]) | {'A': al}, peak(lum(LIN.astype(float), linear) * al) + 1 - al, 'compositing', options='background=white', tolerance=2e-6)
# The Python binding writes no channels with fewer samples: by hand, after "OpenEXR File Layout".
def luminance_chroma(zipped):
    attr = lambda n, t, d: n + b'\0' + t + b'\0' + struct.pack('<I', len(d)) + d
    ch = b''.join(n + b'\0' + struct.pack('<IIII', 1, 0, s, s) for n, s in ((b'BY', 2), (b'RY', 2), (b'Y', 1))) + b'\0'
    win = struct.pack('<4i', 0, 0, NX - 1, NY - 1)
    head = (b'\x76\x2f\x31\x01' + struct.pack('<I', 2) + attr(b'channels', b'chlist', ch) + attr(b'compression', b'compression', bytes([3 if zipped else 0]))
            + attr(b'dataWindow', b'box2i', win) + attr(b'displayWindow', b'box2i', win) + attr(b'lineOrder', b'lineOrder', b'\0')
            + attr(b'pixelAspectRatio', b'float', struct.pack('<f', 1)) + attr(b'screenWindowCenter', b'v2f', bytes(8)) + attr(b'screenWindowWidth', b'float', struct.pack('<f', 1)) + b'\0')
    step, chunks = 16 if zipped else 1, []
    for top in range(0, NY, step):
        data = b''
        for row in range(top, min(top + step, NY)):
            if row % 2 == 0: data += np.full(NX, .01, '<f2').tobytes()
            data += Y[row].astype('<f2').tobytes()
        if zipped:
            raw = np.frombuffer(data, np.uint8); raw = np.concatenate([raw[0::2], raw[1::2]]).astype(int)
            delta = np.concatenate([raw[:1], (raw[1:] - raw[:-1] + 128 + 256) % 256]).astype(np.uint8)
            data = min(zlib.compress(delta.tobytes()), data, key=len)
        chunks.append(struct.pack('<iI', top, len(data)) + data)
    at = len(head) + 8 * len(chunks); offsets = b''
    for c in chunks: offsets += struct.pack('<Q', at); at += len(c)
    return head + offsets + b''.join(chunks)
for zipped in (0, 1):
    write(f'luminance_chroma{zipped}.exr', luminance_chroma(zipped), np.float16(Y).astype(float), 'OpenEXR luminance and chroma (RY, BY)', 2e-6)
box = lambda x0, y0, x1, y1: (np.array([x0, y0], np.int32), np.array([x1, y1], np.int32))
windowed = np.zeros((NY + 4, NX + 6)); windowed[1:1 + NY, 4:4 + NX] = peak(lum(LIN, linear))
exr('data_window.exr', rgb(LIN), windowed, 'renderings of a region', header={'dataWindow': box(0, 0, NX - 1, NY - 1), 'displayWindow': box(-4, -1, NX + 1, NY + 2)}, tolerance=2e-6)
exr('chromaticities.exr', rgb(LIN), peak(lum(LIN, linear, weights(R2020, D65))), 'ACES and the like', header={'chromaticities': tuple(float(v) for p in (*R2020, D65) for v in p)}, tolerance=2e-6)
exr('parts.exr', None, "refused: 'left', 'right'", 'Nuke: several parts', parts=[('left', {'RGB': LIN}), ('right', {'RGB': 1 - LIN})])
exr('negative.exr', rgb(LIN - np.float32(.7)), 'refused: never negative', 'filters that ring')

# --- kinds that are not read, and files that are none
write('photo.avif', pil(Image.fromarray(u8(RGB)), 'AVIF'), 'refused: avifdec', 'phones, the web')
write('photo.jp2', pil(Image.fromarray(u8(RGB)), 'JPEG2000'), 'refused: opj_decompress', 'archives')
write('drawing.pdf', b'%PDF-1.7\n' + bytes(64), 'refused: pdftocairo', 'everybody')
write('photo.heic', b'\0\0\0\x18ftypheic\0\0\0\0mif1heic' + bytes(64), 'refused: heif-convert', 'iPhones')
write('photo.jxl', b'\xff\x0a' + bytes(64), 'refused: djxl', 'newest programs')
write('layers.psd', b'8BPS\0\x01' + bytes(64), 'refused: Photoshop', 'Photoshop')
write('page.png', b'<!DOCTYPE html><html><body>Not found</body></html>', 'refused: no picture of a kind', 'downloads that are web pages')
write('empty.png', b'', 'refused: empty', 'disks that were full')
write('compressed.svgz', b'\x1f\x8b\x08\0' + bytes(16), 'refused: gzip -dc', 'Inkscape, compressed')

# --- SVG: the letter F of the chart in rectangles, on half the pixels
def svg(body, size='viewBox="0 0 26 18"', head=''): return f'{head}<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" {size}>{body}</svg>'.encode()
f_shape = '<path d="M4 3h7v2h-5v2h3v2h-3v5h-2z" fill="{}"/>'
drawn = np.where(F, 0., 1.)
write('letter.svg', svg(f_shape.format('black')), drawn, 'Inkscape, Illustrator', options='width=26')
write('letter_on_black.svg', svg(f_shape.format('#808080')), np.where(F, float(srgb(np.float64(128 / 255))), 0), 'the same on black', options='width=26 background=black')
write('letter_sized.svg', svg(f_shape.format('black'), 'width="260mm" height="180mm" viewBox="0 0 26 18"', '<?xml version="1.0"?>\n<!-- made -->\n'), drawn, 'a size in mm does not count', options='width=26')
write('outside.svg', svg('<image href="photo.png" width="26" height="18"/>'), 'refused: photo.png', 'drawings with linked pictures', options='width=26')
write('outside_style.svg', svg('<style>@import url(https://example.org/a.css);</style>'), 'refused: @import', 'web pages', options='width=26')
lol = '<g id="a0"><path d="M0 0h26v18z"/></g>' + ''.join(f'<g id="a{k}">' + f'<use href="#a{k-1}"/>' * 10 + '</g>' for k in range(1, 9))
write('laughs.svg', svg('<defs>' + lol + '</defs><use href="#a8"/>'), 'refused: simplify', 'hostile', options='width=26')
write('dashes.svg', svg('<g stroke="black" stroke-dasharray="1e-3 .001">' + '<path d="M0 0L1000 1000"/>' * 50 + '</g>'), 'refused: simplify', 'hostile', options='width=26')
write('octaves.svg', svg('<filter id="f"><feTurbulence numOctaves="100000000" baseFrequency=".1"/></filter><rect width="26" height="18" filter="url(#f)"/>'), 'refused: numOctaves', 'hostile', options='width=26')
write('deep.svg', svg('<g>' * 5000 + '</g>' * 5000), 'refused: ', 'hostile', options='width=26')
small = io.BytesIO(); Image.fromarray(np.full((2, 2), 128, np.uint8)).save(small, 'PNG')
import base64
write('embedded.svg', svg(f_shape.format('black') + f'<image x="20" y="10" width="4" height="4" style="image-rendering:pixelated" href="data:image/png;base64,{base64.b64encode(small.getvalue()).decode()}"/>'),
      np.where((i >= 20) & (i < 24) & (j >= 10) & (j < 14), float(srgb(np.float64(128 / 255))), drawn), 'drawings with embedded pictures', options='width=26')

with open(f'{here}/list.tsv', 'w') as f:
    f.write('file\toptions\toutcome\ttolerance\tsource\n')
    for row in rows: f.write('\t'.join(row) + '\n')
print(len(rows), 'pictures')
