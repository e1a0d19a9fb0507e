"""The files of a block as numbers: binary STL, PNG, and the OpenEXR images that glasswarp writes. numpy and Python's own zlib."""

import struct
import zlib

import numpy as np


def stl(path):
    """The vertices of a binary STL, each once: n x 3, mm."""
    data = path.read_bytes()
    (count,) = struct.unpack_from("<I", data, 80)
    if len(data) != 84 + 50 * count:
        raise SystemExit(f"{path}: no binary STL of {count} triangles")
    triangle = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
    corners = np.frombuffer(data, triangle, count, 84)["vertices"].reshape(-1, 3)
    return np.unique(corners, axis=0).astype(float)


def picture(path, transfer):
    """A PNG as light, 0 to 1: luminance of linear Rec. 709, light behind transparent parts black. Without a transfer it must be a plain
    picture for screens."""
    pixels = png(path, [b"eXIf"] if transfer else [b"eXIf", b"iCCP", b"gAMA", b"cICP"])
    colours, alpha = (pixels[..., :-1], pixels[..., -1]) if pixels.shape[-1] in (2, 4) else (pixels, 1.0)
    if transfer in (None, "srgb"):
        colours = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    elif transfer != "linear":
        raise SystemExit(f"the transfer '{transfer}' is not one of docs/side-file.md")
    weights = [1.0] if colours.shape[-1] == 1 else [0.2126, 0.7152, 0.0722]
    return (colours @ weights) * alpha


def png(path, refused):
    """Pixels of a PNG of 8 or 16 bits without a palette and these chunks, 0 to 1: rows x columns x channels."""
    data = path.read_bytes()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise SystemExit(f"{path}: no PNG, the only kind of picture that is read here")
    at, packed, header = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8 : at + 8 + size]
        at += 12 + size
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        elif kind in refused:
            raise SystemExit(f"{path}: the chunk {kind.decode()} is not followed here")
    columns, rows, depth, colour, _, _, interlaced = header
    channels = {0: 1, 2: 3, 4: 2, 6: 4}.get(colour)
    if channels is None or depth not in (8, 16) or interlaced:
        raise SystemExit(f"{path}: colour type {colour}, {depth} bits, interlaced {interlaced} is not read here")
    step = channels * depth // 8
    raw = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(rows, 1 + columns * step)
    lines = np.zeros((rows + 1, columns + 1, step), np.int64)  # a row and a column of zeros before the picture
    for row in range(rows):
        method, line = raw[row, 0], raw[row, 1:].reshape(columns, step).astype(np.int64)
        above = lines[row]
        if method == 0:
            lines[row + 1, 1:] = line
        elif method == 1:
            lines[row + 1, 1:] = np.cumsum(line, 0) % 256
        elif method == 2:
            lines[row + 1, 1:] = (line + above[1:]) % 256
        else:
            this = lines[row + 1]
            for k in range(columns):
                left, up, corner = this[k], above[k + 1], above[k]
                if method == 3:
                    guess = (left + up) // 2
                else:
                    to = left + up - corner
                    a, b, c = abs(to - left), abs(to - up), abs(to - corner)
                    guess = np.where((a <= b) & (a <= c), left, np.where(b <= c, up, corner))
                this[k + 1] = (line[k] + guess) % 256
    pixels = lines[1:, 1:].astype(np.uint8).tobytes()
    kind, white = (">u1", 255) if depth == 8 else (">u2", 65535)
    return np.frombuffer(pixels, kind).reshape(rows, columns, channels) / white


def write_png(path, image):
    """Writes numbers from 0 to 1 as grey of 16 bits, linear."""
    grey = np.rint(np.clip(image, 0, 1) * 65535).astype(">u2")
    rows, columns = grey.shape
    lines = b"".join(b"\0" + line.tobytes() for line in grey)
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    header = struct.pack(">IIBBBBB", columns, rows, 16, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b""))


def exr(path):
    """The one channel of 32-bit floats of an OpenEXR file in tiles, packed by run lengths: what glasswarp writes."""
    data = path.read_bytes()
    magic, version = struct.unpack_from("<II", data)
    at, attributes = 8, {}
    if magic != 20000630 or version & 0xFF != 2 or version & 0x1800:
        raise SystemExit(f"{path}: no OpenEXR file of one plain part")
    while data[at]:
        name, at = data[at : data.index(0, at)], data.index(0, at) + 1
        at = data.index(0, at) + 1
        (size,) = struct.unpack_from("<I", data, at)
        attributes[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    x0, y0, x1, y1 = struct.unpack("<4i", attributes[b"dataWindow"])
    columns, rows = x1 - x0 + 1, y1 - y0 + 1
    if attributes[b"compression"] != b"\1" or b"tiles" not in attributes or attributes[b"channels"].count(b"\2\0\0\0") != 1:
        raise SystemExit(f"{path}: not one channel of 32-bit floats in tiles packed by run lengths")
    wide, high = struct.unpack_from("<II", attributes[b"tiles"])
    across, down = -(-columns // wide), -(-rows // high)
    offsets = struct.unpack_from(f"<{across * down}Q", data, at + 1)
    image = np.zeros((rows, columns))
    for offset in offsets:
        i, j, _, _, size = struct.unpack_from("<5i", data, offset)
        packed = data[offset + 20 : offset + 20 + size]
        x, y = i * wide, j * high
        w, h = min(wide, columns - x), min(high, rows - y)
        if size < 4 * w * h:
            packed = unpacked(packed)
        image[y : y + h, x : x + w] = np.frombuffer(packed, "<f4").reshape(h, w)
    return image


def unpacked(packed):
    """Run lengths, differences and the order of bytes undone."""
    out, at = bytearray(), 0
    while at < len(packed):
        count = packed[at] - 256 if packed[at] > 127 else packed[at]
        if count < 0:
            out += packed[at + 1 : at + 1 - count]
            at += 1 - count
        else:
            out += packed[at + 1 : at + 2] * (count + 1)
            at += 2
    steps = np.frombuffer(bytes(out), np.uint8).astype(np.int64)
    steps[1:] -= 128
    numbers = (np.cumsum(steps) % 256).astype(np.uint8)
    half = (len(numbers) + 1) // 2
    whole = np.empty(len(numbers), np.uint8)
    whole[0::2], whole[1::2] = numbers[:half], numbers[half:]
    return whole.tobytes()
