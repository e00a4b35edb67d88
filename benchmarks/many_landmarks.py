#!/usr/bin/env python3
"""Writes matching problems with many landmarks: NAME_source.csv and NAME_target.csv, columns x, y without header.

outline: circle of radius 1 to an ellipse with a bump; grid: a square grid over a side of 2 moved by a smooth
deformation. D, the diameter of the source, is 2 and 2.83.

Usage: benchmarks/many_landmarks.py FOLDER [COUNT]   (COUNT landmarks each, the grid's rounded to a square; 10000)
"""
import math
import pathlib
import sys


def outline(count):
    """(source, target): the target is stretched by 1.3 and 1/1.3, with a bump of a quarter of the radius."""
    source, target = [], []
    for i in range(count):
        angle = 2 * math.pi * i / count
        radius = 1 + 0.25 * math.exp(-8 * (angle - 1) ** 2)
        source.append((math.cos(angle), math.sin(angle)))
        target.append((1.3 * radius * math.cos(angle), radius * math.sin(angle) / 1.3))
    return source, target


def grid(count):
    """(source, target): moved by up to a twentieth of the diameter, with waves longer than the grid."""
    side = round(math.sqrt(count))
    source, target = [], []
    for i in range(side):
        for j in range(side):
            x, y = 2 * i / (side - 1) - 1, 2 * j / (side - 1) - 1
            source.append((x, y))
            target.append((x + 0.15 * math.sin(2 * y + 0.5), y + 0.15 * math.cos(1.5 * x - y)))
    return source, target


def write_problem(folder, name, shapes):
    for role, points in zip(('source', 'target'), shapes):
        rows = [f'{x:.12g},{y:.12g}\n' for x, y in points]
        (folder / f'{name}_{role}.csv').write_text(''.join(rows))


def main():
    folder = pathlib.Path(sys.argv[1])
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 10000
    folder.mkdir(parents=True, exist_ok=True)
    write_problem(folder, 'outline', outline(count))
    write_problem(folder, 'grid', grid(count))


if __name__ == '__main__':
    main()
