"""Prints pulson/__init__.pyi: the signatures of the functions, whose options are the program's.

    PYTHONPATH=build/dev/python python3 bindings/python/tools/make_stubs.py > bindings/python/pulson/__init__.pyi
"""

import inspect

import pulson
from pulson import _functions

_HEAD = '''# Made by bindings/python/tools/make_stubs.py: the options are those of the program.
from os import PathLike
from typing import Any, Callable, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

Path = Union[str, PathLike[str]]
ShapeLike = Union[Path, ArrayLike, "Shape", "Shapes"]
ShapesLike = Union[ShapeLike, Sequence[ShapeLike], Mapping[str, ArrayLike]]
Progress = Optional[Union[bool, Callable[[Optional[float], str], Any]]]
Floats = NDArray[np.float64]

__version__: str
'''

_CLASSES = {
    "Shape": "points: Floats; labels: List[str]; groups: List[str]; name: str; image: str; scale: Optional[float]; "
             "units: str; axes: str; absent: List[int]; links: List[Tuple[int, int]]; source: str; diameter: float; "
             "centroid_size: float",
    "Alignment": "points: Floats; scale: float; linear: Floats; translation: Floats; kind: str",
    "Trajectory": "q: Floats; p: Floats; end: Floats; end_momenta: Floats; times: Floats; increments: Floats; "
                  "integrator: str",
    "Kernel": "spec: str",
    "OwnKernel": "name: str",
    "OwnNoise": "traits: Dict[str, Any]",
    "Shapes": "notes: List[str]; names: List[str]; labels: List[str]; points: Floats",
    "Result": "record: Dict[str, Any]; summary: str; notes: List[str]; converged: bool; tables: Mapping[str, Any]; "
              "folder: Optional[str]",
    "Registration": "momenta: Floats; result: Floats; source: Floats; target: Floats; original: Floats; "
                    "increments: Floats; distances: Floats; kernel: str; noise: str; rms: float; matched: bool",
    "Cohort": "registrations: Dict[str, Registration]",
    "Simulation": "q: Floats; p: Floats; times: Floats",
    "Ensemble": "", "Comparison": "", "Atlas": "momenta: Floats", "Samples": "momenta: Floats", "Audit": "",
    "WarpedImage": "image: NDArray[Any]",
}
_METHODS = {
    "Shape": ['def __init__(self, points: ArrayLike, labels: Sequence[str] = ..., name: str = ..., '
              'groups: Sequence[str] = ...) -> None: ...', "def __len__(self) -> int: ...",
              "def __array__(self, *args: Any, **kwargs: Any) -> Floats: ..."],
    "Alignment": ["def apply(self, points: ArrayLike) -> Floats: ..."],
    "Kernel": ["def __init__(self, spec: Union[str, OwnKernel], source: Optional[ArrayLike] = ...) -> None: ...",
               "def gram(self, x: ArrayLike, y: ArrayLike) -> Floats: ...",
               "def velocity(self, x: ArrayLike, q: ArrayLike, p: ArrayLike) -> Floats: ..."],
    "OwnKernel": ["def __init__(self, k: Callable[..., Any], first: Optional[Callable[..., Any]] = ..., "
                  "second: Optional[Callable[..., Any]] = ..., *, name: Optional[str] = ...) -> None: ..."],
    "OwnNoise": ["def __init__(self, potentials: Callable[..., Any], gradient: Optional[Callable[..., Any]] = ..., "
                 "hessian: Optional[Callable[..., Any]] = ..., *, like: ArrayLike, name: str = ...) -> None: ..."],
    "Shapes": ["def __init__(self, shapes: Sequence[Shape], notes: Sequence[str] = ...) -> None: ...",
               "def __len__(self) -> int: ...", "def __getitem__(self, key: Any) -> Any: ...",
               "def __iter__(self) -> Iterator[Shape]: ...", "def plot(self, ax: Any = ...) -> Any: ..."],
    "Result": ["def __getattr__(self, name: str) -> Any: ...", "def plot(self, ax: Any = ...) -> Any: ..."],
    "Registration": ["def shoot(self) -> Trajectory: ...",
                     "def warp_points(self, points: Any, *, inverse: bool = ..., labels: str = ..., "
                     "jacobians: bool = ...) -> Any: ...",
                     "def warp_image(self, image: Any, **options: Any) -> WarpedImage: ...",
                     "def write(self, path: Path) -> None: ..."],
    "Cohort": ["def __getitem__(self, name: str) -> Registration: ...", "def __len__(self) -> int: ...",
               "def __iter__(self) -> Iterator[str]: ..."],
    "Audit": ["def __len__(self) -> int: ..."],
}
_RESULTS = {"register": "Any", "atlas": "Atlas", "audit": "Audit", "compare": "Comparison", "ensemble": "Ensemble",
            "simulate": "Simulation", "sample": "Samples", "warp_image": "WarpedImage", "read": "Shapes",
            "write": "List[str]", "align": "Any", "shoot": "Trajectory", "load": "Registration", "warp_points": "Any",
            "build": "str", "formats": "List[str]"}
_TYPES = {"source": "Any", "target": "Any", "shapes": "Any", "cohort": "Any", "path": "Path", "out": "Optional[Path]",
          "progress": "Progress", "registration": "Union[Registration, Path]"}


def _type_of(parameter):
    if parameter.name in _TYPES:
        return _TYPES[parameter.name]
    return "bool" if isinstance(parameter.default, bool) else "Any"


def _function(name):
    words, starred = [], False
    for parameter in inspect.signature(getattr(_functions, name)).parameters.values():
        if parameter.kind is inspect.Parameter.KEYWORD_ONLY and not starred:
            words.append("*")
            starred = True
        default = "" if parameter.default is inspect.Parameter.empty else f" = {parameter.default!r}"
        words.append(f"{parameter.name}: {_type_of(parameter)}{default}")
    return f"def {name}({', '.join(words)}) -> {_RESULTS[name]}: ..."


def stubs():
    parts = [_HEAD]
    for name, members in _CLASSES.items():
        base = getattr(pulson, name).__mro__[1].__name__
        head = f"class {name}({base}):" if base == "Result" else f"class {name}:"
        body = [member for member in members.split("; ") if member] + _METHODS.get(name, [])
        parts.append("\n".join([head] + ["    " + line for line in body or ["..."]]) + "\n")
    parts.append("class PulsonWarning(UserWarning): ...\n")
    parts += [_function(name) for name in sorted(_RESULTS)]
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    print(stubs(), end="")
