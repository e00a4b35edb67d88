"""Kernels and noise models written in Python."""

import gc
import pickle
import threading
import traceback
import unittest
import warnings
import weakref

import numpy as np
import pulson

warnings.simplefilter("ignore", pulson.PulsonWarning)

Q = np.array([[0.0, 0.0], [1.0, 0.2], [0.4, 1.0]])
P = np.array([[0.5, 0.0], [0.0, -0.3], [0.2, 0.1]])
TARGET = Q * [1, 1.2] + [[0, 0], [0.1, 0], [0, 0.05]]


def bell(s):
    return np.exp(-s)


def slope(s):
    return -np.exp(-s)


class OwnKernel(unittest.TestCase):
    def setUp(self):
        self.exact = pulson.OwnKernel(bell, slope, bell, name="bell")
        self.differences = pulson.OwnKernel(bell, name="bell-by-differences")
        self.first = pulson.OwnKernel(bell, slope)
        self.addCleanup(self.forget)  # and with the objects their names

    def forget(self):
        self.exact = self.differences = self.first = None

    def assert_close(self, ours, theirs, tolerance):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=tolerance * np.abs(theirs).max())

    # The Gaussian's own formula to round-off; by differences 3e-13 was measured, and 2e-10 of momenta.
    def each(self):
        for kernel, tolerance in ((self.exact, 1e-12), (self.first, 1e-12), (self.differences, 1e-10)):
            yield f"{kernel}:alpha=0.8", tolerance

    def test_simulate_and_shoot(self):
        for noise in (None, "ch-sd:beta=0.1"):
            options = {"shape": Q, "momenta": P, "noise": noise, "samples": 2, "steps": 20}
            theirs = pulson.simulate(kernel="gaussian:alpha=0.8", **options)
            for kernel, tolerance in self.each():
                ours = pulson.simulate(kernel=kernel, **options)
                self.assert_close(ours.q, theirs.q, tolerance)
                self.assert_close(ours.p, theirs.p, tolerance)
                self.assert_close(pulson.shoot(Q, P, kernel, noise, steps=20).q, theirs.q[0], tolerance)

    # The search stops where its gradient is small, not at one point: momenta are the same to its tolerance.
    def test_register(self):
        for options in ({}, {"noise": "ch-sd:beta=5%"}, {"mode": "map", "noise": "ch-sd:beta=0.1", "lambda_": 1}):
            theirs = pulson.register(Q, TARGET, kernel="gaussian:alpha=0.8", **options)
            for kernel, tolerance in self.each():
                ours = pulson.register(Q, TARGET, kernel=kernel, **options)
                self.assertTrue(ours.converged)
                self.assert_close(ours.momenta, theirs.momenta, 100 * tolerance)
                self.assert_close(ours.warp_points(P), theirs.warp_points(P), 100 * tolerance)
                self.assertEqual(ours.record["kernel"], kernel)

    def test_other_verbs(self):
        kernel = "bell:alpha=1"
        for sampler in ({"q": [0, 10], "p": [4, 1], "time": 2}, {"shape": Q, "momenta": P, "steps": 10}):
            options = {"noise": "ch-sd:beta=0.1", "samples": 16, **sampler}
            self.assert_close(pulson.ensemble(kernel=kernel, **options).mean_q,
                              pulson.ensemble(kernel="gaussian:alpha=1", **options).mean_q, 1e-12)
        cohort = np.array([Q, TARGET, Q + 0.1 * P])
        ours, theirs = (pulson.atlas(cohort, kernel=k, max_iterations=3) for k in (kernel, "gaussian:alpha=1"))
        self.assert_close(ours.template, theirs.template, 1e-8)

    def test_sums_line_and_space(self):
        for points in (np.array([0.0, 1.0, 2.5]), np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.5]])):
            for end in ("", "+matern32:alpha=2,weight=0.5"):
                ours = pulson.Kernel("bell:alpha=0.8" + end).velocity(points + 0.1, points, points)
                theirs = pulson.Kernel("gaussian:alpha=0.8" + end).velocity(points + 0.1, points, points)
                self.assert_close(ours, theirs, 1e-14)

    def test_kinks(self):
        exponential = pulson.OwnKernel(lambda s: (1 + np.sqrt(3 * s)) * np.exp(-np.sqrt(3 * s)))
        ours, theirs = (pulson.shoot(Q, P, kernel, steps=10) for kernel in (f"{exponential}:alpha=0.8", "matern32:alpha=0.8"))
        self.assert_close(ours.q, theirs.q, 1e-8)
        wendland = pulson.OwnKernel(lambda s: np.maximum(1 - np.sqrt(s), 0)**4 * (4 * np.sqrt(s) + 1))
        self.assertTrue(pulson.register(Q, TARGET, kernel=f"{wendland}:alpha=2").matched)

    def test_the_default_width(self):
        self.assertEqual(pulson.register(Q, TARGET, kernel=self.exact).kernel.replace("bell", "gaussian"),
                         pulson.register(Q, TARGET, kernel="gaussian").kernel)

    def test_what_is_wrong_is_refused(self):
        for message, words in (
            ("first differs", {"k": bell, "first": bell}),
            ("second differs", {"k": bell, "first": slope, "second": slope}),
            ("second is given without first", {"k": bell, "second": bell}),
            (r"k\(0\) is 2", {"k": lambda s: 2 * bell(s)}),
            ("not positive definite", {"k": lambda s: np.cos(3 * np.sqrt(s))}),
            ("not positive definite", {"k": lambda s: np.maximum(1 - np.sqrt(s), 0)}),  # it is one on a line alone
            ("of the shape of s", {"k": lambda s: bell(s)[:, None]}),
            ("of the shape of s", {"k": lambda s: 1.0}),
            ("returns nan", {"k": lambda s: np.where(s > 1, np.nan, bell(s))}),
            ("already", {"k": bell, "name": "gaussian"}),
            ("a name is", {"k": bell, "name": "a:b"}),
        ):
            with self.subTest(message=message), self.assertRaisesRegex(ValueError, message):
                pulson.OwnKernel(**words)
        with self.assertRaises(TypeError):
            pulson.OwnKernel(lambda s: "text")

    def test_names(self):
        match = pulson.register(Q, TARGET, kernel="bell:alpha=1")
        moved = match.warp_points(P)
        newer = pulson.OwnKernel(lambda s: 1 / (1 + s), name="bell")
        with self.assertRaisesRegex(ValueError, "another kernel than when"):
            match.shoot()
        del newer
        np.testing.assert_array_equal(match.warp_points(P), moved)
        self.exact = None  # the registration keeps it
        np.testing.assert_array_equal(match.warp_points(P), moved)
        record = match._match.record_text
        del match
        with self.assertRaisesRegex(ValueError, "unknown kernel 'bell'"):
            pulson._pulson._read_match(record, "record")

    # Functions know the names around the object that holds them.
    def test_a_name_that_passed_on(self):
        source = np.array([[0.0, 0.0], [1.0, 0.2], [0.4, 1.0]])
        one = pulson.OwnKernel(lambda s: 1 / (1 + s), name="passed")
        match = pulson.register(source, source * [1, 1.2], kernel=one)
        kept = pickle.dumps(match)
        np.testing.assert_array_equal(pickle.loads(kept).momenta, match.momenta)
        other = pulson.OwnKernel(lambda s: np.exp(-s), name="passed")
        for use in (lambda: pulson.register(source, source, kernel=one), lambda: pulson.shoot(source, source, one)):
            with self.assertRaisesRegex(ValueError, "another kernel was made with the name 'passed'"):
                use()
        with self.assertRaisesRegex(ValueError, "means another kernel"):
            pickle.loads(kept)
        pulson.register(source, source, kernel=other)

    def test_cycles_are_collected(self):
        scope = {"np": np, "pulson": pulson, "Q": Q}
        exec("def k(s):\n    return 1 / (1 + s)\n\ncyclic = pulson.OwnKernel(k, name='cyclic')\n"
             "noise = pulson.OwnNoise(lambda q, p: p.ravel(), like=Q)\nk.seen = noise", scope)
        seen = weakref.ref(scope["k"])
        match = scope["match"] = pulson.register(Q, TARGET, kernel="cyclic:alpha=1")
        scope.clear()
        gc.collect()
        self.assertIsNotNone(seen())
        match.warp_points(P)
        seen().match = match
        del match
        gc.collect()
        with self.assertRaisesRegex(ValueError, "unknown kernel"):
            pulson.Kernel("cyclic:alpha=1")
        self.assertIsNone(seen())

    def test_an_error_in_a_callback_is_python_s(self):
        broken = []

        def k(s):
            if broken:
                raise LookupError("of the kernel")
            return bell(s)

        own = pulson.OwnKernel(k)
        match = pulson.register(Q, TARGET, kernel=own)
        broken.append(True)
        for call in (lambda: pulson.register(Q, TARGET, kernel=own), lambda: pulson.shoot(Q, P, own),
                     lambda: pulson.simulate(shape=Q, momenta=P, kernel=own), lambda: match.warp_points(P),
                     lambda: pulson.ensemble(shape=Q, momenta=P, kernel=own, noise="ch-sd:beta=0.1", samples=8),
                     lambda: pulson.Kernel(f"{own}:alpha=1").gram(Q, Q)):
            try:  # assertRaises would drop the frames
                call()
                self.fail("no exception")
            except LookupError as error:
                self.assertEqual(str(error), "of the kernel")
                self.assertEqual(traceback.extract_tb(error.__traceback__)[-1].name, "k")
        broken.clear()
        pulson.register(Q, TARGET, kernel=own)

    def test_calls_from_a_callback_are_refused(self):
        inner = []

        def k(s):
            if inner:
                pulson.register(Q, TARGET)
            return bell(s)

        own = pulson.OwnKernel(k)
        inner.append(True)
        with self.assertRaisesRegex(RuntimeError, "at work in this thread"):
            pulson.register(Q, TARGET, kernel=own)

    def test_four_threads(self):
        expected = pulson.register(Q, TARGET, kernel="bell:alpha=0.8").momenta
        path = pulson.shoot(Q, P, "bell:alpha=0.8", steps=5).q
        failures = []

        def work():
            for _ in range(3):
                match = pulson.register(Q, TARGET, kernel="bell:alpha=0.8")
                shot = pulson.shoot(Q, P, "bell:alpha=0.8", steps=5)
                other = pulson.OwnKernel(bell)
                if not (np.array_equal(match.momenta, expected) and np.array_equal(shot.q, path)
                        and pulson.Kernel(f"{other}:alpha=1").gram([[0.0]], [[0.0]])[0, 0] == 1):
                    failures.append(match)

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])

    def test_both_of_one_s_own(self):
        noise = pulson.OwnNoise(lambda q, p: 0.1 * p.ravel(), like=Q)
        ours = pulson.simulate(shape=Q, momenta=P, noise=noise, kernel="bell:alpha=1", steps=5)
        theirs = pulson.simulate(shape=Q, momenta=P, noise="ch-sd:beta=0.1", kernel="gaussian:alpha=1", steps=5)
        self.assert_close(ours.q, theirs.q, 1e-9)


