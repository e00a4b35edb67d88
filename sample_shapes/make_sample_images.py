#!/usr/bin/env python3
"""Writes pictures of sample shapes. With y up: discs.png, the discs of discs_source.csv, 600 x 360 pixels over
[-2, 2] x [-1.2, 1.2]; cs.png, a band along cs_source.csv, fish.png and hand.png, within their outlines, 360 x 360 pixels
over [-1.2, 1.2] x [-1.2, 1.2]. And the strips core_source.png and core_target.png, 640 x 64 pixels, with a band at each
landmark.

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


def near_segments(points, reach):
    """A function of (x, y): the sides of the polygon that may be within `reach` of it, looked up in square cells."""
    cell = 4 * reach
    cells = {}
    for (ax, ay), (bx, by) in zip(points, points[1:] + points[:1]):
        for i in range(math.floor((min(ax, bx) - reach) / cell), math.floor((max(ax, bx) + reach) / cell) + 1):
            for j in range(math.floor((min(ay, by) - reach) / cell), math.floor((max(ay, by) + reach) / cell) + 1):
                cells.setdefault((i, j), []).append((ax, ay, bx - ax, by - ay))
    return lambda x, y: cells.get((math.floor(x / cell), math.floor(y / cell)), ())


def outline_colour(points, inner):
    """The colour at (x, y): `inner` within the polygon, a dark line along it, paper beyond."""
    half_width = 0.012
    near = near_segments(points, half_width)
    rows = {}  # of samples: the places where they cross the polygon

    def crossings(y):
        if y not in rows:
            rows[y] = sorted(ax + (y - ay) * (bx - ax) / (by - ay)
                             for (ax, ay), (bx, by) in zip(points, points[1:] + points[:1]) if (ay > y) != (by > y))
        return rows[y]

    def is_on_line(x, y):
        for ax, ay, u, v in near(x, y):
            t = min(1, max(0, ((x - ax) * u + (y - ay) * v) / (u * u + v * v)))
            if math.hypot(x - ax - t * u, y - ay - t * v) < half_width:
                return True
        return False

    def colour(x, y):
        if is_on_line(x, y):
            return (38, 48, 64)
        return inner(x, y) if sum(place < x for place in crossings(y)) % 2 else paper(x, y)

    return colour


def fish_colour(x, y):
    if math.hypot(x + 0.8, y - 0.06) < 0.035:
        return (20, 24, 30)
    if math.hypot(x + 0.8, y - 0.06) < 0.055:
        return (250, 246, 230)
    part = min(1, max(0, 0.5 - 2 * y))  # from the back to the belly
    back, belly = ((28, 92, 110), (96, 160, 150)) if math.floor((x + 1) / 0.14) % 3 == 2 else ((86, 158, 150), (250, 236, 200))
    return tuple(round(a + part * (b - a)) for a, b in zip(back, belly))


def hand_colour(x, y):
    if y < -0.82:
        return (62, 98, 156) if math.floor(y / 0.05) % 2 else (84, 122, 180)
    lines = min(abs((x + 0.06) % 0.12 - 0.06), abs((y + 0.06) % 0.12 - 0.06))
    return (214, 156, 118) if lines < 0.006 else (240, 196, 160)


# Bands of the core: of its ground but for the landmarks that change their order.
CORE_BANDS = {11: (226, 110, 40), 12: (40, 120, 200), 19: (190, 60, 110), 20: (60, 160, 120), 27: (110, 70, 180),
              28: (230, 180, 40), 32: (120, 20, 30), 33: (180, 50, 30), 34: (225, 105, 40), 35: (245, 165, 60),
              36: (255, 215, 110)}
CORE_SIZE = (640, 64)


def core_column(places):
    """The colour at x of a strip with a band at each place."""
    ordered = sorted(places)
    gaps = {a: min([abs(a - b) for b in ordered if b != a]) for a in places}

    def colour(x):
        away, at = min((abs(x - place), i) for i, place in enumerate(places))
        if away > 0.3 * gaps[places[at]]:
            light = 6 * math.sin(x / 37) + 4 * math.sin(x / 11)
            return tuple(c + light for c in (216, 204, 182))
        grey = 92 + 28 * (at % 3)
        return CORE_BANDS.get(at + 1, (grey, grey - 12, grey - 28))

    return colour


def write_strip(name, places):
    width, height = CORE_SIZE
    colour = core_column(places)
    row = b"\0"
    for i in range(width):
        samples = [colour(i - 0.5 + (a + 0.5) / SUB) for a in range(SUB)]
        row += bytes(round(sum(channel) / SUB) for channel in zip(*samples))
    write_png(FOLDER / name, width, height, height * row)


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


def read_points(name):
    with open(FOLDER / name, newline="") as file:
        return [tuple(map(float, row.values())) for row in csv.DictReader(file)]


def main():
    write_picture("discs.png", discs_colour, -2, 1.2, 600, 360)
    write_picture("cs.png", band_colour(read_points("cs_source.csv")), -1.2, 1.2, 360, 360)
    write_picture("fish.png", outline_colour(read_points("fish_source.csv"), fish_colour), -1.2, 1.2, 360, 360)
    write_picture("hand.png", outline_colour(read_points("hand_source.csv"), hand_colour), -1.2, 1.2, 360, 360)
    for name in ("core_source", "core_target"):
        write_strip(f"{name}.png", [x for x, in read_points(f"{name}.csv")])


if __name__ == "__main__":
    main()
