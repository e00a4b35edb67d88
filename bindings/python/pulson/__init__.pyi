# Made by bindings/python/tools/make_stubs.py: the options are those of the program.
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

class Shape:
    points: Floats
    labels: List[str]
    groups: List[str]
    name: str
    image: str
    scale: Optional[float]
    units: str
    axes: str
    absent: List[int]
    links: List[Tuple[int, int]]
    source: str
    diameter: float
    centroid_size: float
    def __init__(self, points: ArrayLike, labels: Sequence[str] = ..., name: str = ..., groups: Sequence[str] = ...) -> None: ...
    def __len__(self) -> int: ...
    def __array__(self, *args: Any, **kwargs: Any) -> Floats: ...

class Alignment:
    points: Floats
    scale: float
    linear: Floats
    translation: Floats
    kind: str
    def apply(self, points: ArrayLike) -> Floats: ...

class Trajectory:
    q: Floats
    p: Floats
    end: Floats
    end_momenta: Floats
    times: Floats
    increments: Floats
    integrator: str

class Kernel:
    spec: str
    def __init__(self, spec: Union[str, OwnKernel], source: Optional[ArrayLike] = ...) -> None: ...
    def gram(self, x: ArrayLike, y: ArrayLike) -> Floats: ...
    def velocity(self, x: ArrayLike, q: ArrayLike, p: ArrayLike) -> Floats: ...

class OwnKernel:
    name: str
    def __init__(self, k: Callable[..., Any], first: Optional[Callable[..., Any]] = ..., second: Optional[Callable[..., Any]] = ..., *, name: Optional[str] = ...) -> None: ...

class OwnNoise:
    traits: Dict[str, Any]
    def __init__(self, potentials: Callable[..., Any], gradient: Optional[Callable[..., Any]] = ..., hessian: Optional[Callable[..., Any]] = ..., *, like: ArrayLike, name: str = ...) -> None: ...

class Shapes:
    notes: List[str]
    names: List[str]
    labels: List[str]
    points: Floats
    def __init__(self, shapes: Sequence[Shape], notes: Sequence[str] = ...) -> None: ...
    def __len__(self) -> int: ...
    def __getitem__(self, key: Any) -> Any: ...
    def __iter__(self) -> Iterator[Shape]: ...
    def plot(self, ax: Any = ...) -> Any: ...

class Result:
    record: Dict[str, Any]
    summary: str
    notes: List[str]
    converged: bool
    tables: Mapping[str, Any]
    folder: Optional[str]
    def __getattr__(self, name: str) -> Any: ...
    def plot(self, ax: Any = ...) -> Any: ...

class Registration(Result):
    momenta: Floats
    result: Floats
    source: Floats
    target: Floats
    original: Floats
    increments: Floats
    distances: Floats
    kernel: str
    noise: str
    rms: float
    matched: bool
    def shoot(self) -> Trajectory: ...
    def warp_points(self, points: Any, *, inverse: bool = ..., labels: str = ..., jacobians: bool = ...) -> Any: ...
    def warp_image(self, image: Any, **options: Any) -> WarpedImage: ...
    def write(self, path: Path) -> None: ...

class Cohort(Result):
    registrations: Dict[str, Registration]
    def __getitem__(self, name: str) -> Registration: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[str]: ...

class Simulation(Result):
    q: Floats
    p: Floats
    times: Floats

class Ensemble(Result):
    ...

class Comparison(Result):
    ...

class Atlas(Result):
    momenta: Floats

class Samples(Result):
    momenta: Floats

class Audit(Result):
    def __len__(self) -> int: ...

class WarpedImage(Result):
    image: NDArray[Any]

class PulsonWarning(UserWarning): ...

