#!/usr/bin/env python3
"""Shoots shapes through the paper's integrator in every way, under every noise, and prints the table of
docs/shooting_checked.md.

Usage: benchmarks/shooting_table.py PULSON SAMPLE_SHAPES. On a line 12 markers that are stretched and shifted, in the plane
the ellipses of the samples, in space 12 points on a helix that is bent. Each cell: J (as steps tend to 0, where the noise
is not drawn), the rms in sigma where it is not matched, the CPU seconds of the whole command, and its exit code where it is
not 0.
"""
import json
import math
import os
import pathlib
import resource
import subprocess
import sys
import tempfile

NOISES = ["none", "ch-sd:beta=10%", "ch-sd-screened:beta=10%,gamma={gamma}", "p-sd:beta=10%,fields=grid",
          "kunita:beta=10%", "trouve-vialard:sigma=10%", "potential:beta=0.1,gamma={gamma}", "langevin:sigma=10%"]
LINEAR = ("ch-sd", "ch-sd-screened", "p-sd", "kunita")
LONGEST = 20  # seconds
WAYS = {"deterministic": [], "metamorphosis": [], "map": [], "pathwise": [], "expected": ["--samples", "8"]}


def write_points(path, points):
    path.write_text("".join(",".join(f"{x:.6f}" for x in p) + "\n" for p in points))
    return path


def pairs(folder, samples):
    line = [[i + 0.3 * math.sin(2 * i)] for i in range(12)]
    moved = [[1.1 * x + 0.6 * math.sin(0.7 * x)] for (x,) in line]
    helix = [[math.cos(0.6 * i), math.sin(0.6 * i), 0.2 * i] for i in range(12)]
    bent = [[x + 0.15 * z * z, y - 0.2 * x * y, 1.2 * z + 0.2 * x] for x, y, z in helix]
    return {1: (write_points(folder / "line.csv", line), write_points(folder / "moved.csv", moved), 1.0),
            2: (samples / "ellipse_source.csv", samples / "ellipse_target.csv", 0.1),
            3: (write_points(folder / "helix.csv", helix), write_points(folder / "bent.csv", bent), 0.5)}


def cell(pulson, source, target, noise, way, more, out):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run([pulson, "register", source, target, "-o", out, "--no-picture", "--quiet", "--solver",
                               "shooting", "--noise", noise, "--mode", way, *more],
                              capture_output=True, text=True, check=False, timeout=LONGEST)
    except subprocess.TimeoutExpired:
        return f"> {LONGEST} s"
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if done.returncode not in (0, 3):
        return "refused"
    record = json.loads((out / "registration.json").read_text())
    cost = record.get("extrapolated", record)["cost"]["total"]
    text = f"{cost:.4g}"
    if not record["matched"]:
        text += f", {record['rms'] / record['sigma']:.0f} σ"
    text += f", {seconds:.1f} s"
    return text + (f", exit {done.returncode}" if done.returncode else "")


def main():
    pulson, samples = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        print("| noise | dimension | " + " | ".join(f"`{way}`" for way in WAYS) + " |")
        print("|---" * (len(WAYS) + 2) + "|")
        shapes = pairs(folder, samples)
        for spec in NOISES:
            for d, (source, target, gamma) in shapes.items():
                noise = spec.format(gamma=gamma)
                row = []
                for way, more in WAYS.items():
                    kind = noise.split(":")[0]
                    if (kind == "none") != (way == "deterministic") or (way == "metamorphosis" and kind not in LINEAR):
                        row.append("–")
                    else:
                        row.append(cell(pulson, source, target, noise, way, more, folder / "out"))
                print(f"| `{noise}` | {d} | " + " | ".join(row) + " |", flush=True)


main()
