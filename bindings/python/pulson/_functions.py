"""The functions: words of the command line out of keyword arguments, by the program's own tables."""

import contextlib
import difflib
import inspect
import keyword
import os
import sys
import tempfile
import warnings

import numpy as np

from . import _pulson, _results
from ._pulson import OwnNoise

_Shape = _pulson.Shape

# Options of the program that are no arguments here: of its files and streams.
_HIDDEN = {"help", "help-all", "out", "json", "quiet", "verbose", "config", "print-config"}
# Pictures are drawn where there is a folder for them.
_PICTURES = {"no-picture", "pictures", "width", "dpi"}


def _python_name(option):
    name = option.replace("-", "_")
    return name + "_" if keyword.iskeyword(name) else name


class _Table:
    """The options of a verb by their names in Python."""

    def __init__(self, options):
        options = [option for option in options if option["name"] not in _HIDDEN]
        self.positional = [option for option in options if option["positional"]]
        self.options = {_python_name(option["name"]): option for option in options if not option["positional"]}

    def parameters(self):
        return [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=_default_of(option))
            for name, option in self.options.items()
        ]

    def help(self):
        lines = []
        for name, option in self.options.items():
            default = f" [{option['default']}]" if option["default"] and not option["flag"] else ""
            lines.append(f"{name}: {_pulson._python_words(option['help'])}{default}")
        return "\n".join(lines)

    def find(self, function, name):
        if name in self.options:
            return self.options[name]
        near = difflib.get_close_matches(name, self.options, 1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise TypeError(f"{function}() got an unexpected keyword argument {name!r}{hint}")


def _default_of(option):
    if option["flag"]:
        return None if option["name"] == "flip-y" else False
    text = option["default"]
    if not text:
        return None
    for kind in (int, float):
        with contextlib.suppress(ValueError):
            return kind(text)
    return text


def _text(value):
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, np.generic):
        value = value.item()
    return repr(value) if isinstance(value, float) else os.fspath(value) if hasattr(value, "__fspath__") else str(value)


def _is_path(value):
    return isinstance(value, (str, os.PathLike))


def _shapes_of(value, name):
    """A list of Shape of what users have as shapes."""
    if isinstance(value, _Shape):
        return [value]
    if isinstance(value, _results.Shapes):
        return list(value)
    if isinstance(value, dict):
        shapes = []
        for key, points in value.items():
            shape = _one_shape(points, f"{name}[{key!r}]")
            shape.name = str(key)
            shapes.append(shape)
        return shapes
    if isinstance(value, (list, tuple)) and value and not np.isscalar(value[0]):
        if all(isinstance(one, _Shape) for one in value):
            return list(value)
        if all(np.ndim(one) == 2 for one in value):
            shapes = [_one_shape(one, f"{name}[{i}]") for i, one in enumerate(value)] if np.ndim(value[0]) == 2 else []
            for i, shape in enumerate(shapes):
                shape.name = f"{name}#{i + 1}"
            return shapes
    return _pulson._shapes_of(value, name)


def _one_shape(value, name):
    if isinstance(value, _Shape):
        return value
    shapes = _shapes_of(value, name)
    if len(shapes) != 1:
        raise ValueError(f"{name} has {len(shapes)} shapes; one is needed")
    return shapes[0]


