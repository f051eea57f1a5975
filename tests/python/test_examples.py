"""The notebooks of board/python/examples run without errors. They contain assertions of their own."""

import asyncio
import os
import pathlib
import tempfile
import unittest
from unittest import mock

import nbformat
import numpy as np
import tricoil
from nbclient import NotebookClient

FOLDER = pathlib.Path(__file__).parents[2] / "board/python/examples"


def outputs(notebook, key):
    return [item[key] for cell in notebook.cells for item in cell.get("outputs", []) if key in item]


class Notebooks(unittest.TestCase):
    def execute(self, name, has_outputs=False, second_cell=None):
        """Runs a notebook in a new kernel and returns it with its outputs. The home folder stays unused. second_cell: of code, instead of its own."""
        notebook = nbformat.read(FOLDER / name, as_version=4)
        if second_cell:
            [cell for cell in notebook.cells if cell.cell_type == "code"][1].source = second_cell
        self.assertEqual(bool(outputs(notebook, "output_type")), has_outputs, "the stored notebook's outputs")
        with tempfile.TemporaryDirectory() as folder:
            folders = {key: folder for key in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR", "MPLCONFIGDIR")}
            with mock.patch.dict(os.environ, {**folders, "PYDEVD_DISABLE_FILE_VALIDATION": "1"}):
                client = NotebookClient(notebook, timeout=600, startup_timeout=300, kernel_name="python3", resources={"metadata": {"path": folder}})
                asyncio.run(client.async_execute())
        self.assertNotIn("stderr", outputs(notebook, "name"))
        return notebook

    def test_all_are_tested(self):
        tested = {"figures_of_the_paper.ipynb", "metal.ipynb", "motion_errors.ipynb", "motion_of_my_tracker.ipynb"}
        self.assertEqual({path.name for path in FOLDER.iterdir() if path.suffix == ".ipynb"}, tested)

    def test_figures_of_the_paper(self):
        notebook = self.execute("figures_of_the_paper.ipynb")
        self.assertEqual(sum("image/png" in data for data in outputs(notebook, "data")), 3)
        self.assertIn("kappa two: e_beta after 10 s measured -4.569 rad, predicted 3.576 rad", "".join(outputs(notebook, "text")))

    def test_metal(self):
        notebook = self.execute("metal.ipynb")
        self.assertEqual(sum("image/png" in data for data in outputs(notebook, "data")), 3)

    def test_motion_errors(self):
        notebook = self.execute("motion_errors.ipynb")
        self.assertEqual(sum("image/png" in data for data in outputs(notebook, "data")), 2)

    def test_motion_of_my_tracker(self):
        """On the simulated motion, of which the page shows the outputs, and on a recorded one if there is one."""
        stored = outputs(nbformat.read(FOLDER / "motion_of_my_tracker.ipynb", as_version=4), "text")
        self.assertIn("simulated motion: 2399 poses", stored[0])
        folders = [None, *filter(None, [os.environ.get("TRICOIL_DATA_DIR")])]
        for folder in folders:
            with mock.patch.dict(os.environ, {"TRICOIL_DATA_DIR": folder or "/nowhere"}):
                notebook = self.execute("motion_of_my_tracker.ipynb", has_outputs=True)
            self.assertEqual(sum("image/png" in data for data in outputs(notebook, "data")), 2)
            self.assertIn("recorded motion" if folder else "simulated motion", outputs(notebook, "text")[0])

    def test_motion_of_my_tracker_with_own_files(self):
        """As the page says: the second cell reads two files. This tracker has no motion error, and the page says so."""
        run = tricoil.run("hand", mux="fdm", tracker="direct", fidelity="columns", duration_s=4)
        with tempfile.TemporaryDirectory() as folder:
            files = [os.path.join(folder, name) for name in ("liberty.csv", "optics.csv")]
            for file, rows in zip(files, (run.poses, run.truth)):
                table = np.column_stack((run.poses["time_s"], rows["position_m"], rows["quaternion_wxyz"]))
                np.savetxt(file, table, fmt="%.9f", delimiter=",", header="time_s,x_m,y_m,z_m,qw,qx,qy,qz", comments="")
            notebook = self.execute("motion_of_my_tracker.ipynb", True, "poses, reference = " + ", ".join(f"tricoil.read_poses({file!r})" for file in files))
        text = "".join(outputs(notebook, "text"))
        self.assertIn("none (FDM, or the tracker corrects it)", text)
        self.assertIn("all coils at once (FDM)", text)
        self.assertRegex(text, r"because it moved: 0\.[01]")


if __name__ == "__main__":
    unittest.main()
