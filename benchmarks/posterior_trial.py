#!/usr/bin/env python3
"""Compares `pulson sample` with weighted draws of an independent program, on small problems that are hard.

    benchmarks/posterior_trial.py PULSON FOLDER [--methods hmc,nuts,pcn,rto] [--seeds 1,2] [--only NAMES] [--jobs 2]

Landmarks on a line, in the plane and in space that swap, nearly collide or are missing, with every kind of noise. The
posterior of each is computed here by importance sampling with the integrator and the steps of the run (heun), from a
mixture that is fitted to tempered posteriors one after the other, with the prior as a tenth of it. Then every method runs
with default chains, and log p(y) and the means of p0, q(T/2) and q(T) are compared in units of the combined error.
The table has, for each method, the runs, those called converged, and those of these that are wrong by more than 3 errors
in log p(y), or in one of the means by more than is exceeded by chance in 0.3 % of runs. Below it stands how many of the
runs' confirmations agree with this program's log p(y). FOLDER keeps what is done.
"""
import argparse
import concurrent.futures
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")
import numpy as np  # noqa: E402

from posterior_problems import PROBLEMS  # noqa: E402

NUGGET = 1e-3  # of the prior of the momenta, times lambda sigma^2/T^2
AT_ONCE = 10000  # paths
FIRST, FINAL, MOST = 40000, 250000, 4000000  # draws
ACCURACY = 0.004  # of log p(y)


def numbers_of(noise):
    name, _, rest = noise.partition(":")
    return name, dict(pair.split("=") for pair in rest.split(",") if pair)


class Paths:
    """Heun's method for M3, all paths at once. States are arrays [landmark, axis, path]."""

    def __init__(self, spec):
        self.spec = spec
        self.q0 = np.array(spec["source"], float)
        self.n, self.d = self.q0.shape
        self.noise, numbers = numbers_of(spec["noise"])
        self.center = [float(x) for x in numbers.get("center", "").split("/") if x]
        self.numbers = {key: float(x) for key, x in numbers.items() if key not in ("fields", "center")}
        self.fields = numbers.get("fields")
        if self.noise == "none":
            self.channels = 0
        elif self.noise == "p-sd":
            self.channels = self.d * (self.d if self.fields == "cos" else 1)
        else:
            self.channels = self.n * self.d
        r = np.linalg.norm(self.q0[:, None] - self.q0[None], axis=2)
        gram = np.exp(-((r / spec["alpha"]) ** 2)) if spec["kernel"] == "gaussian" else np.exp(-r / spec["alpha"])
        gram += NUGGET * spec["lam"] * spec["sigma"] ** 2 * np.eye(self.n)
        # p0 = z0 L^-1/sqrt(lambda), as L L^T = K
        self.root = np.linalg.inv(np.linalg.cholesky(gram)).T / math.sqrt(spec["lam"])
        self.size = self.n * self.d
        self.fitted = 1 if spec["fit"] else 0
        self.unknowns = self.size + self.channels * spec["steps"] + self.fitted

    def pairs(self, q):
        for a in range(self.n):
            for b in range(a):
                yield a, b, q[a] - q[b]

    def change(self, q, p, dt, dw, scale):
        """H_p dt + h_p dW and -(H_q dt + h_q dW). `scale`: of the amplitude, of each path."""
        spec, numbers, noise = self.spec, self.numbers, self.noise
        dq, dp = dt * p, np.zeros_like(p)
        alpha = spec["alpha"]
        w = dw * (scale * numbers.get("beta", numbers.get("sigma", 0)))
        if noise in ("ch-sd", "kunita"):
            dq = dq + w.reshape(p.shape)
        elif noise == "trouve-vialard":
            dp -= w.reshape(p.shape)
        elif noise == "p-sd":
            w = w.reshape(-1, self.d, w.shape[-1])
            for f in range(len(w)):
                if self.fields == "cos":
                    k = numbers["wavenumber"]
                    value, slope = np.cos(k * q[:, f]), np.zeros_like(q)
                    slope[:, f] = -k * np.sin(k * q[:, f])
                else:
                    away = q - np.array(self.center)[None, :, None]
                    value = np.exp(-(away**2).sum(1) / numbers["width"] ** 2)
                    slope = -2 / numbers["width"] ** 2 * away * value[:, None]
                dq = dq + value[:, None] * w[f][None]
                dp -= slope * (p * w[f][None]).sum(1)[:, None]
        for a, b, away in self.pairs(q):
            square = (away**2).sum(0)
            if spec["kernel"] == "gaussian":
                k = np.exp(-square / alpha**2)
                over = -2 / alpha**2 * k  # K'/r
            else:
                r = np.sqrt(square)
                k = np.exp(-r / alpha)
                over = -k / (alpha * np.maximum(r, 1e-300))
            dq[a] += dt * k * p[b]
            dq[b] += dt * k * p[a]
            force = (dt * (p[a] * p[b]).sum(0) * over) * away
            if noise in ("kunita", "ch-sd-screened"):
                range_ = numbers["width"] ** 2 if noise == "kunita" else numbers["gamma"]
                e = np.exp(-square / range_)
                wa, wb = w.reshape(p.shape)[a], w.reshape(p.shape)[b]
                if noise == "kunita":
                    dq[a] += e * wb
                    dq[b] += e * wa
                    along = (p[a] * wb).sum(0) + (p[b] * wa).sum(0)
                else:
                    dq[a] += e * wa
                    dq[b] += e * wb
                    along = (p[a] * wa).sum(0) + (p[b] * wb).sum(0)
                force = force + (along * -2 / range_ * e) * away
            dp[a] -= force
            dp[b] += force
        return dq, dp

    def shoot(self, z):
        """p0, q(T/2), q(T) of unknowns in rows, each [landmark and axis, path]."""
        steps = self.spec["steps"]
        dt = 1 / steps
        count = len(z)
        p = np.einsum("kbx,ba->axk", z[:, : self.size].reshape(count, self.n, self.d), self.root.T)
        p0 = p
        q = np.repeat(self.q0[:, :, None], count, axis=2)
        scale = np.exp(self.spec["fit"] * z[:, -1]) if self.fitted else 1.0
        increments = math.sqrt(dt) * z[:, self.size : self.size + steps * self.channels]
        increments = increments.reshape(count, steps, self.channels)
        middle = q
        for step in range(steps):
            if step == (steps + 1) // 2:
                middle = q
            dw = np.ascontiguousarray(increments[:, step].T)
            dq, dp = self.change(q, p, dt, dw, scale)
            dq2, dp2 = self.change(q + dq, p + dp, dt, dw, scale)
            q, p = q + 0.5 * (dq + dq2), p + 0.5 * (dp + dp2)
        return [x.reshape(self.size, count) for x in (p0, middle, q)]


