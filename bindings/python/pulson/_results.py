"""What the functions return: records of the program with arrays, a table for notebooks and plots."""

import html
import json
import keyword
import re

import numpy as np

from . import _pulson


class PulsonWarning(UserWarning):
    """What the program prints as a warning."""


def _array(value):
    """Nested lists of numbers as an array, null as nan, in dictionaries, too; all else as it is."""
    if isinstance(value, dict):
        return {key: _array(one) for key, one in value.items()}
    if not isinstance(value, list) or not value:
        return value
    flat = value
    while isinstance(flat, list) and flat:
        flat = flat[0]
    if isinstance(flat, (str, dict, bool, list)):
        return value
    try:
        return np.array(value, dtype=float)
    except (TypeError, ValueError):
        return value


class Shapes:
    """Shapes of a file, in its order: a sequence of Shape, and an array (S, N, d).

    >>> import pulson
    >>> shapes = pulson.Shapes([pulson.Shape([[0, 0], [1, 0]], name="a"), pulson.Shape([[0, 1], [1, 1]], name="b")])
    >>> shapes, shapes.names, shapes.points.shape
    (<Shapes: 2 of 2 landmarks in 2D>, ['a', 'b'], (2, 2, 2))
    """

    def __init__(self, shapes, notes=()):
        self._shapes = list(shapes)
        self.notes = list(notes)

    def __len__(self):
        return len(self._shapes)

    def __getitem__(self, key):
        if isinstance(key, str):
            found = [shape for shape in self._shapes if shape.name == key]
            if len(found) != 1:
                raise KeyError(f"{len(found)} shapes are named {key!r}")
            return found[0]
        chosen = self._shapes[key]
        return Shapes(chosen, self.notes) if isinstance(key, slice) else chosen

    def __iter__(self):
        return iter(self._shapes)

    @property
    def names(self):
        return [shape.name for shape in self._shapes]

    @property
    def labels(self):
        return self._shapes[0].labels if self._shapes else []

    @property
    def points(self):
        counts = sorted({len(shape) for shape in self._shapes})
        if len(counts) > 1:
            raise ValueError(f"the shapes have {counts[0]} to {counts[-1]} landmarks; take the points of each")
        return np.array([shape.points for shape in self._shapes])

    def __array__(self, dtype=None, copy=None):
        points = self.points
        return points if dtype is None else points.astype(dtype)

    def __repr__(self):
        counts = sorted({len(shape) for shape in self._shapes})
        if not counts:
            return "<Shapes: none>"
        several = str(counts[0]) if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
        return f"<Shapes: {len(self)} of {several} landmarks in {self._shapes[0].points.shape[1]}D>"

    def _repr_html_(self):
        rows = "".join(
            f"<tr><td>{html.escape(shape.name)}</td><td>{len(shape)}</td><td>{shape.centroid_size:.4g}</td></tr>"
            for shape in self._shapes[:20])
        more = f"<tr><td colspan=3>… {len(self)} in all</td></tr>" if len(self) > 20 else ""
        return f"<table><tr><th>shape</th><th>landmarks</th><th>centroid size</th></tr>{rows}{more}</table>"

    def plot(self, ax=None):
        ax = _axes(ax)
        for shape in self._shapes:
            _scatter(ax, shape.points, y_down=shape.y_up is False, s=9, alpha=0.6)
        return ax


def _axes(ax=None):
    if ax is not None:
        return ax
    try:
        import matplotlib.pyplot as plt
    except ImportError:
        raise ImportError("plots need matplotlib: apt install python3-matplotlib, or pip install matplotlib") from None
    return plt.subplots(layout="constrained")[1]


def _plane(points):
    """The first two coordinates; on a line all points lie at 0."""
    points = np.atleast_2d(np.asarray(points, dtype=float))
    y = points[:, 1] if points.shape[1] > 1 else np.zeros(len(points))
    return points[:, 0], y


def _scatter(ax, points, y_down=False, **style):
    ax.scatter(*_plane(points), **style)
    if np.shape(points)[1] > 1:
        ax.set_aspect("equal", adjustable="datalim")
    if y_down and not ax.yaxis_inverted():
        ax.invert_yaxis()


def _fact(value):
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.5g}"
    # Specifications have all digits, which nobody reads here.
    return re.sub(r"\d+\.\d{4,}(?:e[-+]?\d+)?", lambda number: f"{float(number[0]):.4g}", str(value))


