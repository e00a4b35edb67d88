"""Arrays of all kinds that numpy makes, per function."""

import os
import tempfile
import unittest
import warnings

import numpy as np
import pulson

warnings.simplefilter("ignore", pulson.PulsonWarning)

SOURCE = np.array([[0.0, 0.0], [1.0, 0.125], [1.5, 1.0], [0.5, 1.25], [-0.25, 0.75]])
TARGET = SOURCE + np.array([[0.0, 0.125], [0.25, 0.0], [0.0, 0.0], [0.125, 0.0], [0.0, -0.125]])
COHORT = np.array([SOURCE, TARGET, 0.5 * (SOURCE + TARGET), SOURCE[:, ::1] * 1.0625])


def read_only(array):
    array = array.copy()
    array.flags.writeable = False
    return array


def strided(array):
    wide = np.full(array.shape[:-1] + (2 * array.shape[-1],), np.nan)
    wide[..., ::2] = array
    return wide[..., ::2]


# All have the same numbers: these are exact in float32.
KINDS = {
    "C order": lambda array: array.copy(),
    "Fortran order": np.asfortranarray,
    "float32": lambda array: array.astype(np.float32),
    "big-endian": lambda array: array.astype(">f8"),
    "strided": strided,
    "reversed": lambda array: array[::-1].copy()[::-1],
    "read-only": read_only,
    "list": lambda array: array.tolist(),
}

MATCH = pulson.register(SOURCE, TARGET)
ALIGNED = pulson.align(SOURCE, TARGET)
KERNEL = pulson.Kernel("gaussian:alpha=1")
NOISE = {"kernel": KERNEL, "noise": "ch-sd:beta=0.125", "steps": 3}


def written(x):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "x.csv")
        pulson.write(path, x)
        return np.genfromtxt(path, delimiter=",", skip_header=1, usecols=(-2, -1))


FUNCTIONS = {
    "align": lambda x: pulson.align(x, TARGET).points,
    "mean": lambda x: pulson.align(np.asarray(x)[None] + np.zeros((2, 1, 1))).points,
    "register": lambda x: pulson.register(x, TARGET).momenta,
    "register target": lambda x: pulson.register(TARGET, x).momenta,
    "warp_points": lambda x: MATCH.warp_points(x),
    "shoot": lambda x: pulson.shoot(x, 0.1 * TARGET, "gaussian:alpha=1", steps=3).q,
    "shoot p": lambda x: pulson.shoot(TARGET, x, "gaussian:alpha=1", steps=3).q,
    "simulate": lambda x: pulson.simulate(shape=x, momenta=TARGET, kernel="gaussian:alpha=1", steps=3).q,
    "simulate q": lambda x: pulson.simulate(q=x, p=TARGET, kernel="gaussian:alpha=1", steps=3, time=1).q,
    "ensemble": lambda x: pulson.ensemble(shape=x, noise="ch-sd:beta=0.1", kernel="gaussian:alpha=1", steps=3,
                                          samples=64).mean_q,
    "Shape": lambda x: pulson.Shape(x).points,
    "align target": lambda x: pulson.align(TARGET, x).points,
    "Alignment.apply": ALIGNED.apply,
    "inverse": lambda x: MATCH.warp_points(x, inverse=True),
    "jacobians": lambda x: MATCH.warp_points(x, jacobians=True)[1],
    "write": written,
    "simulate momenta": lambda x: pulson.simulate(shape=TARGET, momenta=x, **NOISE).p,
    "sample": lambda x: pulson.sample(x, TARGET, draws=4, warmup=4, chains=1, searches=1).momenta,
    "gram": lambda x: KERNEL.gram(x, TARGET),
    "gram y": lambda x: KERNEL.gram(TARGET, x),
    "velocity": lambda x: KERNEL.velocity(x, TARGET, SOURCE),
    "velocity q": lambda x: KERNEL.velocity(TARGET, x, SOURCE),
    "velocity p": lambda x: KERNEL.velocity(TARGET, SOURCE, x),
    "OwnNoise": lambda x: pulson.shoot(x, TARGET, KERNEL, pulson.OwnNoise(lambda q, p: 0.1 * p.ravel(), like=x), steps=2).q,
}
# Points of no shape: there may be none, and a missing one stays missing.
OF_SPACE = {"warp_points": (0, 2), "inverse": (0, 2), "jacobians": (0,), "Alignment.apply": (0, 2), "gram": (0, 5),
            "gram y": (5, 0), "velocity": (0, 2)}
