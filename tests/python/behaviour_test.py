"""Messages, signals, threads, memory, what notebooks show."""

import _thread
import doctest
import gc
import inspect
import os
import pickle
import re
import threading
import time
import unittest
import warnings

import numpy as np
import pulson
from pulson import _calls, _functions, _pulson, _results

from program import InFolder, refusal, sample

Q = np.array([[0.0, 0.0], [1.0, 0.2], [0.4, 1.0]])
P = np.array([[0.5, 0.0], [0.0, -0.3], [0.2, 0.1]])


class Words(InFolder):
    def test_errors_have_the_program_s_words(self):
        for words, call in (
            (["register", sample("square.csv"), sample("square.csv"), "-o", self.path("o"), "--sigma", "-1"],
             lambda: pulson.register(sample("square.csv"), sample("square.csv"), sigma=-1)),
            (["register", sample("square.csv"), sample("square.csv"), "-o", self.path("o"), "--kernel", "gausian"],
             lambda: pulson.register(sample("square.csv"), sample("square.csv"), kernel="gausian")),
            (["register", sample("square.csv"), sample("fish_source.csv"), "-o", self.path("o")],
             lambda: pulson.register(sample("square.csv"), sample("fish_source.csv"))),
            (["atlas", sample("square.csv"), "-o", self.path("o")], lambda: pulson.atlas(sample("square.csv"))),
            (["simulate", "--q", "0,1", "--p", "1", "-o", self.path("o")], lambda: pulson.simulate(q=[0, 1], p=[1])),
        ):
            with self.subTest(words=words):
                with self.assertRaises(ValueError) as caught:
                    call()
                theirs = _pulson._python_words(refusal(*words)).removeprefix("pulson: ").split(" (see pulson")[0]
                self.assertEqual(str(caught.exception).strip(), theirs.strip())

    def test_kinds_of_errors(self):
        with self.assertRaisesRegex(TypeError, "did you mean 'sigma'"):
            pulson.register(Q, Q, sigmaa=1)
        with self.assertRaises(FileNotFoundError):
            pulson.read("not_there.tps")
        with self.assertRaisesRegex(ValueError, "lambda_"):
            pulson.register(Q, Q, lambda_="x")
        with self.assertRaises(ArithmeticError):
            pulson.shoot([0.0, 1.0], [1e90, -1e90], "gaussian:alpha=1", steps=2)

    def test_values_are_not_guessed(self):
        for options, error, words in (
            ({"robust": "no"}, TypeError, "True or False"),
            ({"flip_y": "down"}, TypeError, "True or False"),
            ({"sigma": True}, TypeError, "takes a value"),
            ({"align": False}, TypeError, "takes a value"),
            ({"align": None}, ValueError, "align='none'"),
        ):
            with self.subTest(options=options), self.assertRaisesRegex(error, words):
                pulson.register(Q, Q, **options)
        match = pulson.register(Q, Q + 0.1, noise=None, sigma=None)  # defaults
        np.testing.assert_array_equal(match.momenta, pulson.register(Q, Q + 0.1).momenta)

    def test_parts_of_one_value(self):
        match = pulson.register(Q, Q * [1, 1.2])
        image = np.arange(48.0).reshape(6, 8)
        result = match.warp_image(image, size=(9, 7), origin=(0, 0), background=(3,))
        np.testing.assert_array_equal(result.image, match.warp_image(image, size="9x7", origin="0,0", background="3").image)
        with self.assertRaisesRegex(TypeError, "like is the name of a file"):
            match.warp_image(image, like=image)

    def test_columns(self):
        shapes = pulson.read(sample("leaves.tps"))
        ages = [3.0, 1, 4, 1, 5, 9, 2, 6]
        by_name = dict(zip(shapes.names, ages))
        tables = [pulson.atlas(shapes, model="age", data={"age": data}, permutations=99).record for data in (ages, by_name)]
        self.assertEqual(tables[0]["models"], tables[1]["models"])
        with self.assertRaisesRegex(ValueError, "7 entries for 8 shapes"):
            pulson.atlas(shapes, model="age", data={"age": ages[1:]})
        with self.assertRaisesRegex(ValueError, "no entry for"):
            pulson.atlas(shapes, model="age", data={"age": {"other": 1}})

    def test_signatures_are_the_tables(self):
        parameters = inspect.signature(pulson.register).parameters
        self.assertEqual(parameters["sigma"].default, "0.5%")
        self.assertEqual(parameters["max_iterations"].kind, inspect.Parameter.KEYWORD_ONLY)
        for verb in ("register", "simulate", "ensemble", "compare", "atlas", "sample", "audit"):
            function = getattr(pulson, verb)
            names = {_calls.python_name(option["name"]) for option in _pulson._options(verb)
                     if not option["positional"] and option["name"] not in _calls.HIDDEN}
            self.assertLessEqual(names, set(inspect.signature(function).parameters))

    def test_warnings(self):
        with self.assertWarnsRegex(pulson.PulsonWarning, "not matched.*noise"):
            pulson.register(sample("swap_source.csv"), sample("swap_target.csv"))
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("default")
            for _ in range(2):
                pulson.register(sample("swap_source.csv"), sample("swap_target.csv"))
            pulson.register(sample("swap_source.csv"), sample("swap_target.csv"))
        self.assertEqual({one.filename for one in caught}, {__file__})
        self.assertEqual(len({one.lineno for one in caught}), 2)  # each line of the user's warns once


