#include "core/tracking/scaat/filter_impl.hpp"
#include "core/tracking/scaat/scaat_tracker.hpp"

namespace tricoil::tracking::scaat {

template class Filter<double, ConcentricMeasurement<double>>;

}  // namespace tricoil::tracking::scaat
