#include "core/tracking/scaat/filter_impl.hpp"
#include "core/tracking/scaat/scaat_tracker.hpp"

namespace tricoil::tracking::scaat {

template class Filter<float, ConcentricMeasurement<float>>;

}  // namespace tricoil::tracking::scaat
