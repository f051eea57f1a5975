// Runs the SCAAT filter and the smoother on the inputs of trackers, for all sensors.
#pragma once

#include <memory>
#include <vector>

#include "board/host/smooth/smoother.hpp"
#include "board/record/tracker_settings.hpp"

namespace tricoil::host {

/// The same settings with the SCAAT filter as the method, or after the removal of metal, and without prediction.
TrackerSettings for_smoothing(TrackerSettings settings);

/// Poses arrive at the receiver with a delay of up to 36,864 poses, each sensor's in the order of time.
class SmoothingTap final : public tracking::TrackerTap<double> {
public:
    explicit SmoothingTap(Smoother::Receiver receiver) : receiver_(std::move(receiver)) {}

    /// Delivers the remaining poses.
    void finish();

private:
    struct Sensor {
        Sensor(const tracking::TrackerParams<double>& params, const tracking::AnyTracker::Calibration& coils,
               const Smoother::Receiver& receiver)
            : tracker(params, coils), smoother(receiver) {}

        tracking::AnyTracker tracker;
        Smoother smoother;
    };

    void do_begin(const Settings& settings) override;
    void do_column(const MeasuredColumn<double>& column) override;
    void do_tick(std::uint8_t sensor, DeviceTime now) override;
    void do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) override;

    Smoother::Receiver receiver_;
    std::vector<std::unique_ptr<Sensor>> sensors_;
};

}  // namespace tricoil::host
