"""The functions of the module."""

import csv
import os

import numpy as np

from . import _pulson, _results, _tables
from ._calls import Call, Shape, by_table, close, is_path, one_shape, shapes_of, shown_progress, table_of, warn
from ._pulson import OwnNoise


def build():
    """Version, compiler and libraries, as `pulson --version` prints them."""
    return _pulson._build()


def formats():
    """The names of the formats that `read` reads.

    >>> import pulson
    >>> "tps" in pulson.formats()
    True
    """
    return _pulson._formats()


@by_table("read")
def read(path, **options):
    """The shapes of a landmark file, or the one of an address `file.tps#3` or `file.tps#id=NAME`.

    >>> import os, pulson, tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = os.path.join(folder.name, "a.csv")
    >>> pulson.write(path, [[0.0, 0.0], [1.0, 0.5]])
    []
    >>> pulson.read(path).points
    array([[[0. , 0. ],
            [1. , 0.5]]])
    """
    call = Call("read", table_of("read"))
    for name, value in options.items():
        call.option(name, value)
    shapes, notes = _pulson._read(os.fspath(path), call.words)
    return _results.Shapes(shapes, [_pulson._python_words(note) for note in notes])


def write(path, shapes, format=None):
    """Writes shapes in the format that the name of the file says, or `format`. Returns what the format cannot hold."""
    return _pulson._write(os.fspath(path), shapes_of(shapes, "shapes"), format or "")


def align(source, target=None, *, align="auto", reflect=False, weights=None):
    """The source brought onto the target by a translation, rigid, similarity or affine map; or shapes onto their mean.

    >>> import numpy as np, pulson
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> moved = pulson.align(square, 2 * square + [3, 1])
    >>> round(moved.scale, 6), np.allclose(moved.points, 2 * square + [3, 1])
    (2.0, True)

    Without a target the source is a cohort: its Procrustes mean is returned, a Shape.
    """
    if target is None:
        return _pulson._procrustes_mean(shapes_of(source, "source"), align)
    points = _points(source, "source")
    numbers = None if weights is None else _weights(weights, len(points))
    return _pulson._align(points, _points(target, "target"), align, reflect, numbers)


def _weights(value, count):
    numbers = np.ascontiguousarray(value, dtype=float)
    if numbers.shape != (count,):
        raise ValueError(f"weights has the shape {numbers.shape} for {count} landmarks")
    return numbers


def _points(value, name):
    """Points of a shape or of an address; arrays stay as they are."""
    if is_path(value):
        return one_shape(read(value), name).points
    if isinstance(value, (Shape, _results.Shapes)):
        return one_shape(value, name).points
    return value


def shoot(q, p, kernel=_pulson._path_kernel, noise=None, *, time=1, steps=None, dt=None,
          integrator=_pulson._path_integrator, increments=None, seed=1):
    """The path of landmarks from positions q with momenta p, (N, d): a Trajectory.

    >>> import pulson
    >>> path = pulson.shoot([0, 2], [1, 0.5], "gaussian:alpha=1", time=1, steps=50)
    >>> path.q.shape, path.end.round(3).ravel()
    ((51, 2, 1), array([0.993, 2.577]))

    It is that of `pulson simulate --shape`. `increments` are those of the noise, (steps, channels), else drawn by `seed`.
    """
    return _pulson._shoot(_points(q, "q"), _points(p, "p"), kernel, noise, time, steps, dt, integrator, increments, seed)


def load(path):
    """A Registration of `registration.json`, or of the folder that holds it."""
    path = os.fspath(path)
    if os.path.isdir(path):
        path = os.path.join(path, "registration.json")
    with open(path, encoding="utf-8") as file:
        return _results.registration_of(file.read(), path)


def _match_of(registration):
    if isinstance(registration, _results.Registration):
        return registration._match
    if is_path(registration):
        return load(registration)._match
    raise TypeError(f"a Registration is needed, not {type(registration).__name__}")