class Posterior:
    """log likelihood and the numbers that are compared, of one target."""

    def __init__(self, spec, target):
        self.paths = Paths(spec)
        self.sigma = spec["sigma"]
        known = [x for x in target for _ in range(self.paths.d)]
        self.there = np.array([x is not None for x in known])
        self.y = np.array([number for x in target if x is not None for number in x])

    def __call__(self, z):
        logs, numbers = [], []
        for first in range(0, len(z), AT_ONCE):
            with np.errstate(all="ignore"):
                p0, middle, end = self.paths.shoot(z[first : first + AT_ONCE])
                r = (end[self.there] - self.y[:, None]) / self.sigma
                log = -0.5 * (r**2).sum(0) - len(self.y) * math.log(self.sigma * math.sqrt(2 * math.pi))
            log[~np.isfinite(log)] = -np.inf
            part = np.concatenate([p0, middle, end])
            part[:, ~np.isfinite(log)] = 0
            logs.append(log)
            numbers.append(part)
        return np.concatenate(logs), np.concatenate(numbers, axis=1)


def log_normal(z):
    return -0.5 * (z**2).sum(1) - 0.5 * z.shape[1] * math.log(2 * math.pi)


def effective(log_weights):
    w = np.exp(log_weights - log_weights.max())
    return w.sum() ** 2 / (w**2).sum()


class Mixture:
    """Gaussians about clusters of points, and the prior as a tenth."""

    def __init__(self, points, rng, count=10):
        n, u = points.shape
        centres = points[rng.choice(n, min(count, n), replace=False)]
        overall = np.cov(points.T).reshape(u, u) + 1e-10 * np.eye(u)
        white = np.linalg.inv(np.linalg.cholesky(overall))
        for _ in range(8):
            far = (((points @ white.T)[:, None] - (centres @ white.T)[None]) ** 2).sum(2)
            nearest = far.argmin(1)
            centres = np.array([points[nearest == c].mean(0) if (nearest == c).any() else centres[c]
                                for c in range(len(centres))])
        self.parts = []
        for c in range(len(centres)):
            mine = points[nearest == c]
            if len(mine) < 2:
                continue
            own = np.cov(mine.T).reshape(u, u)
            shrink = 2 * u / (len(mine) + 2 * u)
            root = np.linalg.cholesky(1.3 * ((1 - shrink) * own + shrink * overall) + 1e-10 * np.eye(u))
            self.parts.append((0.9 * len(mine) / n, centres[c], root))
        self.parts.append((1 - sum(part[0] for part in self.parts), np.zeros(u), np.eye(u)))

    def draw(self, n, rng):
        which = rng.choice(len(self.parts), n, p=[part[0] for part in self.parts])
        z = rng.standard_normal((n, len(self.parts[0][1])))
        for c, (_, centre, root) in enumerate(self.parts):
            z[which == c] = centre + z[which == c] @ root.T
        return z

    def log_density(self, z):
        logs = np.array([math.log(part) + log_normal((z - centre) @ np.linalg.inv(root).T)
                         - np.log(np.diag(root)).sum() for part, centre, root in self.parts])
        top = logs.max(0)
        return top + np.log(np.exp(logs - top).sum(0))