class Result:
    """A record of the program: its keys are attributes, lists of numbers are arrays.

    `record` is the whole record as the program writes it, `summary` what it prints, `notes` what it notes. `tables`
    are its csv files, as columns; arrays that it writes as .npy are attributes.
    """

    _facts = ()

    def __init__(self, record, summary="", notes=(), exit_code=0, tables=None, arrays=None, folder=None):
        self.record = record
        self.summary = summary
        self.notes = list(notes)
        self.converged = exit_code != 3
        self.tables = tables or {}
        self.folder = folder
        self._arrays = arrays or {}

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        if name in self._arrays:
            return self._arrays[name]
        record = {} if name == "record" else self.record
        for key in (name, name.rstrip("_")):
            if key in record:
                return _array(record[key])
        raise AttributeError(f"{type(self).__name__} has no {name!r}; it has {', '.join(dir(self))}")

    def __dir__(self):
        own = [name for name in super().__dir__() if not name.startswith("_")]
        keys = (key + "_" if keyword.iskeyword(key) else key for key in self.record if key.isidentifier())
        return sorted({*own, *self._arrays, *keys})

    def _scalars(self):
        found = []
        for key, value in self.record.items():
            if isinstance(value, (bool, int, float, str)) and len(str(value)) < 200:
                found.append((key, value))
        return found

    def __repr__(self):
        facts = [f"{name} {_fact(value)}" for name, value in self._headline()]
        return f"<{type(self).__name__}: {', '.join(facts)}>"

    def _headline(self):
        return self._scalars()[:4]

    def _repr_html_(self):
        rows = "".join(f"<tr><th style='text-align:left'>{html.escape(key)}</th><td>{html.escape(_fact(value))}</td></tr>"
                       for key, value in self._scalars())
        notes = "".join(f"<li>{html.escape(note)}</li>" for note in self.notes)
        return f"<table>{rows}</table>" + (f"<ul>{notes}</ul>" if notes else "")


class Registration(Result):
    """A flow from one shape to another: see `register`."""

    def __init__(self, match, notes=(), summary=None, folder=None):
        self._match = match
        self._own_kernels = match.own_kernels  # kept, as it is made of them
        self._read = None
        self.notes = list(notes)
        self._summary = summary
        self.tables = {}
        self.folder = folder
        self._arrays = {}

    @property
    def record(self):
        """registration.json, which `write` writes and the program replays."""
        if self._read is None:
            self._read = json.loads(self._match.record_text)
        return self._read

    @property
    def summary(self):
        """What the program prints of it."""
        if self._summary is None:
            self._summary = self._match.summary.rstrip()
        return self._summary

    momenta = property(lambda self: self._match.momenta, doc="p0, (N, d)")
    result = property(lambda self: self._match.result, doc="where the flow takes the source, (N, d)")
    source = property(lambda self: self._match.source, doc="q0, the source after alignment, (N, d)")
    target = property(lambda self: self._match.target, doc="(N, d)")
    original = property(lambda self: self._match.original, doc="the source as given, (N, d)")
    increments = property(lambda self: self._match.increments, doc="of the noise, (steps, channels)")
    distances = property(lambda self: self._match.distances, doc="of each landmark from its target, (N,)")
    landmarks = property(lambda self: self._match.landmarks,
                         doc="which of the source as given were matched, from 0, (N,): those with all coordinates")
    kernel = property(lambda self: self._match.kernel)
    noise = property(lambda self: self._match.noise)
    rms = property(lambda self: self._match.rms, doc="root mean square distance per landmark")
    matched = property(lambda self: self._match.matched)
    converged = property(lambda self: self._match.converged)

    def shoot(self):
        """The path of the landmarks, a Trajectory."""
        return self._match.shoot()

    def warp_points(self, points, **options):
        from . import _functions
        return _functions.warp_points(self, points, **options)

    def warp_image(self, image, **options):
        from . import _functions
        return _functions.warp_image(self, image, **options)

    def write(self, path):
        """Writes the record, for `load` and for `pulson warp`."""
        self._require_readable()
        with open(path, "w", encoding="utf-8") as file:
            file.write(self._match.record_text)

    def _require_readable(self):
        if self._match.has_own_noise:
            raise ValueError(f"the noise {self.noise!r} is written in Python: nothing could read this record again; keep "
                             "momenta and increments, and shoot() with them")

    def __reduce__(self):
        self._require_readable()
        return (registration_of, (self._match.record_text, "registration", self.notes, self.summary))

    def _headline(self):
        return [("rms", self.rms), ("matched", self.matched), ("converged", self.converged), ("kernel", self.kernel),
                ("noise", self.noise)]

    def plot(self, ax=None):
        """Source, target and the paths between, over a grid that the map deforms; on a line the paths over time."""
        ax = _axes(ax)
        path = self.shoot()
        if path.q.shape[2] == 1:
            ax.plot(path.times, path.q[:, :, 0], color="0.7", linewidth=1)
            ax.plot(np.zeros(len(self.source)), self.source[:, 0], "o", markersize=4, label="source")
            ax.plot(np.full(len(self.target), path.times[-1]), self.target[:, 0], "o", markersize=7, markerfacecolor="none",
                    color="tab:red", label="target")
            ax.set(xlabel="t", ylabel="position")
            ax.legend()
            return ax
        if path.q.shape[2] == 2:
            for line in self._deformed_grid():
                ax.plot(*_plane(line), color="0.9", linewidth=0.6, zorder=0)
        for a in range(path.q.shape[1]):
            ax.plot(*_plane(path.q[:, a]), color="0.7", linewidth=1)
        y_down = (self.record.get("frame") or {}).get("y_down", False)
        _scatter(ax, self.source, y_down, s=16, label="source")
        _scatter(ax, self.target, y_down, s=40, facecolors="none", edgecolors="tab:red", label="target")
        _scatter(ax, self.result, y_down, s=9, color="tab:green", label="result")
        ax.legend()
        return ax

    def _deformed_grid(self, lines=17, points=49):
        """Lines about the source as it was given, where the map takes them."""
        low, high = np.nanmin(self.original, axis=0), np.nanmax(self.original, axis=0)
        margin = 0.1 * max(high - low)
        fine, coarse = np.linspace(0, 1, points), np.linspace(0, 1, lines)
        unit = [np.column_stack(pair) for s in coarse for pair in ((np.full(points, s), fine), (fine, np.full(points, s)))]
        there = np.concatenate([low - margin + one * (high - low + 2 * margin) for one in unit])
        return self.warp_points(there).reshape(len(unit), points, 2)