class _Call:
    """Words for the program, and what it is to find behind them."""

    def __init__(self, verb, table):
        self.verb = verb
        self.table = table
        self.words = []
        self.held = {}
        self.own_noise = None
        self._scratch = None
        self._stack = contextlib.ExitStack()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._stack.close()

    @property
    def scratch(self):
        if self._scratch is None:
            self._scratch = self._stack.enter_context(tempfile.TemporaryDirectory(prefix="pulson-"))
        return self._scratch

    def shapes(self, value, name):
        """The words that address shapes."""
        if _is_path(value):
            path = os.fspath(value)
            return [path]
        if isinstance(value, (list, tuple)) and value and all(_is_path(one) for one in value):
            return [os.fspath(one) for one in value]
        self.held[name] = _shapes_of(value, name)
        return [name]

    def option(self, name, value):
        option = self.table.find(self.verb, name)
        word = "--" + option["name"]
        if value is None:
            return
        if option["flag"]:
            if option["name"] == "flip-y":
                self.words.append(word if value else "--no-flip-y")
            elif value:
                self.words.append(word)
            return
        kind = option["type"]
        if isinstance(value, OwnNoise):
            self.own_noise = value
            self.words.append(f"{word}={value}")
        elif kind.startswith("SHAPE") and not _is_path(value):
            self.words += [f"{word}={one}" for one in self.shapes(value, name.rstrip("_"))]
        elif isinstance(value, _results.Registration):
            path = os.path.join(self.scratch, "registration.json")
            value.write(path)
            self.words.append(f"{word}={path}")
        elif kind.startswith("FILE.csv:") and not _is_path(value):
            self.words.append(f"{word}={self.column(name, value)}")
        elif kind.startswith("FILE") and not _is_path(value):
            self.words.append(f"{word}={self.numbers(name, value)}")
        elif option["name"] in ("q", "p") and not isinstance(value, str):
            self.words.append(f"{word}={_points_text(value, name)}")
        elif isinstance(value, (list, tuple, np.ndarray)):
            self.words += [f"{word}={_text(one)}" for one in value]
        else:
            self.words.append(f"{word}={_text(value)}")

    def numbers(self, name, value):
        rows = np.asarray(value, dtype=float)
        path = os.path.join(self.scratch, f"{name}.csv")
        with open(path, "w", encoding="utf-8") as file:
            for row in rows.reshape(len(rows), -1):
                file.write(",".join(repr(float(x)) for x in row) + "\n")
        return path

    def column(self, name, value):
        shapes = next(iter(self.held.values()), None)
        items = value.items() if hasattr(value, "items") else None
        if items is None:
            if shapes is None:
                raise TypeError(f"{name} needs a dictionary by the names of shapes where these are in a file")
            value = list(value)
            if len(value) != len(shapes):
                raise ValueError(f"{name} has {len(value)} entries for {len(shapes)} shapes")
            items = zip((shape.name for shape in shapes), value)
        path = os.path.join(self.scratch, f"{name}.csv")
        import csv
        with open(path, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["specimen", "value"])
            writer.writerows([key, _text(one)] for key, one in items)
        return f"{path}:value"

    def run(self, out, progress):
        folder = os.fspath(out) if out is not None else os.path.join(self.scratch, "out")
        shown = _shown_progress(progress)
        said = _pulson._run([self.verb, f"--out={folder}", *self.words], self.held, self.own_noise, shown, out is None)
        _close(shown)
        _warn(said["warnings"])
        return folder, said

    def result(self, kind, record, out, progress, **more):
        folder, said = self.run(out, progress)
        facts, tables, arrays = _results.collect(folder, record)
        return kind(record=facts, summary=said["printed"], notes=said["notes"], exit_code=said["exit_code"],
                    tables=tables, arrays={**arrays, **more}, folder=None if out is None else folder)


def _points_text(value, name):
    points = np.asarray(value, dtype=float)
    if points.ndim == 1:
        points = points[:, None]
    if points.ndim != 2:
        raise ValueError(f"{name} has the shape {points.shape}; landmarks are rows, (N, d)")
    return ",".join("/".join(repr(float(x)) for x in row) for row in points)


def _warn(texts):
    for text in texts:
        warnings.warn(_pulson._python_words(text), _results.PulsonWarning, stacklevel=4)


class _Bar:
    """A line of progress on a terminal or in a notebook."""

    def __init__(self):
        self.used = False

    def __call__(self, fraction, text):
        self.used = True
        done = "" if fraction is None else f"{100 * fraction:3.0f} %  "
        sys.stderr.write(f"\r{done}{text}"[:100].ljust(80))
        sys.stderr.flush()

    def close(self):
        if self.used:
            sys.stderr.write("\r" + " " * 100 + "\r")
            sys.stderr.flush()


def _shown_progress(progress):
    if callable(progress):
        return progress
    if progress is None:
        progress = "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())
    return _Bar() if progress else None


def _close(progress):
    if isinstance(progress, _Bar):
        progress.close()


_TABLES = {}


def _table(verb):
    if verb not in _TABLES:
        _TABLES[verb] = _Table(_pulson._read_options() if verb == "read" else _pulson._options(verb))
    return _TABLES[verb]


def _by_table(verb, hidden=()):
    """Gives a function the keyword arguments of a verb's table, as its signature and in its documentation."""

    def decorate(function):
        table = _table(verb)
        for name in hidden:
            table.options.pop(name, None)
        signature = inspect.signature(function)
        own = [p for p in signature.parameters.values() if p.kind is not inspect.Parameter.VAR_KEYWORD]
        names = {p.name for p in own}
        function.__signature__ = signature.replace(
            parameters=own + [p for p in table.parameters() if p.name not in names])
        function.__doc__ = inspect.cleandoc(function.__doc__) + "\n\nOptions, as `pulson " + (
            verb + " --help-all` has them:\n\n" if verb != "read" else "convert --help-all` has them:\n\n") + table.help()
        return function

    return decorate


# Where arguments of the program are files beside its results.
_FIELDS = ("field", "field_grid", "field_extent", "field_every")


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


@_by_table("read")
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
    call = _Call("read", _table("read"))
    for name, value in options.items():
        call.option(name, value)
    shapes, notes = _pulson._read(os.fspath(path), call.words)
    return _results.Shapes(shapes, [_pulson._python_words(note) for note in notes])


