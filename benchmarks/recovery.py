#!/usr/bin/env python3
"""How often is the default verdict of `pulson compare` right, and are its numbers? Cohorts of an independent simulator.

    benchmarks/recovery.py PULSON FOLDER --shapes 10 --landmarks 6 --noise ch-sd:0.1 [--count 100] [--sigma-known] [OPTION ...]

Each cohort is an oval moved by momenta N(0, (lambda K)^-1), K Gaussian of width 0.5, by noise, by digitising error and by
a similarity, all by numpy; the program sees a file and its own defaults (Procrustes mean of the same shapes, every noise
model, width, sigma and lambda fitted). With --sigma-known it is told the error. FOLDER keeps one line of JSON for each
cohort, so that a study goes on where it stopped. Further OPTIONs are for `pulson compare`.

Noise: none; ch-sd:BETA, increments of positions; p-sd:BETA:WIDTH, momenta pushed by BETA times the gradients of a 3 x 3
grid of Gaussian bumps; tv:SIGMA, momenta pushed by SIGMA white noise (Trouve and Vialard).
"""
import argparse
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

ALPHA, STEPS = 0.5, 40


def oval(landmarks):
    angle = 2 * math.pi * np.arange(landmarks) / landmarks
    return np.c_[np.cos(angle), 0.7 * np.sin(angle)]


def gram(q):
    difference = q[:, None] - q[None]
    return np.exp(-np.sum(difference**2, axis=2) / (2 * ALPHA**2)), difference


def derivative(q, p):
    """dq/dt and dp/dt of H = 1/2 sum p_a.p_b K(q_a - q_b)."""
    k, difference = gram(q)
    return k @ p, np.einsum("ab,abi->ai", (p @ p.T) * k, difference) / ALPHA**2


def bumps(q, width):
    """Gradients of 3 x 3 Gaussian bumps on the box of the oval at q: (9, N, 2)."""
    centres = np.array([[x, y] for x in (-1, 0, 1) for y in (-0.7, 0, 0.7)])
    difference = q[None] - centres[:, None]
    return -difference / width**2 * np.exp(-np.sum(difference**2, axis=2) / (2 * width**2))[:, :, None]


def shape(source, noise, lam, rng):
    """One shape by the stochastic Heun scheme; bumps are of positions, so that Stratonovich and Ito agree."""
    kind, *numbers = noise.split(":")
    numbers = [float(x) for x in numbers]
    q = source.copy()
    k, _ = gram(q)
    p = np.linalg.solve(np.linalg.cholesky(lam * (k + 1e-10 * np.eye(len(q)))).T, rng.normal(size=q.shape))
    dt = 1 / STEPS
    for _ in range(STEPS):
        dq = np.zeros_like(q)
        dp = np.zeros_like(q)
        if kind == "ch-sd":
            dq = numbers[0] * math.sqrt(dt) * rng.normal(size=q.shape)
        elif kind == "tv":
            dp = numbers[0] * math.sqrt(dt) * rng.normal(size=q.shape)
        elif kind == "p-sd":
            weights = numbers[0] * math.sqrt(dt) * rng.normal(size=9)
            dp = -np.einsum("c,cai->ai", weights, bumps(q, numbers[1]))
        u, f = derivative(q, p)
        q1, p1 = q + dt * u + dq, p + dt * f + dp
        if kind == "p-sd":
            dp = 0.5 * (dp - np.einsum("c,cai->ai", weights, bumps(q1, numbers[1])))
        u1, f1 = derivative(q1, p1)
        q, p = q + dt / 2 * (u + u1) + dq, p + dt / 2 * (f + f1) + dp
    return q


def cohort(arguments, seed):
    rng = np.random.default_rng([seed, arguments.shapes, arguments.landmarks])
    source = oval(arguments.landmarks)
    moved = []
    while len(moved) < arguments.shapes:
        q = shape(source, arguments.noise, arguments.lam, rng)
        if np.all(np.isfinite(q)) and np.max(np.abs(q)) < 10:
            moved.append(q)
    digitised = []
    for q in moved:
        q = q + arguments.sigma * rng.normal(size=q.shape)
        angle, scale = rng.uniform(0, 2 * math.pi), math.exp(0.1 * rng.normal())
        turn = scale * np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        digitised.append(q @ turn.T)
    # A size of all shapes has no meaning to a similarity but for the units of width and lambda, which are those of the source:
    # their mean has its size. Moved shapes are larger than the source, and the mean of 20 sizes is 2 % off by chance.
    unit = centroid_size(source) / np.mean([centroid_size(q) for q in digitised])
    return [unit * q + rng.normal(size=2) for q in digitised]


def centroid_size(q):
    return math.sqrt(np.sum((q - q.mean(axis=0)) ** 2))


def write(path, shapes):
    with open(path, "w", encoding="utf-8") as file:
        for i, q in enumerate(shapes):
            file.write(f"LM={len(q)}\n" + "".join(f"{x:.10g} {y:.10g}\n" for x, y in q) + f"ID=s{i + 1}\n")


def run(arguments, seed, scratch):
    file, out = os.path.join(scratch, "cohort.tps"), os.path.join(scratch, "out")
    write(file, cohort(arguments, seed))
    command = [arguments.pulson, "compare", file, "-o", out, "--no-picture", "--quiet", "--seed", str(seed), *arguments.more]
    if arguments.sigma_known:
        command += ["--sigma", str(arguments.sigma)]
    for model in arguments.model:
        command += ["--noise", model]
    before = os.times()
    done = subprocess.run(command, capture_output=True, text=True)
    after = os.times()
    if done.returncode not in (0, 3):
        sys.exit(done.stderr)
    record = json.load(open(os.path.join(out, "comparison.json"), encoding="utf-8"))
    return {"seed": seed, "exit_code": done.returncode, "record": record,
            "cpu": after.children_user - before.children_user + after.children_system - before.children_system}