def registration_of(text, name, notes=(), summary=None):
    """Of a record. Where its kernel is written in Python the name may mean another by now: the flow is then another."""
    match = _pulson._read_match(text, name)
    if match.own_kernels:
        ends = match.shoot().end
        size = np.ptp(match.source, axis=0).max()
        if not np.allclose(ends, match.result, rtol=0, atol=1e-9 * size):
            raise ValueError(f"{name}: the name in kernel {match.kernel!r} means another kernel than when it was made")
    return Registration(match, notes, summary)


class Cohort(Result):
    """Registrations of one source to several shapes, by name: see `register`."""

    def __init__(self, registrations, **rest):
        super().__init__(**rest)
        self.registrations = registrations

    def __getitem__(self, name):
        """By the name of a shape, or by its place."""
        if isinstance(name, (int, np.integer)):
            return list(self.registrations.values())[name]
        return self.registrations[name]

    def __len__(self):
        return len(self.registrations)

    def __iter__(self):
        return iter(self.registrations)

    def keys(self):
        return self.registrations.keys()

    def values(self):
        return self.registrations.values()

    def items(self):
        return self.registrations.items()

    def _headline(self):
        matches = list(self.registrations.values())
        facts = [("shapes", len(matches)), ("matched", sum(match.matched for match in matches)),
                 ("mean rms", float(np.mean([match.rms for match in matches])) if matches else np.nan)]
        return facts + [(key, self.record[key]) for key in ("failed", "unconverged") if self.record.get(key)]

    def plot(self, ax=None):
        """The source, and where the flows take it, each alignment undone."""
        ax = _axes(ax)
        for match in self.registrations.values():
            map_ = match.record["alignment"]
            linear = map_["scale"] * np.array(map_["linear"])
            _scatter(ax, np.linalg.solve(linear, (match.result - map_["translation"]).T).T, s=9, alpha=0.6)
        for match in list(self.registrations.values())[:1]:
            _scatter(ax, match.original, s=25, color="k", label="source")
            ax.legend()
        return ax


class Simulation(Result):
    """Sample paths: q and p, (samples, steps + 1, N, d), nan where a path ended early."""

    def _headline(self):
        samples, times, landmarks, dimension = self.q.shape
        return [("paths", samples), ("steps", times - 1), ("landmarks", f"{landmarks} in {dimension}D"),
                ("noise", self.record.get("noise"))]

    def plot(self, ax=None):
        ax = _axes(ax)
        times, q = self.times, self.q
        for sample in q:
            for a in range(q.shape[2]):
                if q.shape[3] == 1:
                    ax.plot(times, sample[:, a, 0], color=f"C{a % 10}", linewidth=0.8)
                else:
                    ax.plot(*_plane(sample[:, a]), color=f"C{a % 10}", linewidth=0.8)
        if q.shape[3] == 1:
            ax.set(xlabel="t", ylabel="position")
        else:
            _scatter(ax, q[0, 0], s=9, color="k", zorder=3)
        return ax