# Numbers that are no landmarks.
WEIGHTS = np.array([1.0, 2.0, 0.5, 1.0, 0.25])
NUMBERS = {
    "align weights": (lambda x: pulson.align(SOURCE, TARGET, weights=x).points, WEIGHTS),
    "register weights": (lambda x: pulson.register(SOURCE, TARGET, weights=x).momenta, WEIGHTS),
    "covariances": (lambda x: pulson.register(SOURCE, TARGET, covariances=x).momenta,
                    np.array([[[2.0, 0.5], [0.5, 1.0]]] * 5) / 1024),
    "increments": (lambda x: pulson.shoot(SOURCE, TARGET, increments=x, **NOISE).q,
                   np.arange(30.0).reshape(3, 10) / 64),
    "covariate": (lambda x: pulson.atlas(COHORT, covariate=x, max_iterations=2).record["regression"],
                  np.array([1.0, 2.0, 4.0, 5.0])),
}
IMAGE = np.arange(48.0).reshape(6, 8)
COHORT_FUNCTIONS = {
    "register": lambda x: pulson.register(x, template="mean")["source#1"].momenta,
    "atlas": lambda x: pulson.atlas(x, max_iterations=2).momenta,
    "audit": lambda x: pulson.audit(x).record["findings"],
    "compare": lambda x: [m["log_evidence"] for m in pulson.compare(
        x, noise=["none"], source="mean", folds=0, importance=0, no_maps=True, sigma=0.05, lambda_=1,
        kernel="gaussian:alpha=1").record["models"]],
    "sample": lambda x: pulson.sample(SOURCE, x[1], draws=4, warmup=4, chains=1, searches=1).momenta,
}


