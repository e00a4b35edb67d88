"""Calls of the program's verbs: words of the command line out of keyword arguments, by its own tables."""

import contextlib
import csv
import difflib
import inspect
import keyword
import os
import re
import sys
import tempfile
import warnings

import numpy as np

from . import _pulson, _results, _tables
from ._pulson import OwnKernel, OwnNoise

Shape = _pulson.Shape

IMAGES = {"image", "like"}
# Options of the program that are no arguments here: of its files and streams.
HIDDEN = {"help", "help-all", "out", "json", "quiet", "verbose", "config", "print-config"}

def python_name(option):
    name = option.replace("-", "_")
    return name + "_" if keyword.iskeyword(name) else name


class Table:
    """The options of a verb by their names in Python."""

    def __init__(self, options):
        options = [option for option in options if option["name"] not in HIDDEN]
        self.positional = [option for option in options if option["positional"]]
        self.options = {python_name(option["name"]): option for option in options if not option["positional"]}

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


def _require_no_choice(name, option):
    """None is the default; where "none" is another choice it could mean either."""
    if option["default"] not in ("", "none") and re.search(r"\bnone,", option["help"]):
        raise ValueError(f"{name}=None: write {name}='none', or leave it out for {option['default']!r}")


def _text(value):
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, np.generic):
        value = value.item()
    return repr(value) if isinstance(value, float) else os.fspath(value) if hasattr(value, "__fspath__") else str(value)


def is_path(value):
    return isinstance(value, (str, os.PathLike))


def shapes_of(value, name):
    """A list of Shape of what users have as shapes."""
    if isinstance(value, Shape):
        return [value]
    if isinstance(value, _results.Shapes):
        return list(value)
    if isinstance(value, dict):
        shapes = []
        for key, points in value.items():
            shape = one_shape(points, f"{name}[{key!r}]")
            shape.name = str(key)
            shapes.append(shape)
        return shapes
    if isinstance(value, (list, tuple)) and value and not np.isscalar(value[0]):
        if all(isinstance(one, Shape) for one in value):
            return list(value)
        if all(np.ndim(one) == 2 for one in value):
            shapes = [one_shape(one, f"{name}[{i}]") for i, one in enumerate(value)] if np.ndim(value[0]) == 2 else []
            for i, shape in enumerate(shapes):
                shape.name = f"{name}#{i + 1}"
            return shapes
    return _pulson._shapes_of(value, name)


def one_shape(value, name):
    if isinstance(value, Shape):
        return value
    shapes = shapes_of(value, name)
    if len(shapes) != 1:
        raise ValueError(f"{name} has {len(shapes)} shapes; one is needed")
    return shapes[0]


def _name_arguments(error, scratch):
    """Messages on files that arguments were written to name the arguments."""
    if len(error.args) == 1 and isinstance(error.args[0], str):
        error.args = (re.sub(re.escape(scratch) + r"/(\w+)\.csv(:value)?", r"\1", error.args[0]),)


