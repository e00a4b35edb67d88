#!/usr/bin/env python3
"""Writes leaves.tps, 19 landmarks on each of eight lobed leaves, and pictures of the first two, leaf_1.png and leaf_2.png.

A leaf in its own coordinates: s from 0 at the base to 1 at the tip, t from -1 at the left margin to 1 at the right one.
Landmarks are in pixels with y up, as in tps files (row r of the picture is at HEIGHT - r): the base, the tip, three places on the midrib, then on each side
the tips of four lobes and the three bays between them, from the base upwards."""

import math
import pathlib
import random

from make_sample_images import write_png

WIDTH, HEIGHT = 300, 400  # pixels
SUB = 3  # samples per pixel and axis
LOBES = 4
MM_PER_PIXEL = 0.2


class Leaf:
    def __init__(self, length, width, lobes, bend, fullness, turn, place, light, dark):
        self.length, self.width, self.lobes, self.bend = length, width, lobes, bend
        self.fullness, self.turn, self.place = fullness, math.radians(turn), place
        self.light, self.dark = light, dark

    def half_width(self, s):
        hull = math.sin(math.pi * s**self.fullness) ** 0.75
        return self.width * hull * (1 + self.lobes * math.cos(2 * math.pi * (LOBES + 0.5) * s + math.pi * 0.75))

    def midrib(self, s):
        return 4 * self.bend * s * (1 - s)

    def point(self, s, t):
        u, v = self.midrib(s) + t * self.half_width(s), s * self.length
        c, d = math.cos(self.turn), math.sin(self.turn)
        return self.place[0] + c * u - d * v, self.place[1] + d * u + c * v

    def own(self, x, y):
        """(s, t) of the place (x, y), or None beyond the ends."""
        c, d = math.cos(self.turn), math.sin(self.turn)
        u, v = c * (x - self.place[0]) + d * (y - self.place[1]), -d * (x - self.place[0]) + c * (y - self.place[1])
        s = v / self.length
        if not 0 < s < 1:
            return None
        return s, (u - self.midrib(s)) / max(self.half_width(s), 1e-9)

    def landmarks(self):
        turns = [k / (2 * LOBES + 1) + 2 * (1 - 0.375) / (2 * LOBES + 1) for k in range(2 * LOBES - 1)]
        sides = [(s, t) for t in (-1, 1) for s in turns]
        return [self.point(s, t) for s, t in [(0, 0), (1, 0), (0.25, 0), (0.5, 0), (0.75, 0)] + sides]

    def colour(self, x, y):
        paper = (246, 244, 238)
        own = self.own(x, y)
        if own is None:
            stalk = self.point(0, 0)
            return self.dark if abs(x - stalk[0] - 0.25 * (stalk[1] - y)) < 2.5 and -28 < y - stalk[1] <= 3 else paper
        s, t = own
        if abs(t) > 1:
            return paper
        w = self.half_width(s)
        if abs(t) * w < 1 + 2.5 * (1 - s) or (1 - abs(t)) * w < 1.2:
            return self.dark
        for k in range(LOBES):  # veins, from the midrib to the lobes' tips
            end = (2 * k + 1.25) / (2 * LOBES + 1)
            if abs(s - end + 0.1 * (1 - abs(t))) * self.length < 1.6 * (1.2 - abs(t)):
                return self.dark
        shade = 0.5 + 0.5 * math.sin(9 * s * math.pi) * math.sin(3 * t)
        return tuple(round(a + 0.18 * shade * (b - a)) for a, b in zip(self.light, self.dark))


def leaves():
    rng = random.Random(7)
    first = Leaf(310, 74, 0.18, 10, 0.85, -5, (142, 50), (150, 190, 96), (58, 98, 38))
    second = Leaf(285, 88, 0.30, -22, 1.1, 7, (176, 62), (214, 160, 72), (128, 70, 22))
    rest = [
        Leaf(rng.gauss(298, 12), rng.gauss(82, 5), rng.gauss(0.24, 0.04), rng.gauss(-4, 10), rng.gauss(0.95, 0.07),
             rng.gauss(0, 3), (rng.gauss(154, 6), rng.gauss(55, 5)), None, None) for _ in range(6)
    ]
    return [first, second] + rest


def picture(leaf):
    def pixel(i, j):
        total = [0, 0, 0]
        for b in range(SUB):
            for a in range(SUB):
                value = leaf.colour(i + (a + 0.5) / SUB - 0.5, HEIGHT - (j + (b + 0.5) / SUB - 0.5))
                total = [x + v for x, v in zip(total, value)]
        return bytes(round(value / SUB**2) for value in total)

    return b"".join(b"\0" + b"".join(pixel(i, j) for i in range(WIDTH)) for j in range(HEIGHT))


def main():
    folder = pathlib.Path(__file__).parent
    rng = random.Random(1)
    text = ""
    for number, leaf in enumerate(leaves(), 1):
        points = leaf.landmarks()
        text += f"LM={len(points)}\n"
        text += "".join(f"{x + rng.gauss(0, 0.4):.2f} {y + rng.gauss(0, 0.4):.2f}\n" for x, y in points)
        text += (f"IMAGE=leaf_{number}.png\n" if number <= 2 else "") + f"ID=leaf_{number}\nSCALE={MM_PER_PIXEL}\n"
        if number <= 2:
            write_png(folder / f"leaf_{number}.png", WIDTH, HEIGHT, picture(leaf))
    (folder / "leaves.tps").write_text(text)


if __name__ == "__main__":
    main()