def write(path, shapes, format=None):
    """Writes shapes in the format that the name of the file says, or `format`. Returns what the format cannot hold."""
    return _pulson._write(os.fspath(path), _shapes_of(shapes, "shapes"), format or "")


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
        return _pulson._procrustes_mean(_shapes_of(source, "source"), align)
    numbers = None if weights is None else np.ascontiguousarray(weights, dtype=float)
    return _pulson._align(_points(source, "source"), _points(target, "target"), align, reflect, numbers)


def _points(value, name):
    """Points of a shape or of an address; arrays stay as they are."""
    if _is_path(value):
        return _one_shape(read(value), name).points
    if isinstance(value, (_Shape, _results.Shapes)):
        return _one_shape(value, name).points
    return value


def shoot(q, p, kernel=_pulson._path_kernel, noise=None, *, time=1, steps=None, dt=None,
          integrator=_pulson._path_integrator, increments=None, seed=1):
    """The path of landmarks from positions q with momenta p, (N, d): a Trajectory.

    >>> import pulson
    >>> path = pulson.shoot([0, 2], [1, 0.5], "gaussian:alpha=1", time=1, steps=50)
    >>> path.q.shape, path.end.round(3).ravel()
    ((51, 2, 1), array([1.03 , 2.555]))

    It is that of `pulson simulate --shape`. `increments` are those of the noise, (steps, channels), else drawn by `seed`.
    """
    return _pulson._shoot(q, p, kernel, noise, time, steps, dt, integrator, increments, seed)


def load(path):
    """A Registration of `registration.json`, or of the folder that holds it."""
    path = os.fspath(path)
    if os.path.isdir(path):
        path = os.path.join(path, "registration.json")
    with open(path, encoding="utf-8") as file:
        return _results.Registration(_pulson._read_match(file.read(), path))


def _match_of(registration):
    if isinstance(registration, _results.Registration):
        return registration._match
    if _is_path(registration):
        return load(registration)._match
    raise TypeError(f"a Registration is needed, not {type(registration).__name__}")


def warp_points(registration, points, *, inverse=False, labels="metric", jacobians=False):
    """Points moved by the map of a registration, in the coordinates of its source; with `inverse` back from its target.

    >>> import numpy as np, pulson
    >>> source = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> match = pulson.register(source, source + [[0, 0], [0.2, 0], [0, 0], [0, 0]])
    >>> bool(np.allclose(match.warp_points(match.warp_points([[0.3, 0.4]]), inverse=True), [[0.3, 0.4]]))
    True

    Arrays (M, d) give arrays, a Shape or Shapes the same. With `jacobians` also the determinants, (M,).
    """
    match = _match_of(registration)
    if isinstance(points, _Shape):
        return _pulson._warp_shape(match, points, inverse, labels)
    if isinstance(points, _results.Shapes):
        return _results.Shapes([_pulson._warp_shape(match, shape, inverse, labels) for shape in points])
    return _pulson._warp_points(match, points, inverse, labels, jacobians)


@_by_table("warp", hidden=("field", "jacobian", "log_jacobian", "multiplicity", "folds", "holes", "grid",
                           "side_by_side", "overlay", "report", "displacement", "numbers", "animate", "samples", "seed",
                           "deviation", "fold_probability", "width", "dpi"))
def warp_image(registration, image, *, progress=None, **options):
    """A picture moved by the map of a registration: an array (rows, columns[, channels]) or the name of a file.

    Pixel (x, y) is image[y, x]; landmarks of arrays count pixels, as those of files without a frame.
    """
    call = _Call("warp_image", _table("warp"))
    for name, value in options.items():
        call.option(name, value)
    shown = _shown_progress(progress)
    picture = os.fspath(image) if _is_path(image) else np.asarray(image)
    facts = _pulson._warp_image(_match_of(registration), picture, call.words, shown)
    _close(shown)
    pixels, said = facts.pop("image"), facts.pop("warnings")
    _warn(said)
    return _results.WarpedImage(facts, notes=facts.pop("notes"), arrays={"image": pixels})


@_by_table("register")
def register(source, target=None, *, out=None, progress=None, **options):
    """Fits momenta, and noise, so that a source flows to a target: a Registration; or to several shapes: a Cohort.

    >>> import numpy as np, pulson
    >>> source = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> match = pulson.register(source, source + [[0, 0], [0.2, 0], [0, 0], [0, 0]], noise="ch-sd:beta=5%")
    >>> match.increments.shape, bool(match.rms < 0.01)
    ((20, 8), True)

    `out` is a folder for all that the program writes, pictures and a page among it; without it nothing is written.
    """
    table = _table("register")
    whole_run = out is not None or any(options.get(name) for name in ("template", "homotopy", "shard", "resume", "field"))
    if target is not None and not whole_run:
        pair = _pair(source, target, options)
        if pair is not None:
            return _register_pair(table, *pair, progress, options)
    with _Call("register", table) as call:
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
            match.notes, match.summary, match.folder = said["notes"], said["printed"], kept
            return match
        facts, tables, arrays = _results.collect(folder, "cohort.json")
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
    import csv
    return [row[column] for row in csv.DictReader(tables.text(name).splitlines())]