def integral(spec, target, rng):
    """log p(y) and the means, with errors, of one target."""
    posterior = Posterior(spec, target)
    u = posterior.paths.unknowns
    z = rng.standard_normal((FIRST, u))
    log, _ = posterior(z)
    offset = np.zeros(FIRST)  # log prior over proposal
    power, settled, mixture = 0.0, 0, None
    for _ in range(40):
        if power == 1:
            settled += 1
        low, high = power, 1.0
        wanted = min(1500, 0.03 * FIRST) if power < 1 else 0
        if effective(offset + log) < wanted:
            for _ in range(30):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if effective(offset + middle * log) >= wanted else (low, middle)
        else:
            low = 1.0
        power = max(low, power)
        w = np.exp(offset + power * log - (offset + power * log).max())
        mixture = Mixture(z[rng.choice(len(z), 6000, p=w / w.sum())], rng)
        if settled == 2 and effective(offset + log) > 0.05 * len(z):
            break
        z = mixture.draw(FIRST, rng)
        log, _ = posterior(z)
        offset = log_normal(z) - mixture.log_density(z)
    else:  # more clusters, of more draws
        for _ in range(3):
            z = mixture.draw(FINAL, rng)
            log, _ = posterior(z)
            offset = log + log_normal(z) - mixture.log_density(z)
            w = np.exp(offset - offset.max())
            mixture = Mixture(z[rng.choice(len(z), 30000, p=w / w.sum())], rng, count=40)
    logs, numbers = [], []
    while True:
        z = mixture.draw(FINAL, rng)
        log, some = posterior(z)
        logs.append(log + log_normal(z) - mixture.log_density(z))
        numbers.append(some)
        all_logs = np.concatenate(logs)
        if len(all_logs) >= MOST or effective(all_logs) > ACCURACY**-2:
            break
    numbers = np.concatenate(numbers, axis=1)
    w = np.exp(all_logs - all_logs.max())
    e = effective(all_logs)
    means = numbers @ w / w.sum()
    errors = np.sqrt((((numbers - means[:, None]) * w) ** 2).sum(1)) / w.sum()
    return dict(log_evidence=all_logs.max() + math.log(w.mean()), error=math.sqrt(1 / e - 1 / len(w)), effective=e,
                largest=float(w.max() / w.sum()), power=power, draws=len(w), means=means.tolist(), errors=errors.tolist())


def brute_force(folder, name):
    file = folder / name / "integral.json"
    if not file.exists():
        spec = PROBLEMS[name]
        found = [integral(spec, target, np.random.default_rng(1 + i)) for i, target in enumerate(spec["targets"])]
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(found))
    return json.loads(file.read_text())


def write_shape(file, shape, names, d):
    rows = [f"{name},{','.join('NA' if x is None else repr(x) for x in (point or [None] * d))}"
            for name, point in zip(names, shape)]
    file.write_text("\n".join(["landmark," + ",".join("xyz"[:d])] + rows) + "\n")


def run(pulson, folder, name, method, seed):
    spec, at = PROBLEMS[name], folder / name
    out = at / f"{method}-{seed}"
    if not (out / "summary.json").exists():
        d, names = len(spec["source"][0]), range(1, len(spec["source"]) + 1)
        out.mkdir(parents=True, exist_ok=True)
        write_shape(out / "source.csv", spec["source"], names, d)
        targets = [f"target{i}.csv" for i in range(1, len(spec["targets"]) + 1)]
        for file, target in zip(targets, spec["targets"]):
            write_shape(out / file, target, names, d)
        noise = spec["noise"] + (f":fit({spec['fit']})" if spec["fit"] else "")
        command = [pulson, "sample", "source.csv", *targets, "--align", "none", "--kernel",
                   f"{spec['kernel']}:alpha={spec['alpha']}", "--lambda", str(spec["lam"]), "--noise", noise, "--sigma",
                   str(spec["sigma"]), "--steps", str(spec["steps"]), "--method", method, "--seed", str(seed),
                   "--threads", "1", "--no-picture", "-o", "."]
        done = subprocess.run(command, cwd=out, capture_output=True, text=True, check=False)
        (out / "log").write_text(" ".join(command) + "\n" + done.stdout + done.stderr)
        if done.returncode not in (0, 3):
            return None
    return json.loads((out / "summary.json").read_text())


