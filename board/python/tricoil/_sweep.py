"""Many runs: one call for each point of a grid, in parallel."""

import concurrent.futures
import itertools
import json
import os
import pickle
import traceback

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ._progress import bar
from ._whole_file import read_whole


def _points(grid):
    if isinstance(grid, dict):
        for name, values in grid.items():
            if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
                raise TypeError(f"grid: the values of {name} are {values!r}; give a list")
        return [dict(zip(grid, values)) for values in itertools.product(*grid.values())]
    return [dict(point) for point in grid]


def _check_function(function, is_sent):
    """is_sent: to another process."""
    if not callable(function):
        raise TypeError(f"function: {function!r} cannot be called")
    try:
        if is_sent:
            pickle.dumps(function)
    except (pickle.PicklingError, AttributeError, TypeError):
        raise ValueError(
            f"function: {function!r} cannot be sent to another process; define it in a module or script, "
            "or give executor=concurrent.futures.ThreadPoolExecutor()"
        ) from None


def _call(function, point):
    """Result and error of one call. A dictionary of results becomes columns; any other result becomes the column `result`."""
    try:
        result = function(**point)
    except Exception:  # a failed point does not end the sweep
        return None, traceback.format_exc()
    return _plain(result if isinstance(result, dict) else {"result": result}), None


def _key(point):
    return json.dumps(_plain(point), sort_keys=True)


def _plain(value):
    """Converts a value to JSON types: NumPy scalars and arrays as numbers and lists, paths and other objects as text."""
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(name): _plain(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value if value is None or isinstance(value, (bool, int, float, str)) else str(value)


def _read(path, function):
    """Finished points of an interrupted sweep of this function. Removes an incomplete last line."""
    done = {}
    if path is None or not os.path.exists(path):
        return done
    text = read_whole(path).decode()
    whole = text[: text.rfind("\n") + 1]
    if len(whole) < len(text) and not text[len(whole) :].startswith("{"):
        raise ValueError(f"{path}: not the file of a sweep; give another file")
    for number, line in enumerate(whole.splitlines(), 1):
        try:
            entry = json.loads(line)
            swept, key, result = entry["function"], _key(entry["point"]), entry["result"]
        except (ValueError, KeyError, TypeError):
            raise ValueError(f"{path}:{number}: not a line of a sweep; give another file, or delete this one") from None
        if swept != function:
            raise ValueError(f"{path}:{number}: of the function {swept}, not {function}; give another file")
        done[key] = result
    os.truncate(path, len(whole.encode()))
    return done


def sweep(
    function: Callable[..., Any],
    grid: dict[str, Iterable] | Iterable[dict[str, Any]],
    executor: Any = None,
    *,
    resume: str | os.PathLike | None = None,
    progress: bool | None = None,
) -> tuple[list[dict], list[tuple[dict, str]]]:
    """Calls function(**point) for each point of a grid and returns (table, failures).

    function: returns a number or a dictionary of numbers. With processes it must be importable (defined in a module or script).
    grid: {name: values} for all combinations, or a sequence of dictionaries. executor: anything with submit(), for example
    concurrent.futures.ThreadPoolExecutor, or that of a Dask cluster: distributed.Client(...).get_executor(). None: one process for
    each processor of this machine. resume: file of finished points (JSON lines); a sweep that was interrupted continues there, and
    runs failed points again. progress: bar on standard error; None: if it is a terminal.

    table: list of dictionaries, point and result together, in the order of the grid; failed points are left out. failures: list of
    (point, traceback); if a process dies, also the points that it leaves without a process. The table does not depend on the executor. Ctrl-C cancels the points that have not begun.
    """
    points = _points(grid)
    _check_function(function, executor is None)
    name = getattr(function, "__qualname__", repr(function))
    done = _read(resume, name)
    own = executor is None
    executor = executor or concurrent.futures.ProcessPoolExecutor()
    results = [done.get(_key(point)) for point in points]
    failures = {}
    log = None if resume is None else open(resume, "a", encoding="utf-8")
    futures = {}
    try:
        futures = {_submit(executor, function, points[n]): n for n, result in enumerate(results) if result is None}
        with bar("sweep", progress) as show:
            for count, future in enumerate(_as_finished(futures), 1):
                n = futures[future]
                results[n], error = _outcome(future)
                if error is not None:
                    failures[n] = error
                elif log is not None:
                    log.write(json.dumps({"function": name, "point": _plain(points[n]), "result": results[n]}) + "\n")
                    log.flush()
                if show is not None:
                    show(count / len(futures))
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    finally:
        if log is not None:
            log.close()
        if own:
            executor.shutdown(cancel_futures=True)
    table = [{**point, **result} for point, result in zip(points, results) if result is not None]
    return table, [(points[n], failures[n]) for n in sorted(failures)]


def _submit(executor, function, point):
    try:
        return executor.submit(_call, function, point)
    except concurrent.futures.BrokenExecutor as error:  # a process died meanwhile
        future = concurrent.futures.Future()
        future.set_exception(error)
        return future


def _outcome(future):
    """As _call. The failure of a process or of its connection is that of the point."""
    try:
        return future.result()
    except Exception:
        return None, traceback.format_exc()


def _as_finished(futures):
    """Futures in the order in which they finish; futures of other libraries in the order of their submission."""
    if all(isinstance(future, concurrent.futures.Future) for future in futures):
        return concurrent.futures.as_completed(futures)
    return futures
