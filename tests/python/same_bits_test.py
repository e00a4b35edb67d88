"""Each function gives what the program gives, to the bit."""

import gzip
import os
import pickle
import re
import unittest
import warnings

import numpy as np
import pulson

from program import InFolder, record_of, run, sample, without

warnings.simplefilter("ignore", pulson.PulsonWarning)


def leaves():
    return pulson.read(sample("leaves.tps"))


class SameBits(InFolder):
    def test_register_files(self):
        done = run("register", sample("leaves.tps") + "#1", sample("leaves.tps") + "#2", "-o", self.path("o"), "--no-picture")
        match = pulson.register(sample("leaves.tps") + "#1", sample("leaves.tps") + "#2")
        self.assertEqual(without(match.record), without(record_of(self.path("o"), "registration.json")))
        printed = [line for line in done.stdout.splitlines() if not line.startswith("wrote")]
        timeless = lambda lines: [re.sub(r"in [\d.]+ s", "", line) for line in lines]
        self.assertEqual(timeless(match.summary.splitlines()), timeless(printed))
        self.assertEqual(pickle.loads(pickle.dumps(match)).summary, match.summary)

    def test_register_arrays_with_options(self):
        source, target = (np.array(shape.points) for shape in leaves()[:2])
        options = ["--noise", "ch-sd:beta=5%", "--sigma", "1%", "--kernel", "gaussian:alpha=30%", "--lambda", "2e-5",
                   "--align", "rigid", "--max-iterations", "40", "--reflect"]
        run("register", self.npy("source.npy", source), self.npy("target.npy", target), "-o", self.path("o"),
            "--no-picture", *options)
        match = pulson.register(source, target, noise="ch-sd:beta=5%", sigma="1%", kernel="gaussian:alpha=30%",
                                lambda_=2e-5, align="rigid", max_iterations=40, reflect=True)
        record = record_of(self.path("o"), "registration.json")
        self.assert_same(match.momenta, record["momenta"])
        self.assert_same(match.increments, record["increments"])
        self.assert_same(match.result, record["result"])
        self.assertEqual(match.record["cost"], record["cost"])
        aligned = pulson.align(source, target, align="rigid", reflect=True)
        self.assert_same(aligned.points, record["source"])

    def test_register_fits_and_weighs(self):
        source, target = (np.array(shape.points) for shape in leaves()[:2])
        weights = np.linspace(0.5, 2, len(source))
        with open(self.path("w.csv"), "w", encoding="utf-8") as file:
            file.writelines(f"{x!r}\n" for x in map(float, weights))
        run("register", self.npy("source.npy", source), self.npy("target.npy", target), "-o", self.path("o"),
            "--no-picture", "--weights", self.path("w.csv"), "--kernel", "gaussian:alpha=fit")
        match = pulson.register(source, target, weights=weights, kernel="gaussian:alpha=fit")
        record = record_of(self.path("o"), "registration.json")
        self.assert_same(match.momenta, record["momenta"])
        self.assertEqual(match.kernel, record["kernel"])

    def test_cohort(self):
        few = leaves()[:3]
        pulson.write(self.path("few.tps"), few)
        run("register", self.path("few.tps"), "-o", self.path("o"), "--template", "mean", "--no-picture")
        cohort = pulson.register(pulson.read(self.path("few.tps")), template="mean")
        self.assertEqual(len(cohort), 3)
        for name in cohort:
            folder = os.path.join(self.path("o"), name)
            self.assert_same(cohort[name].momenta, record_of(folder, "registration.json")["momenta"])

    def test_points_and_picture(self):
        source, target = sample("discs_source.csv"), sample("discs_target.csv")
        run("register", source, target, "-o", self.path("o"), "--no-picture", "--noise", "ch-sd:beta=20%")
        match = pulson.register(source, target, noise="ch-sd:beta=20%")
        points = np.random.default_rng(1).normal(size=(7, 2))
        self.npy("points.npy", points)
        run("warp", self.path("o"), self.path("points.npy"), "-o", self.path("moved.csv"))
        moved = np.genfromtxt(self.path("moved.csv"), delimiter=",", names=True)
        self.assert_same(match.warp_points(points), np.column_stack([moved["x"], moved["y"]]))
        self.assert_same(pulson.load(self.path("o")).warp_points(points), match.warp_points(points))
        run("warp", self.path("o"), sample("discs.png"), "-o", self.path("moved.nrrd"), "--pixel-size",
            "0.0066666667", "--origin=-2,-1.2", "--flip-y")
        with open(self.path("moved.nrrd"), "rb") as file:
            header, pixels = file.read().split(b"\n\n", 1)
        self.assertIn(b"encoding: gzip", header)
        pixels = gzip.decompress(pixels)
        image = match.warp_image(sample("discs.png"), pixel_size=0.0066666667, origin="-2,-1.2", flip_y=True).image
        self.assertEqual(image.tobytes(), pixels)

    def test_inverse(self):
        source, target = (np.array(shape.points) for shape in leaves()[:2])
        run("register", self.npy("source.npy", source), self.npy("target.npy", target), "-o", self.path("o"),
            "--no-picture")
        run("warp", self.path("o"), self.path("target.npy"), "-o", self.path("back.csv"), "--inverse")
        back = np.genfromtxt(self.path("back.csv"), delimiter=",", names=True)
        match = pulson.register(source, target)
        self.assert_same(match.warp_points(target, inverse=True), np.column_stack([back["x"], back["y"]]))

    def test_simulate_and_shoot(self):
        q, p = np.array([[0.0, 0.0], [1.0, 0.25], [0.5, 1.0]]), np.array([[1.0, 0.0], [0.1, -0.3], [0.2, 0.7]])
        noise, kernel = "ch-sd:beta=0.1", "gaussian:alpha=0.7"
        run("simulate", "--shape", self.npy("q.npy", q), "--momenta", self.npy("p.npy", p), "--noise", noise, "--kernel",
            kernel, "--samples", 2, "-o", self.path("o"), "--no-picture")
        ours = pulson.simulate(shape=q, momenta=p, noise=noise, kernel=kernel, samples=2)
        with open(self.path("o/paths.csv"), encoding="utf-8", newline="") as file:
            self.assertEqual(ours.tables.text("paths.csv"), file.read())
        shot = pulson.shoot(q, p, kernel, noise)
        self.assert_same(shot.q, ours.q[0])
        self.assert_same(shot.p, ours.p[0])
        again = pulson.shoot(q, p, pulson.Kernel(kernel), noise, increments=shot.increments)
        self.assert_same(again.q, shot.q)
        typed = pulson.simulate(q=q, p=p, noise=noise, kernel=kernel, samples=2, time=1)
        self.assert_same(typed.q, ours.q)

    def test_ensemble(self):
        run("ensemble", "--q", "0,10", "--p", "4,1", "--kernel", "gaussian:alpha=1", "--noise", "ch-sd:beta=1.5,on=2",
            "--time", 10, "--samples", 256, "-o", self.path("o"), "--no-picture")
        ours = pulson.ensemble(q=[0, 10], p=[4, 1], kernel="gaussian:alpha=1", noise="ch-sd:beta=1.5,on=2", time=10,
                               samples=256)
        self.assertEqual(without(ours.record), without(record_of(self.path("o"), "ensemble.json")))
        self.assert_same(ours.mean_q, record_of(self.path("o"), "ensemble.json")["mean_q"])

    def test_atlas_audit_compare_sample(self):
        few = pulson.read(sample("leaves.tps"), landmarks="1,4,7,10,13,16")[:6]
        pulson.write(self.path("few.tps"), few)
        few = pulson.read(self.path("few.tps"))
        with self.subTest("atlas"):
            run("atlas", self.path("few.tps"), "-o", self.path("a"), "--no-picture")
            ours = pulson.atlas(few)
            self.assertEqual(without(ours.record), without(record_of(self.path("a"), "atlas.json")))
            self.assert_same(ours.momenta, np.load(self.path("a/momenta.npy")))
        with self.subTest("audit"):
            run("audit", self.path("few.tps"), "-o", self.path("d"))
            self.assertEqual(without(pulson.audit(few).record), without(record_of(self.path("d"), "audit.json")))
        with self.subTest("compare"):
            options = ["--noise", "none", "--noise", "trouve-vialard:sigma=fit", "--folds", 0, "--importance", 0,
                       "--no-maps"]
            run("compare", self.path("few.tps"), "-o", self.path("c"), "--no-picture", *options)
            ours = pulson.compare(few, noise=["none", "trouve-vialard:sigma=fit"], folds=0, importance=0, no_maps=True)
            self.assertEqual(without(ours.record), without(record_of(self.path("c"), "comparison.json")))
        with self.subTest("sample"):
            options = ["--draws", 20, "--warmup", 20, "--chains", 2]
            run("sample", self.path("few.tps") + "#1", self.path("few.tps") + "#2", "-o", self.path("s"), "--no-picture",
                *options)
            ours = pulson.sample(few[0], few[1], draws=20, warmup=20, chains=2)
            self.assert_same(ours.momenta, np.load(self.path("s/momenta.npy")))
            with open(self.path("s/draws.csv"), encoding="utf-8", newline="") as file:
                self.assertEqual(ours.tables.text("draws.csv"), file.read())

    def test_files(self):
        outs = ("out.json", "out.tps", "out.csv", "out.npy", "out.vtk", "out.fcsv", "out.mrk.json", "out.pts")
        for name in ("square.csv", "leaves.tps", "fish_source.csv", "cs_target.csv", "swap_source.csv"):
            shapes = pulson.read(sample(name))
            for out in outs if name == "square.csv" else outs[:1] if name == "swap_source.csv" else outs[:3]:
                with self.subTest(name=name, out=out):
                    theirs, ours = self.path(f"theirs-{name}-{out}"), self.path(f"ours-{name}-{out}")
                    run("convert", sample(name), "--out", theirs)
                    pulson.write(ours, shapes)
                    with open(theirs, "rb") as one, open(ours, "rb") as other:
                        self.assertEqual(other.read(), one.read())

    def test_procrustes_mean(self):
        few = leaves()[:3]
        pulson.write(self.path("few.tps"), few)
        run("register", self.path("few.tps"), "-o", self.path("o"), "--template", "mean", "--no-picture", "--align", "none",
            "--max-iterations", 1)
        for name in few.names:
            record = record_of(os.path.join(self.path("o"), name), "registration.json")
            self.assert_same(pulson.align(few, align="none").points, record["source"])

    def test_shapes_and_jacobians_are_moved(self):
        run("register", sample("leaves.tps") + "#1", sample("leaves.tps") + "#2", "-o", self.path("o"), "--no-picture")
        match = pulson.load(self.path("o"))
        for inverse in (False, True):
            words = ["--inverse"] if inverse else []
            run("warp", self.path("o"), sample("leaves.tps"), "-o", self.path("moved.json"), *words)
            theirs = pulson.read(self.path("moved.json"))
            ours = match.warp_points(leaves(), inverse=inverse)
            for one, other in zip(ours, theirs, strict=True):
                self.assert_same(one.points, other.points)
        points = np.array(leaves()[2].points)
        moved, jacobians = match.warp_points(points, jacobians=True)
        self.assert_same(moved, match.warp_points(points))
        run("warp", self.path("o"), sample("leaves.tps") + "#3", "-o", self.path("m.csv"), "--json", self.path("m.json"))
        self.assertEqual(jacobians.min(), record_of(self.folder, "m.json")["min_jacobian"])
        target = np.array(leaves()[1].points)
        back, there = match.warp_points(target, inverse=True, jacobians=True)
        np.testing.assert_allclose(there, match.warp_points(back, jacobians=True)[1], rtol=1e-9)
        # Differences of the points that are moved.
        step = 1e-4
        near = [points + shift for shift in step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])]
        right, left, up, down = (match.warp_points(one) for one in near)
        by_x, by_y = (right - left) / (2 * step), (up - down) / (2 * step)
        np.testing.assert_allclose(jacobians, by_x[:, 0] * by_y[:, 1] - by_x[:, 1] * by_y[:, 0], rtol=1e-6)

    def test_image_of_an_array(self):
        pixels = np.random.default_rng(3).integers(0, 255, (7, 9), dtype=np.uint8)
        header = "NRRD0004\ntype: uchar\ndimension: 2\nsizes: 9 7\nencoding: raw\n\n"
        with open(self.path("in.nrrd"), "wb") as file:
            file.write(header.encode() + pixels.tobytes())
        source = np.array([[1.0, 1.0], [7.0, 1.0], [4.0, 5.0], [2.0, 3.5]])
        target = source + [[0.5, 0], [0, 0.5], [0, 0], [-0.25, 0]]
        match = pulson.register(source, target)
        match.write(self.path("registration.json"))
        run("warp", self.path("registration.json"), self.path("in.nrrd"), "-o", self.path("out.nrrd"))
        with open(self.path("out.nrrd"), "rb") as file:
            header, theirs = file.read().split(b"\n\n", 1)
        self.assertIn(b"encoding: raw", header)
        self.assertEqual(match.warp_image(pixels, background=0).image.tobytes(), theirs)

    def test_options_that_are_arrays(self):
        few = leaves()[:5]
        pulson.write(self.path("few.tps"), few)
        sizes, forms = [1.0, 2.5, 3.0, 4.0, 7.0], ["a", "b", "a", "b", "b"]
        with open(self.path("t.csv"), "w", encoding="utf-8") as file:
            file.write("specimen,size,form\n")
            file.writelines(f"{name},{size},{form}\n" for name, size, form in zip(few.names, sizes, forms))
        for option, given, column in (("covariate", sizes, "size"), ("groups", forms, "form")):
            with self.subTest(option):
                run("atlas", self.path("few.tps"), "-o", self.path(option), "--no-picture", "--max-iterations", 3,
                    f"--{option}", self.path("t.csv") + ":" + column)
                theirs = record_of(self.path(option), "atlas.json")
                key = "regression" if option == "covariate" else "groups"
                for form in (given, np.array(given), dict(zip(few.names, given))):
                    ours = pulson.atlas(few, max_iterations=3, **{option: form})
                    self.assertEqual(without(ours.record[key], {"covariate", "grouping"}),
                                     without(theirs[key], {"covariate", "grouping"}))
                    self.assert_same(ours.momenta, np.load(self.path(option) + "/momenta.npy"))
        source, target = (np.array(shape.points) for shape in few[:2])
        covariances = np.array([[[4.0, 1.0], [1.0, 2.0]]] * len(source))
        np.savetxt(self.path("covariances.csv"), covariances.reshape(len(source), 4), delimiter=",", fmt="%r")
        run("register", self.npy("source.npy", source), self.npy("target.npy", target), "-o", self.path("o"), "--no-picture",
            "--covariances", self.path("covariances.csv"))
        self.assert_same(pulson.register(source, target, covariances=covariances).momenta,
                         record_of(self.path("o"), "registration.json")["momenta"])

    def test_facts(self):
        self.assertEqual(pulson.build().split(), run("--version").stdout.split())
        listed = [line.split()[0] for line in run("info", "formats").stdout.splitlines() if line and line[0] != " "]
        self.assertLessEqual(set(pulson.formats()), set(listed))

    # The list of functions is whole: each is called above.
    def test_every_function_is_here(self):
        with open(__file__, encoding="utf-8") as file:
            text = file.read()
        functions = [name for name in pulson.__all__ if callable(getattr(pulson, name)) and name.islower()]
        for name in functions:
            self.assertTrue(f"pulson.{name}(" in text or f"match.{name}(" in text, name)


if __name__ == "__main__":
    unittest.main()