def align(source: Any, target: Any = None, *, align: Any = 'auto', reflect: bool = False, weights: Any = None) -> Any: ...
def atlas(cohort: Any, *, out: Optional[Path] = None, progress: Progress = None, missing: Any = None, absent: Any = None, format: Any = None, columns: Any = None, dim: Any = None, landmarks: Any = None, curves: Any = None, scale: Any = None, links: Any = None, by_order: bool = False, no_picture: bool = False, pictures: Any = 'png,svg', width: Any = None, dpi: Any = 96, spreadsheet_safe: bool = False, flip_y: Any = None, kernel: Any = 'auto', lambda_: Any = 'fit', sigma: Any = 'fit', robust: bool = False, loss: Any = None, noise: Any = 'none', align: Any = 'auto', model: Any = None, data: Any = None, covariate: Any = None, at: Any = None, groups: Any = None, permutations: Any = 9999, modes: Any = 3, seed: Any = 1, steps: Any = 10, tolerance: Any = 1e-08, max_iterations: Any = 100, resume: bool = False, threads: Any = None) -> Atlas: ...
def audit(shapes: Any, *, out: Optional[Path] = None, progress: Progress = None, missing: Any = None, absent: Any = None, format: Any = None, columns: Any = None, dim: Any = None, landmarks: Any = None, curves: Any = None, scale: Any = None, links: Any = None, by_order: bool = False, fix: Any = None, repeats: Any = None, flip_y: Any = None, no_picture: bool = False, spreadsheet_safe: bool = False) -> Audit: ...
def build() -> str: ...
def compare(shapes: Any, *, out: Optional[Path] = None, progress: Progress = None, noise: Any = None, source: Any = None, missing: Any = None, absent: Any = None, format: Any = None, columns: Any = None, dim: Any = None, landmarks: Any = None, curves: Any = None, scale: Any = None, links: Any = None, flip_y: Any = None, by_order: bool = False, merge_coincident: bool = False, no_picture: bool = False, pictures: Any = 'png,svg', width: Any = None, dpi: Any = 96, spreadsheet_safe: bool = False, sigma: Any = None, robust: bool = False, loss: Any = None, align: Any = 'auto', kernel: Any = 'gaussian:alpha=fit', lambda_: Any = 'fit', integrator: Any = 'heun', folds: Any = 5, forward_samples: Any = 400, evidence: Any = 'importance', importance: Any = 50, bootstrap: Any = 0, no_maps: bool = False, simulate: Any = None, true_lambda: Any = None, true_kernel: Any = None, count: Any = 20, cohort_size: Any = None, shard: Any = None, resume: bool = False, seed: Any = 1, time: Any = None, steps: Any = None, dt: Any = None, threads: Any = None) -> Comparison: ...
def ensemble(*, out: Optional[Path] = None, progress: Progress = None, q: Any = None, shape: Any = None, from_: Any = None, p: Any = None, momenta: Any = None, missing: Any = None, absent: Any = None, format: Any = None, columns: Any = None, dim: Any = None, landmarks: Any = None, curves: Any = None, scale: Any = None, links: Any = None, by_order: bool = False, kernel: Any = None, noise: Any = None, flip_y: Any = None, integrator: Any = 'variational', time: Any = None, steps: Any = None, dt: Any = None, samples: Any = 50000, antithetic: bool = False, seed: Any = 1, bound: Any = 100000000.0, records: Any = 101, densities: Any = None, resume: bool = False, stop_after: Any = None, sweep: Any = None, shard: Any = None, threads: Any = None, save_final: Any = None, save_paths: Any = None, no_picture: bool = False, pictures: Any = 'png,svg', width: Any = None, dpi: Any = 96, spreadsheet_safe: bool = False) -> Ensemble: ...
def formats() -> List[str]: ...
def load(path: Path) -> Registration: ...
def read(path: Path, *, missing: Any = None, absent: Any = None, format: Any = None, columns: Any = None, dim: Any = None, landmarks: Any = None, curves: Any = None, scale: Any = None, links: Any = None, flip_y: Any = None) -> Shapes: ...
def register(source: Any, target: Any = None, *, out: Optional[Path] = None, progress: Progress = None, missing: Any = None, absent: Any = None, format: Any = None, columns: Any = None, dim: Any = None, landmarks: Any = None, curves: Any = None, scale: Any = None, links: Any = None, by_order: bool = False, no_picture: bool = False, pictures: Any = 'png,svg', width: Any = None, dpi: Any = 96, spreadsheet_safe: bool = False, field: Any = None, grid_points: Any = None, flip_y: Any = None, image: Any = None, pixel_size: Any = None, origin: Any = None, max_pixels: Any = 200000000, mesh: Any = None, kernel: Any = 'auto', noise: Any = 'none', mode: Any = None, integrator: Any = 'auto', sigma: Any = '0.5%', robust: bool = False, loss: Any = None, weights: Any = None, covariances: Any = None, merge_coincident: bool = False, data: Any = 'landmarks', data_width: Any = 'auto', curve_ends: Any = 'auto', align: Any = 'auto', reflect: bool = False, lambda_: Any = 'auto', solver: Any = 'auto', uncertainty: bool = False, homotopy: bool = False, samples: Any = 16, seed: Any = 1, tolerance: Any = 0.001, max_iterations: Any = 500, time: Any = None, steps: Any = None, dt: Any = None, template: Any = None, shard: Any = None, resume: bool = False, threads: Any = None) -> Any: ...
def sample(source: Any, target: Any = None, *, out: Optional[Path] = None, progress: Progress = None, missing: Any = None, absent: Any = None, format: Any = None, columns: Any = None, dim: Any = None, landmarks: Any = None, curves: Any = None, scale: Any = None, links: Any = None, by_order: bool = False, flip_y: Any = None, no_picture: bool = False, pictures: Any = 'png,svg', width: Any = None, dpi: Any = 96, spreadsheet_safe: bool = False, kernel: Any = None, noise: Any = 'none', sigma: Any = None, lambda_: Any = None, robust: bool = False, loss: Any = None, tree: Any = None, align: Any = 'auto', momenta: Any = 'kernel', integrator: Any = 'heun', method: Any = 'hmc', chains: Any = 4, draws: Any = 1000, warmup: Any = 500, searches: Any = 0, temperatures: Any = 1, keep_paths: Any = 400, calibrate: Any = None, ranks: Any = 63, fault: Any = None, shard: Any = None, resume: bool = False, seed: Any = 1, time: Any = None, steps: Any = None, dt: Any = None, threads: Any = None) -> Samples: ...
def shoot(q: Any, p: Any, kernel: Any = 'gaussian:alpha=auto', noise: Any = None, *, time: Any = 1, steps: Any = None, dt: Any = None, integrator: Any = 'variational', increments: Any = None, seed: Any = 1) -> Trajectory: ...
def simulate(*, out: Optional[Path] = None, progress: Progress = None, q: Any = None, shape: Any = None, from_: Any = None, p: Any = None, momenta: Any = None, missing: Any = None, absent: Any = None, format: Any = None, columns: Any = None, dim: Any = None, landmarks: Any = None, curves: Any = None, scale: Any = None, links: Any = None, by_order: bool = False, kernel: Any = None, noise: Any = None, flip_y: Any = None, integrator: Any = 'variational', time: Any = None, steps: Any = None, dt: Any = None, samples: Any = 1, seed: Any = 1, every: Any = 1, field: Any = None, grid_points: Any = None, threads: Any = None, no_picture: bool = False, pictures: Any = 'png,svg', width: Any = None, dpi: Any = 96, spreadsheet_safe: bool = False) -> Simulation: ...
def warp_image(registration: Union[Registration, Path], image: Any, *, progress: Progress = None, spreadsheet_safe: bool = False, inverse: bool = False, labels: Any = 'metric', like: Any = None, size: Any = None, pixel_size: Any = None, target_pixel_size: Any = None, origin: Any = None, target_origin: Any = None, flip_y: Any = None, method: Any = 'auto', over: Any = 'least-stretched', interpolation: Any = 'linear', border: Any = 'auto', background: Any = None, supersampling: Any = 2, tolerance: Any = 0.05, max_pixels: Any = 200000000, grid_points: Any = None, missing: Any = None, absent: Any = None, format: Any = None, columns: Any = None, dim: Any = None, landmarks: Any = None, curves: Any = None, scale: Any = None, links: Any = None, threads: Any = None) -> WarpedImage: ...
def warp_points(registration: Union[Registration, Path], points: Any, *, inverse: bool = False, labels: Any = 'metric', jacobians: bool = False) -> Any: ...
def write(path: Path, shapes: Any, format: Any = None) -> List[str]: ...