def apart(found, error, true, true_error):
    both = math.hypot(error, true_error)
    return 0.0 if found == true else (found - true) / both if both > 0 else math.inf


def comparisons(summary, true):
    """Differences in units of errors: of log p(y), and the others by name."""
    evidence = summary["log_evidence"]
    whole = sum(x["log_evidence"] for x in true), math.sqrt(sum(x["error"] ** 2 for x in true))
    of_evidence = math.nan
    if evidence["value"] is not None:
        of_evidence = apart(evidence["value"], evidence["standard_error"], *whole)
    others = []
    rows = summary["momenta"], summary["path"]["middle"], summary["path"]["end"]
    for kind, label in enumerate(("p0", "q(T/2)", "q(T)")):
        size = len(rows[kind]) // len(true)
        for i, row in enumerate(rows[kind]):
            if row["mcse"] is None:
                continue
            target, place = true[i // size], kind * size + i % size
            others.append((apart(row["mean"], row["mcse"], target["means"][place], target["errors"][place]),
                           f"{label} {i + 1}"))
    return of_evidence, others


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pulson", type=lambda x: str(pathlib.Path(x).resolve()))
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--methods", default="hmc,nuts,pcn,rto")
    parser.add_argument("--seeds", default="1,2")
    parser.add_argument("--only", default="")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    names = options.only.split(",") if options.only else list(PROBLEMS)
    methods, seeds = options.methods.split(","), options.seeds.split(",")
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        true = {name: pool.submit(brute_force, options.folder, name) for name in names}
        runs = {(name, m, s): pool.submit(run, options.pulson, options.folder, name, m, s)
                for name in names for m in methods for s in seeds}
        for name in names:
            for x in true[name].result():
                print(f"{name:18} log p(y) = {x['log_evidence']:.4f} ± {x['error']:.4f}, effective {x['effective']:.0f} of"
                      f" {x['draws']}, largest {x['largest']:.2g}, power {x['power']:.3g}", flush=True)
        counts = {m: dict(runs=0, converged=0, wrong=0, errors=[]) for m in methods}
        confirmations = {}
        for (name, m, s), future in runs.items():
            summary, count = future.result(), counts[m]
            count["runs"] += 1
            if summary is None:
                print(f"{name} {m} {s}: no result", flush=True)
                continue
            of_evidence, others = comparisons(summary, true[name].result())
            allowed = -statistics.NormalDist().inv_cdf(0.0015 / max(1, len(others)))
            if summary["confirmation"]:
                found, kind = summary["confirmation"]["log_evidence"], summary["confirmation"]["by"]
                both = math.hypot(found["standard_error"], math.hypot(*(x["error"] for x in true[name].result())))
                away = (found["value"] - sum(x["log_evidence"] for x in true[name].result())) / both
                confirmations.setdefault(kind, []).append((abs(away), name, found["standard_error"]))
            most, label = max(((abs(x), what) for x, what in others), default=(0, ""))
            wrong = not abs(of_evidence) <= 3 or most > allowed
            evidence = summary["log_evidence"]
            converged = summary["converged"]
            count["converged"] += converged
            count["wrong"] += converged and wrong
            if converged:
                count["errors"].append(evidence["standard_error"])
            print(f"{name:18} {m:4} {s} {'converged' if converged else 'refused  '} {'WRONG' if wrong else '     '}"
                  f" log p(y) {evidence['value']} ± {evidence['standard_error']} ({of_evidence:+.1f}), furthest {most:.1f}"
                  f" of {allowed:.1f} {label}; {summary['seconds']:.1f} s; {(summary['confirmation'] or {}).get('by', 'not confirmed')}",
                  flush=True)
    print("\n| method | runs | called converged | of these wrong | median error of log p(y) |\n|---|---|---|---|---|")
    for m, count in counts.items():
        middle = f"{statistics.median(count['errors']):.3f}" if count["errors"] else ""
        print(f"| `{m}` | {count['runs']} | {count['converged']} | {count['wrong']} | {middle} |")
    for kind, found in confirmations.items():
        print(f"\n{kind}: {sum(away <= 3 for away, _, _ in found)} of {len(found)} within 3 errors of log p(y), median error"
              f" {statistics.median(error for _, _, error in found):.3f}; furthest: "
              + ", ".join(f"{name} {away:.1f}" for away, name, _ in sorted(found)[:-4:-1]))


if __name__ == "__main__":
    sys.exit(main())
