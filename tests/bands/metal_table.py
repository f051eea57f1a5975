#!/usr/bin/env python3
"""Makes core/tracking/dual_band/metal_table.hpp: kinds of metal from simulated objects of all shapes and materials.

metal_cases 1 1500 4 all all.bin; metal_cases 2 720 4 presets presets.bin
metal_table.py all.bin presets.bin >core/tracking/dual_band/metal_table.hpp     (needs python3-numpy)
"""
import sys

import numpy as np

KINDS = 40
FLOOR = 0.002  # relative increase of variances: shapes between those of the table

HEAD = """// Made by tests/bands/metal_table.py from the simulated physics. Do not edit.
#pragma once

#include <array>
#include <cstddef>

namespace tricoil::tracking {

/// Metals that respond alike. Per source coil: second moments of (effect in the high band, difference of the bands, quadrature of
/// the low band, quadrature of the high band), upper triangle by rows. The scale is free.
struct MetalKind {
    double weight;
    std::array<std::array<double, 10>, 3> moments;
};

// clang-format off
inline constexpr std::array<MetalKind, %d> kMetalKinds{{"""


def moments_of_objects(path):
    """Second moments per object and source coil. All places of an object count alike, near and far."""
    rows = np.fromfile(path).reshape(-1, 37)
    parts = rows[:, 1:].reshape(-1, 3, 2, 3, 2)  # case, coil, band, axis, real and imaginary
    low, high = parts[:, :, 0], parts[:, :, 1]
    seen = np.stack([high[..., 0], high[..., 0] - low[..., 0], low[..., 1], high[..., 1]], -1)
    size = (seen[..., 1:] ** 2).sum((1, 2, 3)) / 9
    moments = np.einsum('ncra,ncrb->ncab', seen, seen) / 3 / size[:, None, None, None]
    number = rows[:, 0].astype(int)
    total = np.zeros((number.max() + 1, 3, 4, 4))
    np.add.at(total, number, moments)
    return total / np.bincount(number)[:, None, None, None]


def group(moments):
    """k-means over the ratios and correlations of the four parts."""
    mean = moments.mean(1)
    size = np.sqrt(np.einsum('naa->na', mean))
    correlation = mean / size[:, :, None] / size[:, None, :]
    features = np.concatenate([2 * np.arcsinh(size[:, :1]), np.log(size[:, 2:] / size[:, 1:2]).clip(-6, 6),
                               2 * correlation[:, 0, 1:], 2 * correlation[:, [1, 1, 2], [2, 3, 3]]], 1)
    centres = features[np.random.default_rng(0).choice(len(features), KINDS, replace=False)]
    for _ in range(25):
        nearest = ((features[:, None] - centres[None]) ** 2).sum(-1).argmin(1)
        for kind in range(KINDS):
            if (nearest == kind).any():
                centres[kind] = features[nearest == kind].mean(0)
    return nearest


def main():
    moments = np.concatenate([moments_of_objects(path) for path in sys.argv[1:]])
    nearest = group(moments)
    used = [kind for kind in range(KINDS) if (nearest == kind).any()]
    kinds = np.stack([moments[nearest == kind].mean(0) for kind in used])
    weights = np.array([(nearest == kind).mean() for kind in used])
    kinds += FLOOR * np.einsum('kca,ab->kcab', np.einsum('kcaa->kca', kinds), np.eye(4))
    kinds /= np.einsum('kcaa->k', kinds[:, :, 1:, 1:])[:, None, None, None] / 3
    print(HEAD % len(used))
    for kind in np.argsort(-weights):
        coils = ', '.join('{%s}' % ', '.join('%.5g' % kinds[kind, coil, a, b] for a in range(4) for b in range(a, 4)) for coil in range(3))
        print('    {%.5g, {{%s}}},' % (weights[kind], coils))
    print('}};\n// clang-format on\n\n}  // namespace tricoil::tracking')


if __name__ == '__main__':
    main()
