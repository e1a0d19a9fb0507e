#!/usr/bin/env python3
"""The verifier's tracer against Embree, on the same mesh and the same rays, one core each, in turns.

    pip install numpy trimesh embreex
    cargo build --release -p glasswarp-verify --example throughput
    python3 verify/benches/embree.py block.stl

Embree finds the first triangle above each ray's start (single rays, robust mode as embreex sets it) and does nothing else.
The verifier follows the whole path: crossing, normal, refraction, whether the light meets the face again, landing point, all
in f64. Both are timed in CPU seconds of one thread. Rays come in random order, which is what memory likes least, and then
row by row of their strata, which is how photons are traced.
"""
import argparse
import pathlib
import statistics
import subprocess
import tempfile
import time

import numpy as np
import trimesh
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("block")
parser.add_argument("--rays", type=int, default=2_000_000)
parser.add_argument("--rounds", type=int, default=5)
parser.add_argument("--example", default="target/release/examples/throughput")
options = parser.parse_args()

mesh = trimesh.load(options.block, process=False)
lower, upper = mesh.bounds
random = np.random.default_rng(1)
across = int(np.ceil(np.sqrt(options.rays)))
row, column = np.divmod(np.arange(options.rays), across)
strata = (np.column_stack([column, row]) + random.random((options.rays, 2))) / across
orders = {"in random order": random.random((options.rays, 2)), "row by row, as photons are traced": strata}
scene = EmbreeScene(robust=True)
TriangleMesh(scene, mesh.triangles.astype(np.float32))
print(f"{options.block}: {len(mesh.faces)} triangles, {options.rays} rays, median of {options.rounds} rounds")

for order, unit in orders.items():
    starts = lower[:2] + unit * (upper - lower)[:2]
    origins = np.column_stack([starts, np.full(options.rays, lower[2] + 1e-3)])
    origins = origins.astype(np.float32)  # just above the entry face
    directions = np.tile(np.float32([0, 0, 1]), (options.rays, 1))
    rates = {}
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "starts")
        starts.astype("<f8").tofile(file)
        scene.run(origins[:1000], directions[:1000])  # builds its hierarchy
        for _ in range(options.rounds):
            begin = time.process_time()
            hits = scene.run(origins, directions)
            rates.setdefault("Embree, first hit only", []).append(options.rays / (time.process_time() - begin))
            command = [options.example, options.block, file]
            out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            for line in out.splitlines():
                name, seconds, _ = line.split("\t")
                rates.setdefault(name, []).append(options.rays / float(seconds))
    print(f"rays {order}; {(hits < 0).sum()} missed by Embree")
    embree = rates["Embree, first hit only"]
    for name, values in rates.items():
        ratio = statistics.median(ours / theirs for ours, theirs in zip(values, embree))
        middle = statistics.median(values) / 1e6
        print(f"  {name:32} {middle:7.3f} million per second and core, {ratio:5.2f} of Embree")
