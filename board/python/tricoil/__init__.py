"""AC electromagnetic tracking: poses, simulation, forward model, solver and error model.

Units are SI. Positions are of the sensor in the source frame, m. Quaternions are (w, x, y, z) and convert sensor frame components of
a vector to source frame components. Covariances are of position (m), then of a small rotation (rad), along and about the axes of the
source frame. Couplings X[i, j] are the output of sensor coil i while source coil j is excited.

>>> import tricoil
>>> for pose in tricoil.open("sim:hand"):
...     print(pose.time_s, pose.position_m)
>>> run = tricoil.run("hand", tracker="scaat", seed=2)
>>> print(run.rms_mm(), run.poses["position_m"].shape)
"""

from . import _interpreter

_interpreter.check()

from importlib import import_module as _import_module  # noqa: E402
from typing import TYPE_CHECKING  # noqa: E402

from ._tricoil import __version__  # noqa: E402

if TYPE_CHECKING:  # "as" exports a name for type checkers, which do not read a computed __all__
    from ._bench import bench as bench
    from ._body import solve_6dof as solve_6dof
    from ._coil_filter import CoilFilter as CoilFilter
    from ._command import calibrate as calibrate, command as command, evaluate as evaluate
    from ._demodulate import demodulate as demodulate
    from ._dynamic import verify as verify
    from ._flags import Flag as Flag
    from ._generator import Generator as Generator, SensorCoil as SensorCoil, planar_generator as planar_generator, read_generator as read_generator
    from ._generator_motion import generator_motion_error as generator_motion_error
    from ._ground_truth import Truth as Truth, truth as truth
    from ._hand_poses import hand_poses as hand_poses
    from ._model import COUPLING_CONSTANT as COUPLING_CONSTANT, couplings as couplings, solve as solve
    from ._motion import error_budget as error_budget, motion as motion
    from ._motion_along import motion_along as motion_along
    from ._motion_error import CorrectedPoses as CorrectedPoses, MotionError as MotionError, motion_error as motion_error
    from ._pivot import pivot as pivot
    from ._poses import Poses as Poses, read_poses as read_poses
    from ._run import Run as Run, load as load, run as run
    from ._single_coil import ENDS as ENDS_5DOF, solve_5dof as solve_5dof
    from ._source import Pose as Pose, Source as Source, open as open  # noqa: A004: named like its use, tricoil.open()
    from ._sweep import sweep as sweep
    from ._timing import TIMINGS as TIMINGS, Timing as Timing
    from ._tracker import Filter as Filter
    from ._wiring import Wiring as Wiring, read_wiring as read_wiring

# A module is imported with the first use of a name: a command of the program needs few of them.
_NAMES = {
    "_bench": "bench",
    "_body": "solve_6dof",
    "_coil_filter": "CoilFilter",
    "_command": "calibrate command evaluate",
    "_demodulate": "demodulate",
    "_dynamic": "verify",
    "_flags": "Flag",
    "_generator": "Generator SensorCoil planar_generator read_generator",
    "_generator_motion": "generator_motion_error",
    "_ground_truth": "Truth truth",
    "_hand_poses": "hand_poses",
    "_model": "COUPLING_CONSTANT couplings solve",
    "_motion": "error_budget motion",
    "_motion_along": "motion_along",
    "_motion_error": "CorrectedPoses MotionError motion_error",
    "_pivot": "pivot",
    "_poses": "Poses read_poses",
    "_run": "Run load run",
    "_single_coil": "ENDS_5DOF solve_5dof",
    "_source": "Pose Source open",
    "_sweep": "sweep",
    "_timing": "TIMINGS Timing",
    "_tracker": "Filter",
    "_wiring": "Wiring read_wiring",
}

__all__ = ["__version__", *sorted(" ".join(_NAMES.values()).split())]


def __getattr__(name: str):
    for module, names in _NAMES.items():
        if name in names.split():
            source = _import_module(f"{__name__}.{module}")
            value = source.ENDS if name == "ENDS_5DOF" else getattr(source, name)
            globals()[name] = value
            return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    modules = (name for name, value in globals().items() if getattr(value, "__package__", "") == __name__ and not name.startswith("_"))
    return sorted({*__all__, *modules, *(name for name in globals() if name.startswith("__"))})
