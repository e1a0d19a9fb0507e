#!/usr/bin/env python3
"""Makes pairs of blocks for light that is not perfect, without and with deconvolution, looks at both in that light by tracing, and
writes the table and the picture of docs/imperfect-light.md.

    cargo build --release
    python3 benches/imperfect_light.py [--nodes 641] [--photons 16777216] [--write docs/imperfect-light.md]
"""

import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy
from PIL import Image, ImageDraw

ROOT = pathlib.Path(__file__).resolve().parent.parent
PIXELS = 256
# Name, flags, and the ways of deconvolution that are tried.
CASES = [
    ("sun, receiver at 250 mm", "--source-size sun", ["off", "paper", "window"]),
    ("sun, receiver at 1 m", "--source-size sun --distance 1m", ["off", "window"]),
    ("LED of 3 mm, 300 mm away", "--source-distance 300mm --window 100mm --source-size 3mm", ["off", "window"]),
    ("roughness of 0.1 degrees, 1025 nodes", "--roughness 0.1deg --nodes 1025", ["off", "window"]),
    ("roughness of 0.1 degrees, 641 nodes", "--roughness 0.1deg --nodes 641", ["off", "window"]),
    ("a measured speck", "--psf SPECK,0.05mm", ["off", "window"]),
]


def speck(path):
    """A speck as polish leaves it: a sharp core, a halo, a smear to one side."""
    y, x = (numpy.mgrid[0:61, 0:61] - 30) * 0.05
    light = numpy.exp(-(x**2 + y**2) / (2 * 0.15**2)) + 0.25 * numpy.exp(-((x - 0.2) ** 2 / (2 * 0.5**2) + y**2 / (2 * 0.25**2)))
    light[light < 0.002] = 0
    Image.fromarray(numpy.round(light / light.max() * 65535).astype(numpy.uint16)).save(path)


def run(command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return done.stdout


def one(arguments, flags, how, folder):
    """Error and SSIM in the light that there is, what was said of the deconvolution, and the picture."""
    stl, light = folder / "block.stl", folder / "light.png"
    if "--nodes" not in flags:
        flags = f"{flags} --nodes {arguments.nodes}"
    design = [arguments.binary, "design", "-v", arguments.picture, "--offset", "0.1"]
    said = run(design + ["--transfer", "linear", "--no-verify", "--no-report", "--deconvolution", how, "-o", str(stl)] + flags.split())
    verify = [arguments.binary, "verify"]
    if "--psf" in flags:
        # A tracer knows nothing of a measured speck: it is convolved with the light that was traced.
        seen = run(verify + [str(stl), "--photons", "1000000", "-o", str(light)])
        seen = seen[seen.index("In the light that there is") :]
    else:
        tally = folder / "tally.exr"
        photons = ["--photons", str(arguments.photons), "--replicates", "32", "--pixels", str(PIXELS)]
        run(verify + [str(stl), "--tally", str(tally)] + photons)
        judged = ["--target", arguments.picture, "--offset", "0.1", "--transfer", "linear"]
        seen = run(verify + ["merge", str(tally), "-o", str(light)] + judged)
    number = lambda pattern, text: (lambda found: float(found.group(1)) if found else None)(re.search(pattern, text))
    return {
        "error": number(r"relative RMS +([0-9.]+)", seen),
        "noise": number(r"relative RMS +[0-9.]+ \+- ([0-9.]+)", seen),
        "ssim": number(r"SSIM +([0-9.]+)", seen),
        "grain": number(r"noise +([0-9.]+) of the mean", seen),
        "contrast": number(r"light to draw ([0-9.]+)", said),
        "spread": number(r"spread +([0-9.]+) mm", said),
        "expected": number(r"relative RMS ([0-9.]+) instead", said),
        "picture": numpy.asarray(Image.open(light), float) / 65535,
    }


def screen(light):
    """Linear light, 1 white, as a screen shows it."""
    light = numpy.clip(light, 0, 1)
    return Image.fromarray((255 * numpy.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)).round().astype(numpy.uint8))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=int, default=641)
    parser.add_argument("--photons", type=int, default=16_777_216)
    parser.add_argument("--picture", default=str(ROOT / "samples/camera/target.png"))
    parser.add_argument("--binary", default=str(ROOT / "target/release/glasswarp"))
    parser.add_argument("--only", default="", help="cases whose name has this in it")
    parser.add_argument("--write", help="the page whose table is replaced; its picture goes to figures/ beside it")
    arguments = parser.parse_args()
    rows, pairs = [], []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        speck(folder / "speck.png")
        for name, flags, ways in CASES:
            if arguments.only not in name:
                continue
            flags = flags.replace("SPECK", str(folder / "speck.png"))
            found = {how: one(arguments, flags, how, folder) for how in ways}
            print(name, {how: {k: v for k, v in f.items() if k != "picture"} for how, f in found.items()}, flush=True)
            without = found["off"]
            for how in ways[1:]:
                given = found[how]
                title = name if how == "window" else f"{name}, as the paper does"
                noise = f" ± {given['noise']:.4f}" if given["noise"] is not None else ""
                rows.append(
                    f"| {title} | {given['spread']:.2f} mm | {without['error']:.4f} | {given['error']:.4f}{noise} | "
                    f"{without['ssim']:.3f} | {given['ssim']:.3f} | {given['expected']:.4f} | {given['contrast']:.0f} |"
                )
            pairs.append((name, without["picture"], found["window"]["picture"]))
    head = (
        "| light | spread | relative RMS without | with | SSIM without | with | expected | contrast to draw |\n"
        "|---|---:|---:|---:|---:|---:|---:|---:|"
    )
    table = "\n".join([head] + rows)
    print(table)
    if not arguments.write:
        return
    page = pathlib.Path(arguments.write)
    text = page.read_text()
    before, after = text.split("<!-- table begins -->")[0], text.split("<!-- table ends -->")[1]
    page.write_text(f"{before}<!-- table begins -->\n{table}\n<!-- table ends -->{after}")
    shown = pairs[:4]
    sheet = Image.new("L", (2 * PIXELS + 4, len(shown) * (PIXELS + 18)), 255)
    ink = ImageDraw.Draw(sheet)
    for k, (name, left, right) in enumerate(shown):
        top = k * (PIXELS + 18)
        ink.text((2, top + 3), f"{name}: without deconvolution, and with it", fill=0)
        sheet.paste(screen(left), (0, top + 16))
        sheet.paste(screen(right), (PIXELS + 4, top + 16))
    sheet.save(page.parent / "figures/imperfect-light.png", optimize=True)


if __name__ == "__main__":
    main()
