// Matrices of tricoil as Eigen's, without a copy; the only header that needs Eigen.
#pragma once

#include "core/linear/eigen.hpp"
