#!/usr/bin/env python3
"""Writes two pictures of sample shapes, y up: discs.png, the discs of discs_source.csv, 600 x 360 pixels over
[-2, 2] x [-1.2, 1.2], and cs.png, a band along cs_source.csv, 360 x 360 pixels over [-1.2, 1.2] x [-1.2, 1.2].

Each disc has rings, spokes and a mark of its own that show which way it was turned; the band has stripes."""

import csv
import math
import pathlib
import struct
import zlib

PIXEL = 4 / 600
FOLDER = pathlib.Path(__file__).parent
SUB = 4  # samples per pixel and axis


def disc_colour(u, v, light, dark, mark):
    """The colour at (u, v) in a disc of radius 0.42, or None outside."""
    r = math.hypot(u, v)
    if r > 0.42:
        return None
    if r > 0.385:
        return dark
    angle = math.atan2(v, u)
    if 0.08 < u < 0.28 and abs(v - 0.5 * (u - 0.18)) < 0.04:
        return mark
    return light if (int(r / 0.13) + int(math.floor(angle / (math.pi / 4)))) % 2 == 0 else tuple(
        (a + b) // 2 for a, b in zip(light, dark))


def paper(x, y):
    return (244, 242, 236) if (math.floor(x / 0.2) + math.floor(y / 0.2)) % 2 == 0 else (234, 231, 222)


def discs_colour(x, y):
    left = disc_colour(x + 1, y, (255, 196, 92), (150, 62, 20), (90, 20, 20))
    right = disc_colour(x - 1, y, (120, 200, 240), (24, 74, 130), (16, 28, 80))
    return left or right or paper(x, y)


def band_colour(points):
    """The colour at (x, y) of a band along the points."""

    def nearest(x, y):
        """The distance to the polyline, and where on it that is, in segments."""
        best = (math.inf, 0)
        for i, ((ax, ay), (bx, by)) in enumerate(zip(points, points[1:])):
            u, v = bx - ax, by - ay
            t = min(1, max(0, ((x - ax) * u + (y - ay) * v) / (u * u + v * v)))
            best = min(best, (math.hypot(x - ax - t * u, y - ay - t * v), i + t))
        return best

    def colour(x, y):
        away, place = nearest(x, y)
        if away > 0.16:
            return paper(x, y)
        if away > 0.13:
            return (24, 74, 130)
        part = place / (len(points) - 1)
        light = tuple(round(a + part * (b - a)) for a, b in zip((255, 196, 92), (120, 200, 240)))
        return light if int(place) % 4 < 2 else tuple(round(0.8 * c) for c in light)

    return colour


def pixel(colour, left, top, i, j):
    total = [0, 0, 0]
    for b in range(SUB):
        for a in range(SUB):
            x = left + (i + (a + 0.5) / SUB) * PIXEL
            y = top - (j + (b + 0.5) / SUB) * PIXEL
            for c, value in enumerate(colour(x, y)):
                total[c] += value
    return bytes(round(value / SUB**2) for value in total)


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def write_png(path, width, height, rows):
    """Writes 8-bit RGB rows, each after a filter byte of 0."""
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")
    path.write_bytes(png)


def write_picture(name, colour, left, top, width, height):
    rows = b"".join(b"\0" + b"".join(pixel(colour, left, top, i, j) for i in range(width)) for j in range(height))
    write_png(FOLDER / name, width, height, rows)


def main():
    write_picture("discs.png", discs_colour, -2, 1.2, 600, 360)
    with open(FOLDER / "cs_source.csv", newline="") as file:
        points = [(float(row["x"]), float(row["y"])) for row in csv.DictReader(file)]
    write_picture("cs.png", band_colour(points), -1.2, 1.2, 360, 360)


if __name__ == "__main__":
    main()
