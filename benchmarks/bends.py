#!/usr/bin/env python3
"""Writes matching problems of 100 landmarks with strong deformations, as many_landmarks.py does.

banana and crescent: a circle to a letter C with round and with pointed ends; star: a circle to a star of five arms;
twist: a grid turned by up to 120 degrees in its middle; strip: a strip bent into a U; spiral: a line rolled up by 400
degrees. D, the diameter of the source: 2, 2, 2, 2.83, 3.04, 3.

Usage: benchmarks/bends.py FOLDER
"""
import math
import pathlib
import sys

from many_landmarks import write_problem


def circle(count=100):
    return [(math.cos(2 * math.pi * i / count), math.sin(2 * math.pi * i / count)) for i in range(count)]


def arc_band(along, across, radius, turn):
    """A straight band along x bent to an arc: `along` from -1 to 1 over `turn`, open to the right."""
    angle = math.pi - 0.5 * turn * along
    return ((radius + across) * math.cos(angle), (radius + across) * math.sin(angle))


def banana():
    """The circle's left half becomes the outside of a letter C with round ends, its right half the inside."""
    return circle(), [arc_band(y, -0.3 * x, 0.8, math.radians(240)) for x, y in circle()]


def crescent():
    """The same with pointed ends: even steps along the arc."""
    target = []
    for x, y in circle():
        along = math.asin(max(-1, min(1, y))) * 2 / math.pi
        target.append(arc_band(along, -0.3 * x, 0.8, math.radians(240)))
    return circle(), target


def star():
    target = []
    for x, y in circle():
        radius = 1 + 0.5 * math.cos(5 * math.atan2(y, x))
        target.append((radius * x, radius * y))
    return circle(), target


def twist():
    source = [(2 * i / 9 - 1, 2 * j / 9 - 1) for i in range(10) for j in range(10)]
    target = []
    for x, y in source:
        angle = math.radians(120) * math.exp(-(x * x + y * y) / 0.5)
        target.append((x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle)))
    return source, target


def strip():
    source = [(3 * i / 24 - 1.5, 0.5 * j / 3 - 0.25) for i in range(25) for j in range(4)]
    return source, [arc_band(x / 1.5, y, 3 / math.pi, math.pi) for x, y in source]


def spiral():
    source, target = [], []
    for i in range(100):
        part = i / 99
        angle = math.radians(400) * part
        source.append((3 * part - 1.5, 0))
        target.append(((0.9 - 0.55 * part) * math.cos(angle), (0.9 - 0.55 * part) * math.sin(angle)))
    return source, target


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for problem in (banana, crescent, star, twist, strip, spiral):
        write_problem(folder, problem.__name__, problem())


if __name__ == '__main__':
    main()