class Ensemble(Result):
    """Monte Carlo over many paths: crossing, times, mean_q, mean_p and more."""

    def _headline(self):
        crossing = (self.record.get("crossing") or {}).get("probability")
        return [(key, self.record[key]) for key in ("samples",) if key in self.record] + (
            [("crossing probability", crossing)] if crossing is not None else [])

    def plot(self, ax=None):
        ax = _axes(ax)
        mean = np.asarray(self.mean_q)
        for a in range(mean.shape[1]):
            if mean.shape[2] == 1:
                ax.plot(self.times, mean[:, a, 0])
            else:
                ax.plot(*_plane(mean[:, a]))
        if mean.shape[2] == 1:
            ax.set(xlabel="t", ylabel="mean position")
        else:
            ax.set_aspect("equal", adjustable="datalim")
        return ax


class Comparison(Result):
    """Noise models ranked by their score, the log evidence less what fitted numbers cost: models, best, verdict."""

    def _headline(self):
        return [("best", self.record["best"]), ("models", len(self.record["models"])),
                ("verdict", (self.record.get("verdict") or {}).get("text"))]

    def plot(self, ax=None):
        """Scores relative to the best, with the standard error of the difference."""
        ax = _axes(ax)
        models = sorted(self.record["models"], key=lambda model: -(model["score"] or -np.inf))
        differences = [model["difference"] or {} for model in models]
        values = np.array([one.get("value") for one in differences], dtype=float)
        errors = np.array([one.get("standard_error") for one in differences], dtype=float)
        ax.errorbar(values, np.arange(len(models)), xerr=np.nan_to_num(errors), fmt="o")
        ax.set_yticks(np.arange(len(models)), [_fact(model["asked"]) for model in models])
        ax.axvline(0, color="0.8", linewidth=0.8, zorder=0)
        ax.margins(y=0.2)
        ax.invert_yaxis()
        ax.set_xlabel("score relative to the best model (nats)")
        return ax


class Atlas(Result):
    """A template and the momenta of all shapes: template, momenta (S, N, d), modes, scores (S, modes)."""

    scores = property(lambda self: self.modes["scores"], doc="of the shapes on the modes, (S, modes)")

    def _headline(self):
        return [("specimens", len(self.record.get("specimens", []))), ("kernel", self.record.get("kernel"))]

    def plot(self, ax=None):
        """The template, and the shapes aligned to it."""
        ax = _axes(ax)
        aligned = self.tables["aligned.csv"]
        axes = [axis for axis in "xyz" if axis in aligned]
        _scatter(ax, np.column_stack([aligned[axis] for axis in axes]), s=6, color="0.7", label="shapes, aligned")
        _scatter(ax, self.template, s=25, color="k", label="template")
        ax.legend()
        return ax


class Samples(Result):
    """Draws of the posterior: parameters, momenta, paths."""

    def plot(self, ax=None):
        ax = _axes(ax)
        draws = self.tables["draws.csv"]
        for name in self.record["parameters"]:
            ax.plot(draws[name], linewidth=0.7, label=name)
        ax.set_xlabel("draw")
        ax.legend()
        return ax


class Audit(Result):
    """What is wrong with landmarks: findings."""

    def _headline(self):
        return [("specimens", self.record.get("specimens")), ("findings", len(self.record.get("findings", [])))]

    def __len__(self):
        return len(self.record["findings"])

    def plot(self, ax=None):
        """How sure each finding is."""
        ax = _axes(ax)
        findings = self.record["findings"]
        ax.barh([f"{one['specimen']}: {one['kind']}" for one in findings], [one["log_ratio"] for one in findings])
        ax.invert_yaxis()
        ax.set_xlabel("log likelihood ratio (nats)" if findings else "no findings")
        return ax


class WarpedImage(Result):
    """A warped picture: image, and what the map does to it."""

    image = property(lambda self: self._arrays["image"])

    def plot(self, ax=None):
        ax = _axes(ax)
        ax.imshow(self.image, cmap="gray" if self.image.ndim == 2 else None)
        return ax
