#!/usr/bin/env python3
"""Makes blocks for many benches and pictures, and writes the table of docs/benches.md: how well each draws its picture, by the
verifier, beside the rectangular block of the same picture in straight parallel light.

    cargo build --release
    python3 benches/any_bench.py [--nodes 641] [--pictures a.png b.png ...] [--only NAME] [--write docs/benches.md]
"""

import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Name, flags, and what the picture is cut to first.
BENCHES = [
    ("straight parallel light, glass", ""),
    ("mirror, straight", "--mirror"),
    ("mirror, light at 30 degrees", "--mirror --tilt 30deg"),
    ("glass, light at 10 degrees", "--tilt 10deg"),
    ("glass, light at 30 degrees", "--tilt 30deg"),
    ("glass, light at 30 degrees from the right", "--tilt 30deg,90deg"),
    ("point source at 300 mm", "--source-distance 300mm"),
    ("point source at 300 mm, picture as large as the block", "--source-distance 300mm --window 100mm"),
    ("point source at 1 m", "--source-distance 1m"),
    ("torch at 500 mm, half as bright at 8 degrees", "--source-distance 500mm --emission gaussian:8deg"),
    ("mirror, torch at 500 mm, 20 degrees from the top", "--mirror --source-distance 500mm --tilt 20deg --emission lambertian"),
    ("window 50 mm", "--window 50mm"),
    ("window 150 mm", "--window 150mm"),
    ("window 200 mm", "--window 200mm"),
    ("shifted to the right by a quarter", "--shift 25mm,0mm"),
    ("receiver leaning by 20 degrees", "--receiver-tilt 20deg"),
    ("receiver leaning by 20 degrees to the right, light at 20 degrees", "--receiver-tilt 20deg,90deg --tilt 20deg"),
    ("receiver leaning by 20 degrees, point source at 300 mm", "--receiver-tilt 20deg --source-distance 300mm"),
]
# Other outlines: name, flags, and those of the rectangle that they are compared with.
ROUND_PICTURE = "--vignette circle:0.05"
ROUND = [
    ("disc with the square picture", "--outline circle", ""),
    ("disc with a round picture", f"--outline circle {ROUND_PICTURE}", ROUND_PICTURE),
    ("corners rounded by 10 mm", "--outline rounded:10mm", ""),
]
SHAPES = [("aspect 3:2", (3, 2)), ("aspect 1:2", (1, 2))]
# Asked: no bench more than this times as wrong as straight parallel light.
LIMIT = 1.3


def judge(binary, picture, flags, nodes, folder):
    """Error, SSIM, share of the light in the window, and what the program warns of."""
    command = [binary, "design", str(picture), "--nodes", str(nodes), "--offset", "0.1", "--transfer", "linear", "-v", "-o", str(folder / "block.stl")]
    done = subprocess.run(command + flags.split(), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)} {flags}\n{done.stderr}")
    number = lambda pattern: float(re.search(pattern, done.stdout).group(1))
    return (
        number(r"relative RMS +([0-9.]+)"),
        number(r"SSIM +([0-9.]+)"),
        number(r"light +([0-9.]+) % in the window"),
        [line for line in done.stderr.splitlines() if line.startswith("warning")],
    )


def width(picture):
    with Image.open(picture) as image:
        return image.width


def cut(picture, aspect, folder):
    image = Image.open(picture).convert("L")
    wide = min(image.width, image.height * aspect[0] // aspect[1])
    high = wide * aspect[1] // aspect[0]
    left, top = (image.width - wide) // 2, (image.height - high) // 2
    path = folder / f"cut-{pathlib.Path(picture).stem}-{aspect[0]}-{aspect[1]}.png"
    image.crop((left, top, left + wide, top + high)).save(path)
    return path


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=int, default=641)
    parser.add_argument("--pictures", nargs="+", default=[str(ROOT / "samples/camera/target.png")])
    parser.add_argument("--binary", default=str(ROOT / "target/release/glasswarp"))
    parser.add_argument("--only", help="only benches with this in their name")
    parser.add_argument("--write", help="the page whose table is replaced")
    arguments = parser.parse_args()
    rows, worst = [], 0.0
    names = [pathlib.Path(p).stem if pathlib.Path(p).stem != "target" else pathlib.Path(p).parent.name for p in arguments.pictures]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        straight = {p: judge(arguments.binary, p, "", arguments.nodes, folder)[0] for p in arguments.pictures}
        cases = [(name, flags, None, "") for name, flags in BENCHES] + [(name, "", aspect, "") for name, aspect in SHAPES]
        cases += [(name, flags, None, reference) for name, flags, reference in ROUND]
        for name, flags, aspect, reference in cases:
            if arguments.only and arguments.only not in name:
                continue
            cells = []
            for picture in arguments.pictures:
                shown = cut(picture, aspect, folder) if aspect else picture
                # As many nodes per pixel as for the whole picture.
                nodes = 1 + round((arguments.nodes - 1) * width(shown) / width(picture))
                error, ssim, inside, warnings = judge(arguments.binary, shown, flags, nodes, folder)
                beside = judge(arguments.binary, picture, reference, arguments.nodes, folder)[0] if reference else straight[picture]
                ratio = error / beside
                worst = max(worst, ratio)
                cells.append(f"{error:.4f} ({ratio:.2f}) | {ssim:.4f} | {inside:.2f} %")
                folds = [w for w in warnings if "folds" in w]
                print(f"{name:60} {pathlib.Path(picture).stem:10} {error:.4f} {ratio:5.2f} {ssim:.4f} {inside:7.2f} %  {folds}", flush=True)
            rows.append(f"| {name} | `{flags}` | " + " | ".join(cells) + " |")
    head = "| bench | flags | " + " | ".join(f"{n}: error (ratio) | SSIM | light in the window" for n in names) + " |"
    table = "\n".join([head, "|---" * (2 + 3 * len(names)) + "|", *rows])
    if arguments.write:
        page = pathlib.Path(arguments.write)
        text = page.read_text()
        begin, end = "<!-- table begins -->\n", "<!-- table ends -->"
        before, rest = text.split(begin)
        page.write_text(before + begin + table + "\n" + end + rest.split(end)[1])
    else:
        print(table)
    print(f"worst ratio {worst:.2f}, asked {LIMIT}", file=sys.stderr)
    sys.exit(worst > LIMIT)


if __name__ == "__main__":
    main()
