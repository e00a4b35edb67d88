"""What calls cost, and whether memory stays what it is over many of them.

    PYTHONPATH=build/dev/python python3 bindings/python/tools/measure.py [calls]
"""

import gc
import os
import sys
import time

import numpy as np
import pulson

Q = np.array([[0.0, 0.0], [1.0, 0.2], [0.4, 1.0]])
P = np.array([[0.5, 0.0], [0.0, -0.3], [0.2, 0.1]])
TARGET = Q * [1, 1.2]
KERNEL = pulson.Kernel("gaussian:alpha=1")
MATCH = pulson.register(Q, TARGET)
OWN = pulson.OwnKernel(lambda s: np.exp(-s))

CALLS = {
    "align": lambda: pulson.align(Q, P),
    "shoot, a step": lambda: pulson.shoot(Q, P, KERNEL, steps=1, integrator="rk4"),
    "warp_points, none": lambda: MATCH.warp_points(P[:0]),
    "warp_points, one": lambda: MATCH.warp_points(P[:1]),
    "warp_points, three": lambda: MATCH.warp_points(P),
    "Shape": lambda: pulson.Shape(Q),
    "Kernel.gram": lambda: KERNEL.gram(Q, Q),
}
SLOW = {
    "register": lambda: pulson.register(Q, TARGET),
    "shoot by a kernel of one's own": lambda: pulson.shoot(Q, P, OWN, steps=1),
    "OwnKernel": lambda: pulson.OwnKernel(lambda s: np.exp(-s)),
}


def resident():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def seconds_of(call, times):
    seconds = []
    for _ in range(times):
        begin = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - begin)
    return sorted(seconds)


def growth(call, calls):
    """Bytes of resident memory after `calls` calls more than after a third as many before."""
    for _ in range(calls // 3):
        call()
    gc.collect()
    before = resident()
    for _ in range(calls):
        call()
    gc.collect()
    return resident() - before


def beside_the_search(times):
    """Seconds of a call of register beside those of its search."""
    seconds = []
    for _ in range(times):
        begin = time.perf_counter()
        match = pulson.register(Q, TARGET)
        seconds.append(time.perf_counter() - begin - match._match.seconds)
    return sorted(seconds)


def main(calls):
    print(f"{'call':32}{'least':>10}{'median':>10}   growth over calls")
    for name, call in {**CALLS, **SLOW}.items():
        several = calls if name in CALLS else max(1, calls // 100)
        seconds = seconds_of(call, min(2000, several))
        print(f"{name:32}{1e6 * seconds[0]:7.1f} us{1e6 * seconds[len(seconds) // 2]:7.1f} us"
              f"   {growth(call, several) / 1024:+.0f} KiB over {several}", flush=True)
    seconds = beside_the_search(200)
    print(f"{'register beside its search':32}{1e6 * seconds[0]:7.1f} us{1e6 * seconds[len(seconds) // 2]:7.1f} us")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