def _pair(source, target, options):
    """Both as one Shape each; None where either is several."""
    reading = {name: value for name, value in options.items() if name in _table("read").options}
    pair = []
    for value, name in ((source, "source"), (target, "target")):
        if _is_path(value):
            shapes = list(read(value, **reading))
        elif isinstance(value, (list, tuple)) and value and _is_path(value[0]):
            return None
        else:
            shapes = _shapes_of(value, name)
            if reading:
                return None  # held shapes are read with these
        if len(shapes) != 1:
            return None
        pair.append(shapes[0])
    return pair


def _register_pair(table, source, target, progress, options):
    with _Call("register", table) as call:
        weights = None
        for name, value in options.items():
            if name == "weights" and value is not None and not _is_path(value):
                weights = np.ascontiguousarray(value, dtype=float)
                if weights.shape != (len(source),):
                    raise ValueError(f"weights has the shape {weights.shape} for {len(source)} landmarks")
            elif isinstance(value, OwnNoise) and name == "noise":
                call.own_noise = value
            else:
                call.option(name, value)
        shown = _shown_progress(progress)
        said = _pulson._register_pair(source, target, call.words, weights, call.own_noise, shown)
        _close(shown)
        _warn(said["warnings"])
        return _results.Registration(said["match"], [_pulson._python_words(note) for note in said["notes"]])


@_by_table("simulate")
def simulate(*, out=None, progress=None, **options):
    """Sample paths of the stochastic system: q and p, (samples, steps + 1, N, d).

    >>> import pulson
    >>> paths = pulson.simulate(q=[0, 10], p=[4, 1], kernel="gaussian:alpha=1", noise="ch-sd:beta=1.5,on=2", time=5,
    ...                         samples=3)
    >>> paths.q.shape
    (3, 251, 2, 1)
    """
    with _Call("simulate", _table("simulate")) as call:
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


@_by_table("ensemble")
def ensemble(*, out=None, progress=None, **options):
    """Monte Carlo over many paths: crossing probability, mean paths, densities.

    >>> import pulson
    >>> many = pulson.ensemble(q=[0, 10], p=[4, 1], kernel="gaussian:alpha=1", noise="ch-sd:beta=1.5,on=2", time=20,
    ...                        samples=640)
    >>> many.samples, 0.2 < many.crossing["probability"] < 0.35
    (640, True)
    """
    with _Call("ensemble", _table("ensemble")) as call:
        for name, value in options.items():
            call.option(name, value)
        record = "sweep.json" if options.get("sweep") else "ensemble.json"
        return call.result(_results.Ensemble, record, out, progress)


@_by_table("compare")
def compare(shapes, *, out=None, progress=None, **options):
    """Fits several noise models to shapes and ranks them by their evidence: `noise` is a list of specifications."""
    with _Call("compare", _table("compare")) as call:
        positional = call.shapes(shapes, "shapes")
        for name, value in options.items():
            call.option(name, value)
        call.words += positional
        record = "recovery.json" if options.get("simulate") else "compare.json"
        return call.result(_results.Comparison, record, out, progress)


@_by_table("atlas")
def atlas(cohort, *, out=None, progress=None, **options):
    """Template and momenta of a cohort, its modes and regression: an Atlas."""
    with _Call("atlas", _table("atlas")) as call:
        positional = call.shapes(cohort, "cohort")
        for name, value in options.items():
            call.option(name, value)
        call.words += positional
        return call.result(_results.Atlas, "atlas.json", out, progress)


@_by_table("sample")
def sample(source, target, *, out=None, progress=None, **options):
    """Draws of the posterior of momenta, paths and parameters: Samples."""
    with _Call("sample", _table("sample")) as call:
        positional = call.shapes(source, "source") + call.shapes(target, "target")
        for name, value in options.items():
            call.option(name, value)
        call.words += positional
        record = "calibration.json" if options.get("calibrate") else "summary.json"
        return call.result(_results.Samples, record, out, progress)


@_by_table("audit")
def audit(shapes, *, out=None, progress=None, **options):
    """Which landmarks and specimens are wrong, and how: an Audit."""
    with _Call("audit", _table("audit")) as call:
        positional = call.shapes(shapes, "shapes")
        for name, value in options.items():
            call.option(name, value)
        call.words += positional
        return call.result(_results.Audit, "audit.json", out, progress)