def aligned_variance(source, shapes):
    """Of coordinates about the source, position, direction and size taken out."""
    centred = source - source.mean(axis=0)
    total = 0
    for q in shapes:
        q = q - q.mean(axis=0)
        u, s, v = np.linalg.svd(q.T @ centred)
        total += np.mean((s.sum() / np.sum(q**2) * q @ u @ v - centred) ** 2)
    return total / len(shapes)


def true_share(arguments, count=2000):
    """What noise alone and momenta alone make of the variance."""
    rng = np.random.default_rng(5)
    source = oval(arguments.landmarks)
    of_noise = aligned_variance(source, [shape(source, arguments.noise, 1e12, rng) for _ in range(count)])
    of_momenta = aligned_variance(source, [shape(source, "none", arguments.lam, rng) for _ in range(count)])
    return of_noise / (of_noise + of_momenta)


CANDIDATES = {"ch-sd": "ch-sd", "p-sd": "p-sd", "tv": "trouve-vialard"}


def mean_text(values):
    values = np.asarray(values, dtype=float)
    return f"{values.mean():.3f} ± {values.std(ddof=1) / math.sqrt(len(values)):.3f}" if len(values) > 1 else ""


def coverage(numbers, true):
    """How many intervals of 90 % hold, of those that have an end; null is none."""
    stated = [number["interval_90"] for number in numbers if number["interval_90"] != [None, None]]
    held = sum((low is None or low <= true) and (high is None or high >= true) for low, high in stated)
    return f"{held} of {len(stated)}"


def table(arguments, lines):
    """A row of the docs' tables."""
    records = [line["record"] for line in lines]
    kind, *numbers = arguments.noise.split(":")
    share = 0 if kind == "none" else true_share(arguments)
    texts = [record["verdict"]["text"] for record in records]
    preferred = sum(text.startswith("these shapes are best explained by") and not text.endswith(" none") for text in texts)
    favoured = sum(text.startswith("these shapes favour") for text in texts)
    enough = sum("is enough" in text for text in texts)
    nothing = sum("say nothing of any model" in text for text in texts)
    cells = [arguments.noise, f"{len(lines)}", f"{100 * share:.0f} %", f"{preferred}", f"{favoured}", f"{enough}", f"{nothing}"]
    name = CANDIDATES.get(kind)
    fits = [next(model for model in record["models"] if model["noise"].startswith(name or "none")) for record in records]
    within = [fit["greatest_noise_share"] >= share for fit in fits]
    cells.append(f"{sum(within)} of {len(within)}" if name else "")
    cells.append(mean_text([arguments.lam / fit["lambda"] if fit["lambda"] else 0 for fit in fits]))
    amplitude = {"ch-sd": "beta", "tv": "sigma"}.get(kind)  # that of p-sd is of the width that the program assumes
    cells.append(mean_text([(number["value"] / float(numbers[0])) ** 2 for fit in fits for number in fit["fitted"]
                            if number["name"] == amplitude]))
    true = {"lambda": arguments.lam, "alpha": math.sqrt(2) * ALPHA}
    if amplitude:
        true[amplitude] = float(numbers[0])
    fitted = {key: [number for fit in fits for number in fit["fitted"] if number["name"] == key] for key in true}
    cells.append(mean_text([math.log(number["value"] / true["alpha"]) for number in fitted["alpha"]]))
    cells.append(", ".join(f"{key} {coverage(fitted[key], true[key])}" for key in fitted))
    converged = [model["converged"] for record in records for model in record["models"]]
    cells.append(f"{sum(converged)} of {len(converged)}")
    cells.append(f"{sum(line['cpu'] for line in lines) / len(lines):.1f}")
    print("| drawn from | cohorts | noise share | a noise preferred | favoured | enough | nothing to tell | upper end holds "
          "| true/λ | amplitude²/true | log α/true | intervals hold | fits converge | CPU s |")
    print("|" + "---|" * len(cells))
    print("| " + " | ".join(cells) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pulson")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--shapes", type=int, default=10)
    parser.add_argument("--landmarks", type=int, default=6)
    parser.add_argument("--noise", default="none")
    parser.add_argument("--lam", type=float, default=50)
    parser.add_argument("--sigma", type=float, default=0.01)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--sigma-known", action="store_true")
    parser.add_argument("--model", action="append", default=[], help="of compare, in place of its defaults; repeat")
    arguments, arguments.more = parser.parse_known_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    name = (f"{arguments.shapes}x{arguments.landmarks}_{arguments.noise.replace(':', '_')}"
            f"_lambda{arguments.lam:g}_{'known' if arguments.sigma_known else 'fitted'}.jsonl")
    path = arguments.folder / name
    done = {json.loads(line)["seed"] for line in open(path, encoding="utf-8")} if path.exists() else set()
    with open(path, "a", encoding="utf-8") as lines, tempfile.TemporaryDirectory() as scratch:
        for seed in range(1, arguments.count + 1):
            if seed not in done:
                print(json.dumps(run(arguments, seed, scratch)), file=lines, flush=True)
    table(arguments, [json.loads(line) for line in open(path, encoding="utf-8")])


if __name__ == "__main__":
    main()
