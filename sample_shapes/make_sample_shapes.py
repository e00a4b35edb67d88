#!/usr/bin/env python3
"""Writes the sample shapes, pairs NAME_source.csv and NAME_target.csv, into the folder of this script.

Only the standard library is used and nothing is random: the files are the same on every run. Points of an outline are
in order, the first is not repeated at the end, and they lie evenly by arc length; in the hand and the fish, evenly
between anchors (finger tips, fin tips, ...), which are landmarks themselves and correspond in source and target.
"""

import math
from pathlib import Path

FOLDER = Path(__file__).resolve().parent


# ---- curves: lists of (x, y)


def along(curve, count, closed=False):
    """`count` points evenly by arc length: from the first point of the curve round to it (closed), or to its last."""
    curve = curve + curve[:1] if closed else curve
    lengths = [0.0]
    for a, b in zip(curve, curve[1:]):
        lengths.append(lengths[-1] + math.dist(a, b))
    points, k = [], 0
    for i in range(count):
        s = lengths[-1] * i / (count if closed else count - 1)
        while k + 2 < len(curve) and lengths[k + 1] < s:
            k += 1
        t = (s - lengths[k]) / (lengths[k + 1] - lengths[k])
        points.append(tuple((1 - t) * a + t * b for a, b in zip(curve[k], curve[k + 1])))
    return points


def spline(p0, p1, p2, p3, steps=40):
    """The piece from p1 to p2 (not included) of the Catmull-Rom spline."""
    def at(t):
        return tuple(b + t / 2 * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
                     for a, b, c, d in zip(p0, p1, p2, p3))
    return [at(i / steps) for i in range(steps)]


def smooth_outline(pieces, counts):
    """A smooth closed curve through all points of all pieces, with counts[i] landmarks on piece i; the first point of
    each piece is a landmark."""
    knots = [knot for piece in pieces for knot in piece]
    n = len(knots)
    segments = [spline(*(knots[(i + j) % n] for j in (-1, 0, 1, 2))) for i in range(n)]
    points, first = [], 0
    for piece, count in zip(pieces, counts):
        curve = [p for segment in segments[first:first + len(piece)] for p in segment]
        first += len(piece)
        points += along(curve + [segments[first % n][0]], count + 1)[:-1]
    return points


def turn(r, angle, center=(0.0, 0.0)):
    return (center[0] + r * math.cos(angle), center[1] + r * math.sin(angle))


def arc(radius, begin, end, center, steps=400):
    """Of a circle, angles in degrees."""
    return [turn(radius, math.radians(begin + (end - begin) * i / steps), center) for i in range(steps + 1)]


# ---- the shapes


def ellipse(a, b, bump=0.0, bump_at=60.0, bump_width=14.0, count=40):
    """An ellipse with semiaxes a, b and a bump outwards of the given height at an angle (degrees)."""
    curve = []
    for i in range(3600):
        degrees = i / 10
        away = (degrees - bump_at + 180) % 360 - 180
        factor = 1 + bump * math.exp(-(away / bump_width) ** 2)
        curve.append(tuple(factor * v for v in (a * math.cos(math.radians(degrees)), b * math.sin(math.radians(degrees)))))
    return along(curve, count, closed=True)


def letter_c():
    return along(arc(0.9, 50, 310, (0, 0)), 30)


def letter_s():
    upper = arc(0.5, 30, 270, (0, 0.5))
    lower = arc(0.5, 90, -150, (0, -0.5))
    return along(upper + lower[1:], 30)


def disc(center):
    """A centre and two rings of 6 and 10 points; radius 0.4. The rings are not gone round in order: the points fill a disc
    and are no outline."""
    rings = ((0.2, 6, (0, 2, 4, 1, 3, 5)), (0.4, 10, (0, 3, 6, 9, 2, 5, 8, 1, 4, 7)))
    return [center] + [turn(r, 2 * math.pi * i / n, center) for r, n, order in rings for i in order]


def finger(base, angle, bend, length, width):
    """The left side upwards, the round tip from left to right, the right side downwards. The angle (degrees from
    upright, clockwise) grows by `bend` along the finger."""
    sections, (x, y), steps = [], base, 20
    for i in range(steps + 1):
        a = math.radians(angle + bend * i / steps)
        w = width / 2 * (1 - 0.2 * i / steps)
        sections.append(((x, y), (w * math.cos(a), -w * math.sin(a))))
        x, y = x + length / steps * math.sin(a), y + length / steps * math.cos(a)
    left = [(c[0] - v[0], c[1] - v[1]) for c, v in sections]
    right = [(c[0] + v[0], c[1] + v[1]) for c, v in sections]
    end, across = sections[-1]
    tip = (end[0] - 0.9 * across[1], end[1] + 0.9 * across[0])
    return [left[i] for i in (7, 12, 16)], [left[-1], tip], [right[i] for i in (20, 16, 12, 7)]


# pinky, ring, middle, index finger, thumb (to the right)
FINGER_BASES = ((-0.37, 0.08), (-0.135, 0.20), (0.105, 0.22), (0.335, 0.13), (0.44, -0.44))
FINGER_LENGTHS = (0.50, 0.66, 0.74, 0.67, 0.58)
FINGER_WIDTHS = (0.165, 0.19, 0.20, 0.195, 0.23)
VALLEYS = ((-0.27, 0.13), (-0.015, 0.21), (0.225, 0.18), (0.425, -0.26))
HAND_COUNTS = (11, 2, 4, 5, 2, 5, 5, 2, 5, 5, 2, 8, 4, 2, 9, 4)