class Host(InFolder):
    def slow(self, **options):
        return pulson.ensemble(q=[0, 10], p=[4, 1], kernel="gaussian:alpha=1", noise="ch-sd:beta=1.5,on=2",
                               samples=2_000_000, threads=1, **options)

    def slow_noise(self):
        noise = pulson.OwnNoise(lambda q, p: 0.1 * p.ravel() * np.exp(-q.ravel()**2), like=Q)
        pulson.simulate(shape=Q, momenta=P, noise=noise, time=1, steps=100_000, samples=4)

    def test_keyboard_interrupt(self):
        for work in (self.slow, lambda: pulson.sample(sample("leaves.tps") + "#1", sample("leaves.tps") + "#2",
                                                      draws=100_000),
                     lambda: pulson.simulate(q=np.arange(200.0), p=np.ones(200), kernel="gaussian:alpha=1",
                                             time=1, steps=100_000),  # one path
                     lambda: pulson.shoot(np.arange(200.0), np.ones(200), "gaussian:alpha=1", steps=100_000),
                     self.slow_noise):
            timer = threading.Timer(0.4, _thread.interrupt_main)
            timer.start()
            begin = time.process_time()
            with self.assertRaises(KeyboardInterrupt):
                work()
            self.assertLess(time.process_time() - begin, 10)
        pulson.register(Q, Q + 0.1)  # and all goes on

    def test_progress(self):
        seen = []

        def progress(fraction, text):
            seen.append((fraction, text))
            if len(seen) == 2:
                raise RuntimeError("enough")

        with self.assertRaisesRegex(RuntimeError, "enough"):
            self.slow(progress=progress)
        self.assertEqual(len(seen), 2)
        self.assertTrue(all(0 <= fraction <= 1 and text for fraction, text in seen))

    def test_other_threads_run(self):
        ticks = []
        timer = threading.Timer(0.5, _thread.interrupt_main)
        ticker = threading.Thread(target=lambda: [(ticks.append(time.monotonic()), time.sleep(0.01)) for _ in range(40)])
        ticker.start()
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            self.slow()
        ticker.join()
        self.assertLess(np.diff(ticks).max(), 0.4)

    def test_four_threads(self):
        expected = pulson.register(Q, Q * [1, 1.2]).momenta
        moved = pulson.register(Q, Q * [1, 1.2]).warp_points(P)
        failures = []

        def work():
            for _ in range(5):
                match = pulson.register(Q, Q * [1, 1.2])
                if not (np.array_equal(match.momenta, expected) and np.array_equal(match.warp_points(P), moved)):
                    failures.append(match)

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])

    def test_shots_beside_a_verb(self):
        """They neither wait for it nor see it begin and end."""
        expected = pulson.shoot(Q, P, "gaussian:alpha=1", steps=20).end
        over = threading.Event()
        failures = []

        def shots():
            try:
                while not over.is_set():
                    if not np.array_equal(pulson.shoot(Q, P, "gaussian:alpha=1", steps=20).end, expected):
                        failures.append("another end")
            except BaseException as error:  # whatever it is
                failures.append(error)

        threads = [threading.Thread(target=shots) for _ in range(2)]
        for thread in threads:
            thread.start()
        for _ in range(100):
            pulson.register(Q, Q * [1, 1.2])
        over.set()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])

    def test_signal_handlers_and_streams_stay(self):
        import signal
        before = signal.getsignal(signal.SIGINT)
        pulson.register(sample("square.csv"), sample("square.csv"), out=self.path("o"))
        self.assertIs(signal.getsignal(signal.SIGINT), before)
        self.assertTrue(os.path.exists(self.path("o/registration.png")))

    def test_memory(self):
        def resident():
            with open("/proc/self/statm", encoding="ascii") as file:
                return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

        match = pulson.register(Q, Q * [1, 1.2])
        calls = int(os.environ.get("PULSON_CALLS", 3000))

        def work(count):
            for _ in range(count):
                pulson.shoot(Q, P, "gaussian:alpha=1", steps=2)
                match.warp_points(P)
                pulson.align(Q, P)
            for _ in range(count // 100):
                pulson.register(Q, Q * [1, 1.2])
            gc.collect()

        work(calls // 3)
        before = resident()
        work(calls)
        self.assertLess(resident() - before, 2_000_000)


class Shown(InFolder):
    def test_notebooks(self):
        match = pulson.register(sample("leaves.tps") + "#1", sample("leaves.tps") + "#2")
        self.assertIn("<table>", match._repr_html_())
        self.assertIn("rms", repr(match))
        self.assertIn("momenta", dir(match))
        again = pickle.loads(pickle.dumps(match))
        np.testing.assert_array_equal(again.momenta, match.momenta)
        match.write(self.path("r.json"))
        np.testing.assert_array_equal(pulson.load(self.path("r.json")).shoot().end, match.result)
        try:
            import matplotlib
        except ImportError:
            return
        matplotlib.use("Agg")
        axes = match.plot()
        self.assertGreater(len(axes.lines), 1)

    def test_pickles(self):
        shape = pulson.Shape(Q, labels=["a", "b", "c"], name="t", groups=["x", "x", "y"], y_up=True)
        again = pickle.loads(pickle.dumps(shape))
        for name in ("labels", "groups", "name", "y_up", "links", "absent", "units"):
            self.assertEqual(getattr(again, name), getattr(shape, name))
        np.testing.assert_array_equal(again.points, Q)
        shapes = pulson.read(sample("leaves.tps"))
        kept = pickle.loads(pickle.dumps(shapes))
        self.assertEqual(kept[1].image, shapes[1].image)
        np.testing.assert_array_equal(pulson.register(kept[0], kept[1]).momenta,
                                      pulson.register(shapes[0], shapes[1]).momenta)
        kernel = pulson.Kernel("gaussian:alpha=0.3")
        self.assertEqual(str(pickle.loads(pickle.dumps(kernel))), str(kernel))

    def test_frames(self):
        shapes = pulson.read(sample("leaves.tps"))
        self.assertIs(shapes[0].y_up, True)
        self.assertIsNone(pulson.Shape(Q).y_up)
        again = pulson.Shape(shapes[0].points, y_up=True)
        self.assertEqual(pulson.register(again, again).record["frame"]["y_down"], False)

    def test_cohorts(self):
        cohort = pulson.register(Q, {"a": Q + 0.1, "b": Q * 1.1})
        self.assertEqual(list(cohort.keys()), ["a", "b"])
        self.assertIs(cohort[1], cohort["b"])
        self.assertIn("shapes 2, matched 2", repr(cohort))
        shapes = pulson.read(sample("leaves.tps"))
        atlas = pulson.atlas(shapes)
        self.assertEqual(atlas.scores.shape, (8, 7))
        self.assertEqual(np.shape(atlas.modes["scores"])[0], 8)

    def test_a_registration_has_the_keys_of_its_record(self):
        match = pulson.register(Q, Q + [0.1, 0])
        self.assertEqual(match.steps, match.record["steps"])
        self.assertEqual(match.lambda_, match.record["lambda"])
        for name in dir(match):
            getattr(match, name)
        with self.assertRaisesRegex(AttributeError, "has no 'step'; it has .*, steps, "):
            match.step

    def test_the_pages(self):
        root = os.path.join(os.path.dirname(__file__), "..", "..")
        texts = []
        for page in ("python.md", "python_models.md"):
            with open(os.path.join(root, "docs", page), encoding="utf-8") as file:
                texts.append(file.read())
        text = "".join(texts)
        blocks = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
        self.assertEqual(len(blocks), 3)
        (session,) = re.findall(r"^```pycon\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
        before = os.getcwd()
        os.chdir(root)
        scope = {}
        try:
            exec(compile(blocks[0], "docs/python.md", "exec"), scope)
            example = doctest.DocTestParser().get_doctest(session, scope, "docs/python.md", None, 0)
            runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
            said = []
            runner.run(example, out=said.append)
            self.assertEqual(runner.failures, 0, "".join(said))
            for block in blocks[1:]:
                # Callbacks are slow: one step of the match says whether it runs.
                exec(compile(block.replace("steps=4", "steps=1"), "docs/python_models.md", "exec"), {})
        finally:
            os.chdir(before)
            scope.clear()
            gc.collect()  # the kernel of the page, which messages list

    def test_docstrings(self):
        for module in (pulson, _functions, _results):
            failed, tried = doctest.testmod(module)
            self.assertEqual(failed, 0)
        finder, runner = doctest.DocTestFinder(), doctest.DocTestRunner()
        for name in ("Shape", "Kernel", "OwnKernel", "OwnNoise"):
            for test in finder.find(getattr(pulson, name), name, module=False, globs={}):
                runner.run(test)
        self.assertEqual(runner.summarize().failed, 0)
        self.assertGreater(runner.summarize().attempted, 3)


if __name__ == "__main__":
    unittest.main()