class OwnNoise(unittest.TestCase):
    def test_own_noise_is_the_built_in_one(self):
        beta = 0.3
        own = pulson.OwnNoise(lambda q, p: beta * p.ravel(), lambda q, p, w: (0 * q, beta * w.reshape(p.shape)),
                              lambda q, p, w, dq, dp: (0 * q, 0 * p), like=Q)
        target = Q[[1, 0, 2]]
        ours = pulson.register(Q, target, noise=own, lambda_=1, align="none", kernel="gaussian:alpha=1")
        theirs = pulson.register(Q, target, noise=f"ch-sd:beta={beta}", lambda_=1, align="none", kernel="gaussian:alpha=1")
        np.testing.assert_allclose(ours.momenta, theirs.momenta, rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(ours.increments, theirs.increments, rtol=1e-6, atol=1e-8)
        paths = [pulson.simulate(shape=Q, momenta=P, noise=noise, kernel="gaussian:alpha=1", time=0.2, samples=2)
                 for noise in (own, f"ch-sd:beta={beta}")]
        np.testing.assert_allclose(paths[0].q, paths[1].q, rtol=1e-12)

    def test_differences_in_place_of_derivatives(self):
        width, beta = 0.8, 0.2
        centre = np.array([0.3, 0.4])

        def potentials(q, p):
            bump = np.exp(-((q - centre)**2).sum(1) / width**2)
            return beta * (bump[:, None] * p).sum(0)

        own = pulson.OwnNoise(potentials, like=Q)
        self.assertTrue(own.traits["compensated"] and own.traits["linear"] and own.traits["moves_momenta"])
        spec = "p-sd:beta=0.2,fields=bump,center=0.3/0.4,width=0.8"
        paths = [pulson.simulate(shape=Q, momenta=P, noise=noise, kernel="gaussian:alpha=1", time=0.2)
                 for noise in (own, spec)]
        np.testing.assert_allclose(paths[0].q, paths[1].q, atol=1e-6)
        np.testing.assert_allclose(paths[0].p, paths[1].p, atol=1e-6)

    def test_wrong_derivatives_are_refused(self):
        with self.assertRaisesRegex(ValueError, "gradient differs"):
            pulson.OwnNoise(lambda q, p: p.ravel(), lambda q, p, w: (0 * q, 2 * w.reshape(p.shape)), like=Q)
        with self.assertRaisesRegex(ValueError, "affine"):
            pulson.OwnNoise(lambda q, p: (p**2).ravel(), like=Q)
        with self.assertRaisesRegex(ZeroDivisionError, "zero"):
            pulson.OwnNoise(lambda q, p: 1 / 0, like=Q)
        own = pulson.OwnNoise(lambda q, p: p.ravel(), like=Q)
        with self.assertRaisesRegex(ValueError, "3 landmarks"):
            pulson.simulate(shape=Q[:2], noise=own)

    def test_a_record_that_nothing_reads_is_not_written(self):
        source = np.array([[0.0, 0.0], [1.0, 0.2], [0.4, 1.0]])
        noise = pulson.OwnNoise(lambda q, p: 0.1 * p.ravel(), like=source)
        match = pulson.register(source, source * [1, 1.2], noise=noise)
        for use in (lambda: pickle.dumps(match), lambda: match.write("not_written.json")):
            with self.assertRaisesRegex(ValueError, "written in Python"):
                use()
        with self.assertRaisesRegex(ValueError, "one source to one target"):
            pulson.compare([source, source], noise=[noise])

    def test_an_error_in_a_callback_is_raised(self):
        fails = []

        def potentials(q, p):
            if fails:
                raise LookupError("of the model")
            return p.ravel()

        own = pulson.OwnNoise(potentials, like=Q)
        fails.append(True)
        with self.assertRaisesRegex(LookupError, "of the model"):
            pulson.simulate(shape=Q, noise=own, steps=2)


if __name__ == "__main__":
    unittest.main()
