#!/usr/bin/env python3
"""What a whole `design` costs besides its solver: files, reading them back, tracing, pictures and report.

Runs the program with one STL and with STL, GLB and OBJ, by turns, and prints the medians of the wall times that `-v` and the system
tell. Needs nothing but Python. Run it alone on the machine:

    cargo build --release
    python3 benches/design.py samples/camera/design.toml --rounds 5
"""
import argparse
import os
import re
import resource
import statistics
import subprocess
import tempfile
import time

SETS = {"one STL": ["stl"], "STL, GLB and OBJ": ["stl", "glb", "obj"]}
SPAN = re.compile(r"^\s*([\d.]+)s\s+INFO (.*?): close time\.busy=([\d.]+)(ns|µs|ms|s)\b", re.M)
UNIT = {"ns": 1e-9, "µs": 1e-6, "ms": 1e-3, "s": 1.0}


def run(options, extensions, folder):
    """Seconds of the command, of its solver, of CPU, and of every stage: when it ended after the solver, and how long it took."""
    outputs = [part for e in extensions for part in ("-o", os.path.join(folder, f"block.{e}"))]
    command = [options.program, "design", options.design, "--transfer", "linear", "--offset", "0.1", "--nodes", str(options.nodes)]
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(command + outputs + ["-v"], check=True, capture_output=True, text=True)
    wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    solver = float(re.search(r"solver .*?([\d.]+) s", done.stdout).group(1))
    spans = [(re.sub(r"\{(?:file=\S*\.(\w+)|[^}]*)\}", r" \1", name).strip(), float(end), float(busy) * UNIT[unit])
             for end, name, busy, unit in SPAN.findall(done.stderr)]
    solved = next(end for name, end, _ in spans if name == "solve")
    stages = {name: (end - solved, busy) for name, end, busy in spans if end > solved}
    return wall, solver, cpu, stages


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("design", help="a picture or a design file")
    parser.add_argument("--nodes", type=int, default=1025)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--program", default="target/release/glasswarp")
    options = parser.parse_args()
    runs = {name: [] for name in SETS}
    for _ in range(options.rounds):
        for name, extensions in SETS.items():
            with tempfile.TemporaryDirectory() as folder:
                runs[name].append(run(options, extensions, folder))
    print("| files | whole command | solver | the rest | share of the rest | CPU in all |\n|---|---:|---:|---:|---:|---:|")
    for name, found in runs.items():
        wall, solver, cpu = (statistics.median(column) for column in list(zip(*found))[:3])
        rest = statistics.median(w - s for w, s, *_ in found)
        share = [(w - s) / w for w, s, *_ in found]
        print(f"| {name} | {wall:.2f} s | {solver:.2f} s | {rest:.2f} s "
              f"| {100 * statistics.median(share):.0f} % ({100 * min(share):.0f} to {100 * max(share):.0f}) | {cpu:.2f} s |")
    for name, found in runs.items():
        print(f"\n| {name}: stage | takes | ends, after the solver |\n|---|---:|---:|")
        stages = {stage: [of[stage] for *_, of in found if stage in of] for *_, known in found for stage in known}
        middle = {stage: [statistics.median(column) for column in zip(*times)] for stage, times in stages.items()}
        for stage, (end, busy) in sorted(middle.items(), key=lambda item: item[1][0]):
            print(f"| {stage} | {busy:.2f} s | {end:.2f} s |")


if __name__ == "__main__":
    main()
