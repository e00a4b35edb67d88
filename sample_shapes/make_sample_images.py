#!/usr/bin/env python3
"""Writes discs.png, a picture of the two discs of discs_source.csv: 600 x 360 pixels over [-2, 2] x [-1.2, 1.2], y up.

Each disc has rings, spokes and a mark of its own that show which way it was turned."""

import math
import pathlib
import struct
import zlib

WIDTH, HEIGHT = 600, 360
PIXEL = 4 / WIDTH
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


def colour(x, y):
    left = disc_colour(x + 1, y, (255, 196, 92), (150, 62, 20), (90, 20, 20))
    right = disc_colour(x - 1, y, (120, 200, 240), (24, 74, 130), (16, 28, 80))
    if left or right:
        return left or right
    return (244, 242, 236) if (math.floor(x / 0.2) + math.floor(y / 0.2)) % 2 == 0 else (234, 231, 222)


def pixel(i, j):
    total = [0, 0, 0]
    for b in range(SUB):
        for a in range(SUB):
            x = -2 + (i + (a + 0.5) / SUB) * PIXEL
            y = 1.2 - (j + (b + 0.5) / SUB) * PIXEL
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


def main():
    rows = b"".join(b"\0" + b"".join(pixel(i, j) for i in range(WIDTH)) for j in range(HEIGHT))
    write_png(pathlib.Path(__file__).parent / "discs.png", WIDTH, HEIGHT, rows)


if __name__ == "__main__":
    main()
