#!/usr/bin/env python3
"""Tabulates studies of `pulson compare --simulate`: are fitted numbers right on average, and their intervals?

    benchmarks/calibration.py CANDIDATE recovery.json [recovery.json ...]

CANDIDATE is the --noise that was fitted, as ch-sd. Files of the same command with other seeds are put together. Each row
is a generating model: cohorts, how often the noise vanishes, beta^2 and the geometric means of lambda and alpha over the
true ones with standard errors, and how many of the intervals of 90 % contain the true number.
"""
import json
import math
import sys


def numbers_of(spec):
    """The numbers of NAME:KEY=VALUE,..."""
    pairs = [pair.partition("=") for pair in spec.partition(":")[2].split(",") if pair]
    return {key: float(value) for key, _, value in pairs if value.replace(".", "").replace("-", "").replace("e", "").isdigit()}


def mean_and_error(values):
    n = len(values)
    mean = sum(values) / n
    variance = sum((value - mean) ** 2 for value in values) / max(n - 1, 1)
    return mean, math.sqrt(variance / n)


def covers(interval, true):
    low, high = interval  # null is no bound
    return (low is None or low <= true) and (high is None or high >= true)


def ratio(fits, name, true):
    """The geometric mean over the true number, and its relative standard error."""
    logs = [math.log(fit[name] / true) for fit in fits if fit.get(name)]
    mean, error = mean_and_error(logs)
    return f"{math.exp(mean):.3f} ± {math.exp(mean) * error:.3f}"


def row(noise, truth, amplitude, fits):
    beta = truth.get(amplitude, 0)
    n = len(fits)
    cells = [noise, str(n), f"{sum(fit[amplitude] == 0 for fit in fits)}"]
    if beta:
        mean, error = mean_and_error([(fit[amplitude] / beta) ** 2 for fit in fits])
        cells.append(f"{mean:.3f} ± {error:.3f}")
    else:
        cells.append("")
    cells += [ratio(fits, "lambda", truth["lambda"]), ratio(fits, "alpha", truth["alpha"])]
    for name, true in ((amplitude, beta), ("lambda", truth["lambda"]), ("alpha", truth["alpha"])):
        inside = sum(covers(fit["interval_90"][name], true) for fit in fits) / n
        cells.append(f"{100 * inside:.0f} ± {100 * math.sqrt(inside * (1 - inside) / n):.0f} %")
    return cells


def main(candidate, files):
    rows = {}
    seconds = 0
    for file in files:
        with open(file, encoding="utf-8") as stream:
            study = json.load(stream)
        seconds += study["seconds"]
        for model in study["models"]:
            truth = {**numbers_of(model["noise"]), "lambda": model["lambda"], "alpha": numbers_of(model["kernel"])["alpha"]}
            fits = [fit[candidate] for fit in model["fits"] if fit[candidate].get("log_evidence") is not None]
            rows.setdefault(model["noise"], (truth, []))[1].extend(fits)
    some = next(iter(rows.values()))[1][0]
    amplitude = next(name for name in some if name not in ("lambda", "alpha", "log_evidence", "interval_90"))
    print(f"| drawn from | cohorts | {amplitude} vanishes | {amplitude}²/true | λ/true | α/true | coverage of {amplitude} | of λ | of α |")
    print("|---|---|---|---|---|---|---|---|---|")
    for noise, (truth, fits) in rows.items():
        print("| " + " | ".join(row(noise, truth, amplitude, fits)) + " |")
    everything = [fit for _, fits in rows.values() for fit in fits]
    for name in (amplitude, "lambda", "alpha"):
        inside = sum(
            covers(fit["interval_90"][name], truth.get(name, 0)) for truth, fits in rows.values() for fit in fits
        ) / len(everything)
        print(f"all {len(everything)}: coverage of {name} {100 * inside:.1f} ± {100 * math.sqrt(inside * (1 - inside) / len(everything)):.1f} %")
    print(f"{seconds:.0f} s")


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2:])
