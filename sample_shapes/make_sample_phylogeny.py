#!/usr/bin/env python3
"""Writes phylogeny.nwk, phylogeny_root.csv and phylogeny_leaves.csv: a ring of 16 landmarks at the root of a tree of 12
branches of length 1, moved along them by Kunita noise, dq_a = 0.1 sum_b exp(-|q_a - q_b|^2/0.125) o dW_b, by Heun's
method with 100 steps each, and observed at the 9 leaves with errors of variance 0.001.

    python3 make_sample_phylogeny.py
"""
import math
import random

LANDMARKS, BETA, SQUARED_WIDTH, STEPS, VARIANCE = 16, 0.1, 0.125, 100, 0.001
TREE = "((a:1,b:1,c:1)x:1,(d:1,e:1,f:1)y:1,(g:1,h:1,i:1)z:1);"


def velocities(q, w):
    moved = []
    for xa, ya in q:
        k = [BETA * math.exp(-((xa - xb) ** 2 + (ya - yb) ** 2) / SQUARED_WIDTH) for xb, yb in q]
        moved.append((sum(s * x for s, (x, _) in zip(k, w)), sum(s * y for s, (_, y) in zip(k, w))))
    return moved


def along_branch(q, source):
    for _ in range(STEPS):
        w = [(source.gauss(0, STEPS**-0.5), source.gauss(0, STEPS**-0.5)) for _ in q]
        first = velocities(q, w)
        second = velocities([(x + u, y + v) for (x, y), (u, v) in zip(q, first)], w)
        q = [(x + (u + s) / 2, y + (v + t) / 2) for (x, y), (u, v), (s, t) in zip(q, first, second)]
    return q


def observed(q, source):
    deviation = math.sqrt(VARIANCE)
    return [(x + source.gauss(0, deviation), y + source.gauss(0, deviation)) for x, y in q]


def main():
    source = random.Random(1)
    angles = [2 * math.pi * i / LANDMARKS for i in range(LANDMARKS)]
    root = [(math.cos(a), math.sin(a)) for a in angles]
    with open("phylogeny.nwk", "w") as file:
        file.write(TREE + "\n")
    with open("phylogeny_root.csv", "w") as file:
        file.write("x,y\n" + "".join(f"{x:.4f},{y:.4f}\n" for x, y in root))
    with open("phylogeny_leaves.csv", "w") as file:
        file.write("shape,x,y\n")
        for clade in ("abc", "def", "ghi"):
            inner = along_branch(root, source)
            for leaf in clade:
                for x, y in observed(along_branch(inner, source), source):
                    file.write(f"{leaf},{x:.4f},{y:.4f}\n")


if __name__ == "__main__":
    main()
