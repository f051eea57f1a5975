"""Reads a MAT file of `tricoil convert` with SciPy and compares it with the recording's own lines.

  read_mat.py FILE.mat RECORDING
"""
import csv
import os
import sys

import numpy as np
import scipy.io

mat = scipy.io.loadmat(sys.argv[1], squeeze_me=True, struct_as_record=False)
poses = mat["poses"]
with open(os.path.join(sys.argv[2], "poses.csv")) as file:
    rows = list(csv.DictReader(file))
number = lambda text: float(text) if text else np.nan  # empty: no sensor
column = lambda *names: np.array([[number(row[name]) for name in names] for row in rows]).squeeze()
known = np.isfinite(column("x_m"))

for name in ("sensor", "sequence", "time_us", "valid", "flags", "state", "distortion_mm", "snr_db"):
    np.testing.assert_allclose(getattr(poses, name), column(name), rtol=1e-14, err_msg=name)
np.testing.assert_array_equal(poses.position_m, column("x_m", "y_m", "z_m"))
np.testing.assert_array_equal(poses.q_wxyz, column("qw", "qx", "qy", "qz"))
assert poses.covariance.shape == (6, 6, len(rows)), poses.covariance.shape
np.testing.assert_array_equal(poses.covariance[0, 4][known], column("cov_xry")[known])
np.testing.assert_array_equal(poses.covariance[4, 0][known], column("cov_xry")[known])
assert 0 < known.sum() < len(rows) and np.isnan(poses.std_m_rad[~known]).all()
np.testing.assert_array_equal(poses.couplings[1, 2], column("x23"))
np.testing.assert_allclose((poses.std_m_rad**2)[known], np.einsum("iin->ni", poses.covariance)[known], rtol=1e-12)
flag_names = list(mat["flag_names"])
assert flag_names[3] == "distorted" and len(flag_names) == 15, flag_names
print(f"{len(rows)} poses equal the recording")