def warp_points(registration, points, *, inverse=False, labels="metric", jacobians=False):
    """Points moved by the map of a registration, in the coordinates of its source; with `inverse` back from its target.

    >>> import numpy as np, pulson
    >>> source = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> match = pulson.register(source, source + [[0, 0], [0.2, 0], [0, 0], [0, 0]])
    >>> bool(np.allclose(match.warp_points(match.warp_points([[0.3, 0.4]]), inverse=True), [[0.3, 0.4]]))
    True

    Arrays (M, d) give arrays, as (S, M, d) do, a Shape or Shapes the same. With `jacobians` a pair: also the
    determinants of the map from source to target there, alignment included, (M,); of several shapes a list of them.
    """
    match = _match_of(registration)
    if isinstance(points, (Shape, _results.Shapes)):
        shapes = [points] if isinstance(points, Shape) else list(points)
        moved = [_pulson._warp_shape(match, shape, inverse, labels) for shape in shapes]
        result = moved[0] if isinstance(points, Shape) else _results.Shapes(moved)
        if not jacobians:
            return result
        factors = [_pulson._warp_points(match, shape.points, inverse, labels, True)[1] for shape in shapes]
        return result, factors[0] if isinstance(points, Shape) else factors
    if np.ndim(points) == 3:
        parts = [_pulson._warp_points(match, shape, inverse, labels, jacobians) for shape in points]
        return (np.array([part[0] for part in parts]), [part[1] for part in parts]) if jacobians else np.array(parts)
    return _pulson._warp_points(match, points, inverse, labels, jacobians)


@by_table("warp", hidden=("field", "jacobian", "log_jacobian", "multiplicity", "folds", "holes", "grid",
                           "side_by_side", "overlay", "report", "displacement", "numbers", "animate", "samples", "seed",
                           "deviation", "fold_probability", "width", "dpi"))
def warp_image(registration, image, *, progress=None, **options):
    """A picture moved by the map of a registration: an array (rows, columns[, channels]) or the name of a file.

    Pixel (x, y) is image[y, x]; landmarks of arrays count pixels, as those of files without a frame.
    """
    call = Call("warp_image", table_of("warp"))
    for name, value in options.items():
        call.option(name, value)
    shown = shown_progress(progress)
    picture = os.fspath(image) if is_path(image) else np.asarray(image)
    kind = None if is_path(image) else picture.dtype
    if kind in (np.int64, np.uint64) and picture.size and abs(picture).max() < 2**31:
        picture = picture.astype(np.int32)  # as labels are
    facts = _pulson._warp_image(_match_of(registration), picture, call.words, shown)
    close(shown)
    pixels, said = facts.pop("image"), facts.pop("warnings")
    if kind in (np.int64, np.uint64):
        pixels = pixels.astype(kind)
    warn(said)
    return _results.WarpedImage(facts, notes=facts.pop("notes"), arrays={"image": pixels})


@by_table("register")
def register(source, target=None, *, out=None, progress=None, **options):
    """Fits momenta, and noise, so that a source flows to a target: a Registration; or to several shapes: a Cohort.

    >>> import numpy as np, pulson
    >>> source = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> match = pulson.register(source, source + [[0, 0], [0.2, 0], [0, 0], [0, 0]], noise="ch-sd:beta=5%")
    >>> match.increments.shape, bool(match.rms < 0.01)
    ((20, 8), True)

    `out` is a folder for all that the program writes, pictures and a page among it; without it nothing is written.
    """
    table = table_of("register")
    whole_run = out is not None or any(options.get(name) for name in ("template", "homotopy", "shard", "resume", "field"))
    if target is not None and not whole_run:
        pair = _pair(source, target, options)
        if pair is not None:
            return _register_pair(table, *pair, progress, options)
    with Call("register", table) as call:
        positional = call.shapes(source, "source")
        if target is not None:
            positional += call.shapes(target, "target")
        for name, value in options.items():
            call.option(name, value)
        call.words += positional
        folder, said = call.run(out, progress)
        kept = None if out is None else folder
        if os.path.exists(os.path.join(folder, "registration.json")) and not os.path.exists(
                os.path.join(folder, "cohort.json")):
            match = load(folder)
            match.notes, match._summary, match.folder = said["notes"], said["printed"].rstrip(), kept
            return match
        facts, tables, arrays = _tables.collect(folder, "cohort.json")
        rows = tables["cohort.csv"]
        names = [str(name) for name in _strings(tables, "cohort.csv", "specimen")]
        folders = _strings(tables, "cohort.csv", "folder") if "folder" in rows else names
        registrations = {
            name: load(os.path.join(folder, sub))
            for name, sub in zip(names, folders) if os.path.exists(os.path.join(folder, sub, "registration.json"))
        }
        return _results.Cohort(registrations, record=facts, summary=said["printed"], notes=said["notes"],
                               exit_code=said["exit_code"], tables=tables, arrays=arrays, folder=kept)


def _strings(tables, name, column):
    return [row[column] for row in csv.DictReader(tables.text(name).splitlines())]


def _pair(source, target, options):
    """Both as one Shape each; None where either is several."""
    reading = {name: value for name, value in options.items() if name in table_of("read").options}
    pair = []
    for value, name in ((source, "source"), (target, "target")):
        if is_path(value):
            shapes = list(read(value, **reading))
        elif isinstance(value, (list, tuple)) and value and is_path(value[0]):
            return None
        else:
            shapes = shapes_of(value, name)
            if reading:
                return None  # held shapes are read with these
        if len(shapes) != 1:
            return None
        pair.append(shapes[0])
    return pair


