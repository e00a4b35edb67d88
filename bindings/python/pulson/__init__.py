"""Stochastic LDDMM landmark registration.

>>> import numpy as np, pulson
>>> source = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
>>> match = pulson.register(source, source + [[0, 0], [0.2, 0], [0, 0], [0, 0]])
>>> match.momenta.shape, match.matched
((4, 2), True)

Landmarks are arrays (N, d), cohorts (S, N, d), a list of such or a dictionary by names; names of files, and what
`read` returns, do as well. Options are those of the program `pulson`, with its defaults and messages.
"""

from ._functions import (
    OwnNoise, align, atlas, audit, build, compare, ensemble, formats, load, read, register, sample, shoot, simulate,
    warp_image, warp_points, write)
from ._pulson import Alignment, Kernel, OwnKernel, Shape, Trajectory, __version__
from ._results import Atlas, Audit, Cohort, Comparison, Ensemble, PulsonWarning, Registration, Result, Samples, Shapes
from ._results import Simulation, WarpedImage

__all__ = [
    "Alignment", "Atlas", "Audit", "Cohort", "Comparison", "Ensemble", "Kernel", "OwnKernel", "OwnNoise",
    "PulsonWarning", "Registration", "Result", "Samples", "Shape", "Shapes", "Simulation", "Trajectory", "WarpedImage", "align", "atlas",
    "audit", "build", "compare", "ensemble", "formats", "load", "read", "register", "sample", "shoot", "simulate",
    "warp_image", "warp_points", "write"]
