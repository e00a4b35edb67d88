"""Small problems whose posteriors are hard to sample: of posterior_trial.py."""
import math


def problem(source, target, noise, sigma, steps=4, alpha=1.0, lam=1.0, kernel="gaussian", fit=None):
    """Landmarks are lists of points, points numbers or tuples; None is a missing one. A list of targets is several."""
    def points(shape):
        return [None if x is None else list(x) if isinstance(x, tuple) else [x] for x in shape]
    targets = target if isinstance(target[0], list) else [target]
    return dict(source=points(source), targets=[points(t) for t in targets], noise=noise, sigma=sigma, steps=steps,
                alpha=alpha, lam=lam, kernel=kernel, fit=fit)


LINE, PAIR = [0, 0.6], [(0, 0), (1, 0)]
TRIANGLE = [(math.cos(t), math.sin(t)) for t in (0, 2 * math.pi / 3, 4 * math.pi / 3)]
CELL = [tuple(0.5 * x for x in point) for point in TRIANGLE]
PROBLEMS = {
    "swap": problem(LINE, [0.45, 0.2], "ch-sd:beta=0.5", 0.1),
    "swap-exact": problem(LINE, [0.45, 0.2], "ch-sd:beta=0.5", 0.03),
    "swap-vague": problem(LINE, [0.45, 0.2], "ch-sd:beta=0.5", 0.4),
    "swap-far": problem(LINE, [1.2, -0.4], "ch-sd:beta=0.5", 0.1),
    "swap-weak": problem(LINE, [0.6, 0], "ch-sd:beta=0.25", 0.1),
    "swap-10": problem(LINE, [0.45, 0.2], "ch-sd:beta=0.5", 0.1, steps=10),
    "swap-2": problem(LINE, [0.45, 0.2], "ch-sd:beta=0.5", 0.1, steps=2),
    "swap-narrow": problem(LINE, [0.45, 0.2], "ch-sd:beta=0.5", 0.05, alpha=0.5),
    "swap-strong": problem(LINE, [0.45, 0.2], "ch-sd:beta=1.5", 0.3),
    "swap-wide-prior": problem(LINE, [0.45, 0.2], "ch-sd:beta=0.3", 0.1, lam=0.1),
    "swap-peakon": problem(LINE, [0.45, 0.2], "ch-sd:beta=0.5", 0.1, kernel="peakon"),
    "swap-screened": problem(LINE, [0.45, 0.2], "ch-sd-screened:beta=0.8,gamma=0.5", 0.1),
    "swap-missing": problem(LINE, [0.8, None], "ch-sd:beta=0.5", 0.1),
    "swap-twice": problem(LINE, [[0.45, 0.2], [0.3, 0.9]], "ch-sd:beta=0.5", 0.1),
    "swap-fit": problem(LINE, [0.45, 0.2], "ch-sd:beta=0.5", 0.1, fit=0.5),
    "collide-momenta": problem([0, 1], [0.5, 0.52], "trouve-vialard:sigma=0.5", 0.05),
    "collide-strong": problem(LINE, [1.5, 1.6], "trouve-vialard:sigma=2", 0.05),
    "collide-cos": problem([0, 1], [0.5, 0.6], "p-sd:beta=0.5,fields=cos,wavenumber=2", 0.05),
    "stretch-kunita": problem(LINE, [0.3, 1.2], "kunita:beta=0.5,width=0.5", 0.05),
    "collide-kunita": problem(LINE, [0.4, 0.45], "kunita:beta=0.8,width=0.3", 0.05),
    "triple": problem([0, 0.5, 1], [0.6, 0.1, 1.2], "ch-sd:beta=0.5", 0.1, steps=3),
    "triple-cycle": problem([0, 0.4, 0.8], [0.8, 0, 0.4], "ch-sd:beta=0.6", 0.1),
    "triple-missing": problem([0, 0.4, 0.8], [0.5, None, 0.1], "ch-sd:beta=0.4", 0.1, steps=3),
    "still": problem(LINE, [0.2, 0.3], "none", 0.05, steps=8),
    "still-wide": problem(LINE, [0.9, 1.0], "none", 0.1, steps=8, lam=0.1),
    "plane-swap": problem(PAIR, [(1, 0.2), (0, 0.2)], "ch-sd:beta=0.3", 0.1, steps=3),
    "plane-swap-even": problem(PAIR, [(1, 0.02), (0, 0)], "ch-sd:beta=0.2", 0.15, steps=2),
    "plane-still-swap": problem(PAIR, [(1, 0.1), (0, 0)], "none", 0.15, steps=8),
    "plane-collide": problem(PAIR, [(0.5, 0), (0.55, 0.1)], "trouve-vialard:sigma=0.5", 0.05, steps=3),
    "plane-kunita": problem(PAIR, [(0.7, 0.7), (0.2, 0.1)], "kunita:beta=0.4,width=0.8", 0.08, steps=3),
    "plane-bump": problem(PAIR, [(1, 0.3), (0, 0)], "p-sd:beta=0.6,fields=bump,center=0.5/0,width=0.5", 0.15),
    "plane-screened": problem(PAIR, [(0.8, 0.2), (0.1, 0)], "ch-sd-screened:beta=0.8,gamma=1", 0.1, steps=3),
    "plane-missing": problem(CELL, [CELL[1], None, CELL[0]], "ch-sd:beta=0.3", 0.15, steps=2),
    "plane-cycle": problem(CELL, CELL[1:] + CELL[:1], "ch-sd:beta=0.3", 0.15, steps=2),
    "plane-still-cycle": problem(CELL, CELL[1:] + CELL[:1], "none", 0.15, steps=6),
    "space-swap": problem([(0, 0, 0), (1, 0, 0)], [(1, 0.1, 0.1), (0, 0, 0.1)], "ch-sd:beta=0.3", 0.2, steps=2),
    "space-momenta": problem([(0, 0, 0), (0.6, 0, 0)], [(0.5, 0.3, 0), (0.1, 0, 0.3)], "trouve-vialard:sigma=0.5", 0.1,
                             steps=2),
}