def _register_pair(table, source, target, progress, options):
    with Call("register", table) as call:
        weights = None
        for name, value in options.items():
            if name == "weights" and value is not None and not is_path(value):
                weights = _weights(value, len(source))
            elif isinstance(value, OwnNoise) and name == "noise":
                call.own_noise = value
            else:
                call.option(name, value)
        shown = shown_progress(progress)
        said = _pulson._register_pair(source, target, call.words, weights, call.own_noise, shown)
        close(shown)
        warn(said["warnings"])
        return _results.Registration(said["match"], [_pulson._python_words(note) for note in said["notes"]])


@by_table("simulate")
def simulate(*, out=None, progress=None, **options):
    """Sample paths of the stochastic system: q and p, (samples, steps + 1, N, d).

    >>> import pulson
    >>> paths = pulson.simulate(q=[0, 10], p=[4, 1], kernel="gaussian:alpha=1", noise="ch-sd:beta=1.5,on=2", time=5,
    ...                         samples=3)
    >>> paths.q.shape
    (3, 251, 2, 1)
    """
    with Call("simulate", table_of("simulate")) as call:
        for name, value in options.items():
            call.option(name, value)
        result = call.result(_results.Simulation, "simulation.json", out, progress)
        columns = result.tables["paths.csv"]
        axes = [axis for axis in "xyz" if f"q_{axis}" in columns]
        samples = columns["sample"].astype(int) - 1
        steps = np.unique(columns["step"])
        place = (samples, np.searchsorted(steps, columns["step"]), columns["landmark"].astype(int) - 1)
        shape = (samples.max() + 1, len(steps), place[2].max() + 1, len(axes))
        for name in "qp":
            array = np.full(shape, np.nan)
            for i, axis in enumerate(axes):
                array[(*place, i)] = columns[f"{name}_{axis}"]
            result._arrays[name] = array
        times = np.full(len(steps), np.nan)
        times[place[1]] = columns["time"]
        result._arrays["times"] = times
        return result


@by_table("ensemble")
def ensemble(*, out=None, progress=None, **options):
    """Monte Carlo over many paths: crossing probability, mean paths, densities.

    >>> import pulson
    >>> many = pulson.ensemble(q=[0, 10], p=[4, 1], kernel="gaussian:alpha=1", noise="ch-sd:beta=1.5,on=2", time=20,
    ...                        samples=640)
    >>> many.samples, 0.2 < many.crossing["probability"] < 0.35
    (640, True)
    """
    with Call("ensemble", table_of("ensemble")) as call:
        for name, value in options.items():
            call.option(name, value)
        record = "sweep.json" if options.get("sweep") else "ensemble.json"
        return call.result(_results.Ensemble, record, out, progress)


@by_table("compare")
def compare(shapes, *, out=None, progress=None, **options):
    """Fits several noise models to shapes and ranks them by their evidence: `noise` is a list of specifications."""
    with Call("compare", table_of("compare")) as call:
        positional = call.shapes(shapes, "shapes")
        for name, value in options.items():
            call.option(name, value)
        call.words += positional
        record = "recovery.json" if options.get("simulate") else "comparison.json"
        return call.result(_results.Comparison, record, out, progress)


@by_table("atlas")
def atlas(cohort, *, out=None, progress=None, **options):
    """Template and momenta of a cohort, its modes and regression: an Atlas."""
    with Call("atlas", table_of("atlas")) as call:
        positional = call.shapes(cohort, "cohort")
        for name, value in options.items():
            call.option(name, value)
        call.words += positional
        return call.result(_results.Atlas, "atlas.json", out, progress)


@by_table("sample")
def sample(source, target=None, *, out=None, progress=None, **options):
    """Draws of the posterior of momenta, paths and parameters: Samples. With `tree` a source alone is the shapes of its
    nodes, and the one at the root is estimated."""
    with Call("sample", table_of("sample")) as call:
        positional = call.shapes(source, "source")
        if target is not None:
            positional += call.shapes(target, "target")
        for name, value in options.items():
            call.option(name, value)
        call.words += positional
        record = "calibration.json" if options.get("calibrate") else "summary.json"
        return call.result(_results.Samples, record, out, progress)


@by_table("audit")
def audit(shapes, *, out=None, progress=None, **options):
    """Which landmarks and specimens are wrong, and how: an Audit."""
    with Call("audit", table_of("audit")) as call:
        positional = call.shapes(shapes, "shapes")
        for name, value in options.items():
            call.option(name, value)
        call.words += positional
        return call.result(_results.Audit, "audit.json", out, progress)