class Kinds(unittest.TestCase):
    def test_shapes(self):
        for name, function in FUNCTIONS.items():
            expected = np.array(function(SOURCE))
            for kind, make in KINDS.items():
                with self.subTest(function=name, kind=kind):
                    given = make(SOURCE)
                    before = np.array(given)
                    np.testing.assert_array_equal(function(given), expected)
                    np.testing.assert_array_equal(given, before)

    def test_cohorts(self):
        for name, function in COHORT_FUNCTIONS.items():
            expected = function(COHORT)
            for kind in ("Fortran order", "float32", "strided", "read-only"):
                with self.subTest(function=name, kind=kind):
                    np.testing.assert_array_equal(function(KINDS[kind](COHORT)), expected)

    def test_numbers(self):
        for name, (function, numbers) in NUMBERS.items():
            expected = function(numbers)
            for kind, make in KINDS.items():
                with self.subTest(function=name, kind=kind):
                    np.testing.assert_equal(function(make(numbers)), expected)
            with self.subTest(function=name, wrong="empty"), self.assertRaises(ValueError):
                function(np.empty((0,) + numbers.shape[1:]))
            with self.subTest(function=name, wrong="one too few"), self.assertRaises(ValueError):
                function(numbers[1:])
            if name != "covariate":  # where it is missing
                with self.subTest(function=name, wrong="nan"), self.assertRaises((ValueError, ArithmeticError)) as caught:
                    function(np.full_like(numbers, np.nan))
                self.assertNotIn("/", str(caught.exception).split(" is ")[0])  # no file of the module's own

    def test_images(self):
        expected = MATCH.warp_image(IMAGE, background=0).image
        for kind, make in KINDS.items():
            with self.subTest(kind=kind):
                image = MATCH.warp_image(make(IMAGE), background=0).image
                np.testing.assert_allclose(image, expected, rtol=5e-7 if kind == "float32" else 0)
        for kind in (np.uint8, np.int8, np.uint16, np.int16, np.uint32, np.int32, np.int64, np.uint64, np.float32, np.float64, ">u2",
                     ">f4"):
            with self.subTest(kind=kind):
                image = MATCH.warp_image(IMAGE.astype(kind), background=0).image
                self.assertEqual(image.dtype, np.dtype(kind).newbyteorder("="))
                self.assertLessEqual(np.abs(image - expected).max(), 0.5)  # rounded, where there are no fractions
        colours = np.stack([IMAGE, 2 * IMAGE, 3 * IMAGE], axis=-1)
        for make in (KINDS["C order"], KINDS["Fortran order"], KINDS["strided"], KINDS["read-only"]):
            np.testing.assert_array_equal(MATCH.warp_image(make(colours), background=0).image[..., 0], expected)
        for wrong, error in ((np.empty((0, 3)), ValueError), (np.zeros(4), ValueError), (IMAGE.astype(complex), TypeError),
                             (IMAGE.astype(np.int64) + 2**40, TypeError)):
            with self.assertRaises(error):
                MATCH.warp_image(wrong)
        self.assertTrue(np.isnan(MATCH.warp_image(np.full_like(IMAGE, np.nan)).image).any())

    def test_empty(self):
        empty = np.empty((0, 2))
        for name, function in FUNCTIONS.items():
            with self.subTest(function=name):
                if name in OF_SPACE:
                    self.assertEqual(function(empty).shape, OF_SPACE[name])
                else:
                    with self.assertRaises(ValueError):
                        function(empty)
        for name, function in COHORT_FUNCTIONS.items():
            with self.subTest(function=name), self.assertRaises((ValueError, IndexError)):
                function(np.empty((0, 5, 2)))

    def test_nan(self):
        holed = SOURCE.copy()
        holed[1] = np.nan
        stays = {"write", "Shape", "warp_points", "inverse", "jacobians", "Alignment.apply", "gram", "velocity", "align"}
        shapes = {"register": (4, 2), "register target": (5, 2), "align target": (5, 2)}  # left out
        for name, function in FUNCTIONS.items():
            with self.subTest(function=name):
                if name in stays:
                    result = function(holed)
                    self.assertTrue(np.isnan(result[1]).all() and np.isfinite(np.delete(result, 1, 0)).all())
                elif name == "gram y":
                    self.assertTrue(np.isnan(function(holed)[:, 1]).all())
                elif name in shapes:
                    self.assertEqual(function(holed).shape, shapes[name])
                elif name == "sample":
                    self.assertTrue(np.isfinite(function(holed)).all())
                else:
                    with self.assertRaises(ValueError):
                        function(holed)
        np.testing.assert_array_equal(pulson.register(holed, TARGET).landmarks, [0, 2, 3, 4])
        np.testing.assert_array_equal(MATCH.landmarks, np.arange(5))
        cohort = COHORT.copy()
        cohort[1, 1] = np.nan
        for name, function in COHORT_FUNCTIONS.items():
            with self.subTest(function=name):
                self.assertIsNotNone(function(cohort))

    def test_wrong(self):
        for wrong, error, words in (
            (SOURCE.T, ValueError, "transpose"),
            (np.zeros((2, 3, 4, 2)), ValueError, "shape"),
            (SOURCE.astype(complex), TypeError, "complex"),
            (np.array([["a", "b"]]), TypeError, "numbers"),
            (object(), TypeError, ""),
        ):
            for name in ("align", "register", "warp_points", "shoot", "simulate", "Shape"):
                with self.subTest(function=name, wrong=wrong), self.assertRaisesRegex(error, words):
                    FUNCTIONS[name](wrong)

    def test_masked(self):
        mask = np.zeros(SOURCE.shape, dtype=bool)
        mask[1] = True
        for array in (SOURCE, (8 * SOURCE).astype(int)):
            holed = array.astype(float)
            holed[1] = np.nan
            masked = np.ma.masked_array(array, mask=mask)
            np.testing.assert_array_equal(pulson.Shape(masked).points, holed)
            np.testing.assert_array_equal(pulson.register(masked, TARGET).original, pulson.register(holed, TARGET).original)

    def test_line_and_space(self):
        line = pulson.register([0.0, 1.0, 2.0], [0.0, 1.1, 2.2])
        self.assertEqual(line.momenta.shape, (3, 1))
        space = np.random.default_rng(2).normal(size=(6, 3))
        self.assertEqual(pulson.register(space, space * [1, 1, 1.1]).momenta.shape, (6, 3))

    def test_points_of_shapes(self):
        moved, factors = MATCH.warp_points(SOURCE, jacobians=True)
        for given in (pulson.Shape(SOURCE), np.array([SOURCE, SOURCE]), pulson._results.Shapes([pulson.Shape(SOURCE)] * 2)):
            result, dets = MATCH.warp_points(given, jacobians=True)
            several = not isinstance(given, pulson.Shape)
            np.testing.assert_array_equal(np.array(result)[1] if several else result.points, moved)
            np.testing.assert_array_equal(dets[1] if several else dets, factors)
            np.testing.assert_array_equal(np.array(MATCH.warp_points(given))[1] if several else result.points, moved)

    def test_shoot_takes_shapes(self):
        np.testing.assert_array_equal(pulson.shoot(pulson.Shape(SOURCE), TARGET).q, pulson.shoot(SOURCE, TARGET).q)

    def test_no_copies(self):
        self.assertTrue(np.shares_memory(MATCH.momenta, MATCH.momenta))
        self.assertFalse(MATCH.momenta.flags.writeable)
        kept = pulson.register(SOURCE, TARGET).momenta  # lives on
        np.testing.assert_array_equal(kept, MATCH.momenta)


if __name__ == "__main__":
    unittest.main()
