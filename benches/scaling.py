#!/usr/bin/env python3
"""Time and memory of the solvers from 257 to 4097 nodes a side, in units of one pair of cosine transforms.

The unit is a DCT-I of 1025 x 1025 values and its inverse by pocketfft (SciPy) on one thread, measured before and after
every solve of the same run, so that the figures can be compared between machines. Needs numpy, scipy, pillow and, for the
plot, matplotlib. Run it alone on the machine:

    cargo build --release
    python3 benches/scaling.py picture.png [--plot docs/figures/scaling.png] [--most 4097]
"""
import argparse
import os
import re
import statistics
import subprocess
import tempfile
import time

import numpy as np
from PIL import Image
from scipy.fft import dctn, idctn

PEERS = [("transport", "normal"), ("transport", "draft"), ("warping", None), ("warping-paper", None)]


def pair(repeats=5):
    """Median wall time of a pair of transforms, s."""
    values = np.random.default_rng(1).standard_normal((1025, 1025))
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        idctn(dctn(values, type=1, workers=1), type=1, workers=1)
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def design(program, picture, nodes, solver, quality, folder):
    """Wall time of the solver, s, and the peak memory of the whole command, GB (at least that of this script, which starts it)."""
    command = [program, "design", picture, "--transfer", "linear", "--nodes", str(nodes), "--solver", solver,
               "--no-verify", "-v", "-o", os.path.join(folder, "block.stl")]
    if quality:
        command += ["--quality", quality]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    text = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise SystemExit(text)
    return float(re.search(r"iterations, ([0-9.]+) s", text)[1]), usage.ru_maxrss / 1e6


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("picture")
    parser.add_argument("--program", default="target/release/glasswarp")
    parser.add_argument("--plot")
    parser.add_argument("--most", type=int, default=4097)
    parser.add_argument("--warping-most", type=int, default=1025, help="largest size for the warping solvers")
    arguments = parser.parse_args()
    sizes = [n for n in (257, 513, 641, 1025, 2049, 4097) if n <= arguments.most]
    source = Image.open(arguments.picture).convert("L")
    rows = []
    print(f"{'solver':<22} {'nodes':>5} {'pixels':>6} {'s':>8} {'pairs':>7} {'GB':>6}")
    with tempfile.TemporaryDirectory() as folder:
        for nodes in sizes:
            pixels = (nodes - 1) // 2
            picture = os.path.join(folder, "picture.png")
            source.resize((pixels, pixels), Image.LANCZOS).save(picture)
            for solver, quality in PEERS:
                if solver != "transport" and nodes > arguments.warping_most:
                    continue
                before = pair()
                seconds, memory = design(arguments.program, picture, nodes, solver, quality, folder)
                unit = 0.5 * (before + pair())
                name = f"{solver}, {quality}" if quality else solver
                rows.append((name, nodes, seconds, seconds / unit, memory))
                print(f"{name:<22} {nodes:>5} {pixels:>6} {seconds:>8.2f} {seconds / unit:>7.1f} {memory:>6.2f}", flush=True)
    if arguments.plot:
        plot(rows, arguments.plot)


def plot(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(10, 4), dpi=110)
    for name in dict.fromkeys(row[0] for row in rows):
        points = [row for row in rows if row[0] == name]
        nodes = [row[1] for row in points]
        left.loglog(nodes, [row[3] for row in points], "o-", label=name)
        right.loglog(nodes, [row[4] for row in points], "o-", label=name)
    nodes = np.array([257.0, 4097.0])
    first = next(row for row in rows if row[1] == min(r[1] for r in rows))
    left.loglog(nodes, first[3] * (nodes / first[1]) ** 2, ":", color="grey", label="proportional to the nodes")
    left.set_ylabel("solver's time, in pairs of transforms")
    right.set_ylabel("peak memory of the command, GB")
    for axes in (left, right):
        axes.set_xlabel("nodes a side (picture: half as many pixels)")
        axes.set_xticks([257, 513, 1025, 2049, 4097], ["257", "513", "1025", "2049", "4097"])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
    left.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path)


if __name__ == "__main__":
    main()