def hand(angles, bends):
    fingers = [finger(*values) for values in zip(FINGER_BASES, angles, bends, FINGER_LENGTHS, FINGER_WIDTHS)]
    pieces = [[(-0.33, -1.0), (-0.36, -0.75), (-0.46, -0.35), (-0.48, -0.05)] + fingers[0][0]]
    for (_, tip, right), valley, (left, _, _) in zip(fingers, VALLEYS, fingers[1:]):
        pieces += [tip, right, [valley] + left]
    _, tip, right = fingers[-1]
    pieces += [tip, right + [(0.36, -0.72)], [(0.27, -1.0), (-0.03, -1.03)]]
    return smooth_outline(pieces, HAND_COUNTS)


# Each piece begins at an anchor. Snout to the left; from there over the back, round the tail, and back along the belly.
FISH_COUNTS = (8, 5, 5, 5, 4, 4, 4, 4, 4, 5, 4, 3, 3, 3, 7)
TROUT = (
    [(-1.00, 0.00), (-0.90, 0.10), (-0.70, 0.20), (-0.45, 0.26)],        # snout
    [(-0.24, 0.28), (-0.16, 0.38)],                                      # dorsal fin: front,
    [(-0.05, 0.49), (0.03, 0.36)],                                       # tip,
    [(0.17, 0.25), (0.36, 0.185), (0.52, 0.125)],                        # end
    [(0.68, 0.10), (0.79, 0.18)],                                        # tail: root,
    [(0.98, 0.38), (0.95, 0.20)],                                        # upper tip,
    [(0.89, 0.00), (0.95, -0.20)],                                       # notch,
    [(0.98, -0.38), (0.79, -0.18)],                                      # lower tip,
    [(0.68, -0.10), (0.57, -0.115)],                                     # root
    [(0.47, -0.14), (0.46, -0.26)],                                      # anal fin: end,
    [(0.42, -0.39), (0.31, -0.28)],                                      # tip,
    [(0.19, -0.22), (0.05, -0.25)],                                      # front
    [(-0.06, -0.27), (-0.06, -0.35)],                                    # pelvic fin: end,
    [(-0.09, -0.46), (-0.20, -0.36)],                                    # tip,
    [(-0.30, -0.28), (-0.50, -0.26), (-0.74, -0.18), (-0.92, -0.075)],   # front
)
ANGELFISH = (
    [(-0.90, 0.02), (-0.78, 0.10), (-0.60, 0.30), (-0.40, 0.50)],
    [(-0.22, 0.61), (-0.02, 0.76)],
    [(0.36, 1.00), (0.24, 0.66)],
    [(0.28, 0.38), (0.38, 0.22), (0.46, 0.145)],
    [(0.55, 0.12), (0.68, 0.22)],
    [(0.95, 0.40), (0.88, 0.20)],
    [(0.85, 0.00), (0.88, -0.20)],
    [(0.95, -0.40), (0.68, -0.22)],
    [(0.55, -0.12), (0.46, -0.145)],
    [(0.36, -0.24), (0.26, -0.50)],
    [(0.36, -1.00), (0.04, -0.78)],
    [(-0.12, -0.60), (-0.19, -0.57)],
    [(-0.25, -0.54), (-0.24, -0.68)],
    [(-0.26, -0.88), (-0.38, -0.66)],
    [(-0.42, -0.44), (-0.60, -0.28), (-0.74, -0.15), (-0.84, -0.06)],
)

# ---- markers along a core, in pixels of the strips of make_sample_images.py

CORE_LENGTH = 640


def core():
    """40 markers at unequal distances, and where they lie in a second core: stretched smoothly, with the markers 11 and
    12, 19 and 20, 27 and 28 exchanged and 32 to 36 in reverse."""
    places = [0.0]
    for i in range(39):
        places.append(places[-1] + 1 + 0.4 * math.sin(2.4 * i) + 0.25 * math.sin(5.1 * i + 1))
    places = [0.03 + 0.94 * place / places[-1] for place in places]
    stretched = [x + 0.05 * math.sin(math.pi * x) * math.sin(2 * math.pi * x + 0.5) for x in places]
    order = list(range(40))
    for first, last in ((11, 12), (19, 20), (27, 28), (32, 36)):  # counted from 1
        order[first - 1:last] = reversed(order[first - 1:last])
    return [[(round(CORE_LENGTH * x, 1),) for x in line] for line in (places, [stretched[i] for i in order])]


PAIRS = {
    "swap": ([(0.0,), (1.0,)], [(1.0,), (0.0,)]),
    "core": core(),
    "ellipse": (ellipse(0.8, 0.8), ellipse(1.0, 0.6, bump=0.45)),
    "cs": (letter_c(), letter_s()),
    "discs": (disc((-1.0, 0.0)) + disc((1.0, 0.0)), disc((1.0, 0.0)) + disc((-1.0, 0.0))),
    "hand": (hand((-14, -5, 1, 8, 38), (0, 0, 0, 0, -14)), hand((-30, -12, 4, 20, 56), (-18, -8, 6, 18, 14))),
    "fish": (smooth_outline(TROUT, FISH_COUNTS), smooth_outline(ANGELFISH, FISH_COUNTS)),
}
GROUPS = {"discs": ["left"] * 17 + ["right"] * 17}


def write(name, points, groups):
    header = "xyz"[:len(points[0])]
    rows = [",".join(header) + (",group" if groups else "")]
    for i, point in enumerate(points):
        rows.append(",".join([f"{round(v, 6) + 0:g}" for v in point] + groups[i:i + 1]))
    (FOLDER / f"{name}.csv").write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    for pair, (source, target) in PAIRS.items():
        write(f"{pair}_source", source, GROUPS.get(pair, []))
        write(f"{pair}_target", target, GROUPS.get(pair, []))
