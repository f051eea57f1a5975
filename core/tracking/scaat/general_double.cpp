#include "core/tracking/scaat/filter_impl.hpp"
#include "core/tracking/scaat/general_tracker.hpp"

namespace tricoil::tracking::scaat {

template class Filter<double, GeneralMeasurement<double>>;

}  // namespace tricoil::tracking::scaat