class Call:
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

    def __exit__(self, kind, error, frames):
        if error is not None and self._scratch is not None:
            _name_arguments(error, self._scratch)
        self._stack.close()

    @property
    def scratch(self):
        if self._scratch is None:
            self._scratch = self._stack.enter_context(tempfile.TemporaryDirectory(prefix="pulson-"))
        return self._scratch

    def shapes(self, value, name):
        """The words that address shapes."""
        if is_path(value):
            path = os.fspath(value)
            return [path]
        if isinstance(value, (list, tuple)) and value and all(is_path(one) for one in value):
            return [os.fspath(one) for one in value]
        self.held[name] = shapes_of(value, name)
        return [name]

    def option(self, name, value):
        option = self.table.find(self.verb, name)
        word = "--" + option["name"]
        if value is None:
            _require_no_choice(name, option)
            return
        if option["flag"]:
            if not isinstance(value, (bool, np.bool_)):
                raise TypeError(f"{name} is True or False, not {value!r}")
            if option["name"] == "flip-y":
                self.words.append(word if value else "--no-flip-y")
            elif value:
                self.words.append(word)
            return
        kind = option["type"]
        if isinstance(value, (bool, np.bool_)):
            raise TypeError(f"{name} takes a value ({kind}), not {value}")
        if isinstance(value, (list, tuple)) and any(isinstance(one, OwnNoise) for one in value) or (
                isinstance(value, OwnNoise) and self.verb not in ("simulate", "ensemble")):
            raise ValueError(f"{name}: a noise written in Python drives simulate, ensemble, shoot and register of one source "
                             "to one target")
        if isinstance(value, OwnNoise):
            self.own_noise = value
            self.words.append(f"{word}={value}")
        elif isinstance(value, OwnKernel):
            if not value.is_current:
                raise ValueError(f"{name}: another kernel was made with the name {value.name!r} of this one; give each "
                                 "a name of its own")
            self.words.append(f"{word}={value}")
        elif kind.startswith("SHAPE") and not is_path(value):
            self.words += [f"{word}={one}" for one in self.shapes(value, name.rstrip("_"))]
        elif isinstance(value, _results.Registration):
            path = os.path.join(self.scratch, "registration.json")
            value.write(path)
            self.words.append(f"{word}={path}")
        elif kind.startswith("FILE.csv:") and not is_path(value):
            self.words.append(f"{word}={self.columns(name, {None: value})}:value")
        elif kind.startswith("FILE") and not is_path(value):
            path = self.columns(name, value) if hasattr(value, "items") else self.numbers(name, value)
            self.words.append(f"{word}={path}")
        elif option["name"] in ("q", "p") and not isinstance(value, str):
            self.words.append(f"{word}={_points_text(value, name)}")
        elif isinstance(value, (list, tuple, np.ndarray)):
            several = [_text(one) for one in value]
            if not option["many"]:  # parts of one value
                several = [("x" if kind == "WxH" else ",").join(several)]
            self.words += [f"{word}={one}" for one in several]
        else:
            self.words.append(f"{word}={_text(value)}")

    def numbers(self, name, value):
        if name in IMAGES:
            raise TypeError(f"{name} is the name of a file")
        rows = np.asarray(value, dtype=float)
        if rows.ndim == 0 or rows.size == 0:
            raise ValueError(f"{name} has the shape {rows.shape}: no numbers")
        path = os.path.join(self.scratch, f"{name}.csv")
        with open(path, "w", encoding="utf-8") as file:
            for row in rows.reshape(len(rows), -1):
                file.write(",".join(repr(float(x)) for x in row) + "\n")
        return path

    def columns(self, name, value):
        """A file of columns by their names: each a list in the order of the shapes, or a dictionary by their names."""
        shapes = next(iter(self.held.values()), None)
        names = None if shapes is None else [shape.name for shape in shapes]
        table = {}
        for column, entries in value.items():
            what = name if column is None else f"{name}[{column!r}]"
            if hasattr(entries, "keys"):
                given = {str(key): entries[key] for key in entries.keys()}
                names = list(given) if names is None else names
                missing = [key for key in names if key not in given]
                if missing:
                    raise ValueError(f"{what} has no entry for {missing[0]!r}")
                table[column] = [given[key] for key in names]
            elif names is None:
                raise TypeError(f"{what} needs a dictionary by the names of shapes where these are in a file")
            else:
                table[column] = list(entries)
                if len(table[column]) != len(names):
                    raise ValueError(f"{what} has {len(table[column])} entries for {len(names)} shapes")
        path = os.path.join(self.scratch, f"{name}.csv")
        with open(path, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["specimen", *("value" if column is None else column for column in table)])
            writer.writerows([key, *(_text(entries[i]) for entries in table.values())] for i, key in enumerate(names))
        return path

    def run(self, out, progress):
        folder = os.fspath(out) if out is not None else os.path.join(self.scratch, "out")
        shown = shown_progress(progress)
        said = _pulson._run([self.verb, f"--out={folder}", *self.words], self.held, self.own_noise, shown, out is None)
        close(shown)
        warn(said["warnings"])
        return folder, said

    def result(self, kind, record, out, progress, **more):
        folder, said = self.run(out, progress)
        facts, tables, arrays = _tables.collect(folder, record)
        summary = said["printed"]
        if out is None:  # the folder is gone
            summary = re.sub(r"^wrote .*\n?", "", summary, flags=re.MULTILINE).rstrip()
        return kind(record=facts, summary=summary, notes=said["notes"], exit_code=said["exit_code"],
                    tables=tables, arrays={**arrays, **more}, folder=None if out is None else folder)


def _points_text(value, name):
    points = np.asarray(value, dtype=float)
    if points.ndim == 1:
        points = points[:, None]
    if points.ndim != 2:
        raise ValueError(f"{name} has the shape {points.shape}; landmarks are rows, (N, d)")
    return ",".join("/".join(repr(float(x)) for x in row) for row in points)


def warn(texts):
    if not texts:
        return
    frame, level = sys._getframe(1), 2
    while frame is not None and os.path.dirname(frame.f_code.co_filename) == os.path.dirname(__file__):
        frame, level = frame.f_back, level + 1
    for text in texts:
        warnings.warn(_pulson._python_words(text), _results.PulsonWarning, stacklevel=level)


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


def shown_progress(progress):
    if callable(progress):
        return progress
    if progress is None:
        progress = "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())
    return _Bar() if progress else None


def close(progress):
    if isinstance(progress, _Bar):
        progress.close()


_TABLES = {}


def table_of(verb):
    if verb not in _TABLES:
        _TABLES[verb] = Table(_pulson._read_options() if verb == "read" else _pulson._options(verb))
    return _TABLES[verb]


def by_table(verb, hidden=()):
    """Gives a function the keyword arguments of a verb's table, as its signature and in its documentation."""

    def decorate(function):
        table = table_of(verb)
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
