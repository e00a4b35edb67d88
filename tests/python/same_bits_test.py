"""Each function gives what the program gives, to the bit."""

import gzip
import os
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
        run("register", sample("leaves.tps") + "#1", sample("leaves.tps") + "#2", "-o", self.path("o"), "--no-picture")
        match = pulson.register(sample("leaves.tps") + "#1", sample("leaves.tps") + "#2")
        self.assertEqual(without(match.record), without(record_of(self.path("o"), "registration.json")))

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
        for name in ("leaves.tps", "fish_source.csv"):
            for out in ("out.json", "out.tps", "out.csv"):
                with self.subTest(name=name, out=out):
                    run("convert", sample(name), "--out", self.path(f"theirs-{name}-{out}"))
                    pulson.write(self.path(f"ours-{name}-{out}"), pulson.read(sample(name)))
                    with open(self.path(f"theirs-{name}-{out}"), "rb") as theirs, open(self.path(f"ours-{name}-{out}"), "rb") as ours:
                        self.assertEqual(ours.read(), theirs.read())


if __name__ == "__main__":
    unittest.main()
