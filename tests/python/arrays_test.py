"""Arrays of all kinds that numpy makes, per function."""

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
    "Kernel": lambda x: pulson.Kernel("gaussian:alpha=1").gram(x, TARGET),
}
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

    def test_empty(self):
        for name, function in FUNCTIONS.items():
            if name in ("mean", "Kernel", "warp_points"):
                continue
            with self.subTest(function=name), self.assertRaises(ValueError):
                function(np.empty((0, 2)))
        self.assertEqual(MATCH.warp_points(np.empty((0, 2))).shape, (0, 2))
        for name, function in COHORT_FUNCTIONS.items():
            with self.subTest(function=name), self.assertRaises((ValueError, IndexError)):
                function(np.empty((0, 5, 2)))

    def test_nan(self):
        holed = SOURCE.copy()
        holed[1] = np.nan
        for name in ("shoot", "shoot p", "simulate", "simulate q", "ensemble"):
            with self.subTest(function=name), self.assertRaises(ValueError):
                FUNCTIONS[name](holed)
        self.assertEqual(FUNCTIONS["register"](holed).shape, (4, 2))  # left out, as by the program
        self.assertEqual(FUNCTIONS["register target"](holed).shape, (5, 2))  # drops out of the data
        moved = MATCH.warp_points(holed)
        self.assertTrue(np.isnan(moved[1]).all() and np.isfinite(np.delete(moved, 1, 0)).all())

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

    def test_line_and_space(self):
        line = pulson.register([0.0, 1.0, 2.0], [0.0, 1.1, 2.2])
        self.assertEqual(line.momenta.shape, (3, 1))
        space = np.random.default_rng(2).normal(size=(6, 3))
        self.assertEqual(pulson.register(space, space * [1, 1, 1.1]).momenta.shape, (6, 3))

    def test_no_copies(self):
        self.assertTrue(np.shares_memory(MATCH.momenta, MATCH.momenta))
        self.assertFalse(MATCH.momenta.flags.writeable)
        kept = pulson.register(SOURCE, TARGET).momenta  # lives on
        np.testing.assert_array_equal(kept, MATCH.momenta)


if __name__ == "__main__":
    unittest.main()
