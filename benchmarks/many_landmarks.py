#!/usr/bin/env python3
"""Writes matching problems with many landmarks: NAME_source.csv and NAME_target.csv.

outline: circle of radius 1 to an ellipse with a bump; grid: a square grid over a side of 2 moved by a smooth
deformation; sphere: unit sphere to one with three bumps, in 3D. D, the diameter of the source, is 2, 2.83 and 2.

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


def sphere(count):
    """(source, target): points spread evenly over a sphere; the target has a radius of 1 + 0.2 r³cos 3φ + 0.1 z."""
    source, target = [], []
    for i in range(count):
        z, angle = 1 - (2 * i + 1) / count, math.pi * (3 - math.sqrt(5)) * i
        across = math.sqrt(1 - z * z)
        point = (across * math.cos(angle), across * math.sin(angle), z)
        radius = 1 + 0.2 * across ** 3 * math.cos(3 * math.atan2(point[1], point[0])) + 0.1 * z
        source.append(point)
        target.append(tuple(radius * x for x in point))
    return source, target


def write_problem(folder, name, shapes):
    for role, points in zip(('source', 'target'), shapes):
        rows = [','.join(f'{x:.12g}' for x in point) + '\n' for point in points]
        header = ','.join('xyz'[: len(points[0])]) + '\n'
        (folder / f'{name}_{role}.csv').write_text(header + ''.join(rows))


def main():
    folder = pathlib.Path(sys.argv[1])
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 10000
    folder.mkdir(parents=True, exist_ok=True)
    write_problem(folder, 'outline', outline(count))
    write_problem(folder, 'grid', grid(count))
    write_problem(folder, 'sphere', sphere(count))


if __name__ == '__main__':
    main()
