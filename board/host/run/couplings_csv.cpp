#include "board/host/run/couplings_csv.hpp"

#include <fmt/format.h>

#include "board/support/coupling_text.hpp"

namespace tricoil::host {
namespace {

constexpr int kFirst = 3;  // matrices at the start of a rest that are left out

bool is_same(const solver::RigidPose<double>& a, const solver::RigidPose<double>& b) {
    return a.position_m == b.position_m && a.q_source_sensor.coeffs() == b.q_source_sensor.coeffs();
}

}  // namespace

CouplingsCsv::CouplingsCsv(const std::string& path) : file_(path) {
    file_.write(kPoseCsvHeader);
    file_.write(kQuadratureColumns);
    file_.write("\n");
}

void CouplingsCsv::add(const Mat3<double>& x, const solver::RigidPose<double>& truth) {
    if (!pose_ || !is_same(*pose_, truth)) {
        end_pose();
        pose_ = truth;
        matrices_ = 0;
        sum_ = {};
    } else if (matrices_ > kFirst) {
        sum_.in_phase += last_.in_phase;
        sum_.quadrature += last_.quadrature;
    }
    last_ = {x, quadrature_};
    ++matrices_;
}

void CouplingsCsv::do_column(const MeasuredColumn<double>& column) {
    if (const int coil = coil_index(column.state); coil >= 0 && !column.flags.has(ColumnFlag::low_band)) {
        quadrature_.col(coil) = column.quadrature;
    }
}

void CouplingsCsv::end_pose() {
    const int averaged = matrices_ - kFirst - 1;
    if (!pose_ || (matrices_ > 1 && averaged < 1)) {  // a rest that is too short
        return;
    }
    const double weight = matrices_ == 1 ? 1 : 1.0 / averaged;
    const Couplings& sum = matrices_ == 1 ? last_ : sum_;
    const Quat<double>& q = pose_->q_source_sensor;
    std::string line;
    for (const double value : {pose_->position_m.x(), pose_->position_m.y(), pose_->position_m.z(), q.w(), q.x(), q.y(), q.z()}) {
        line += fmt::format("{:.10g},", value);
    }
    line += matrix_text(weight * sum.in_phase) + "," + matrix_text(weight * sum.quadrature) + "\n";
    file_.write(line);
    ++poses_;
}

std::size_t CouplingsCsv::commit() {
    end_pose();
    if (poses_ > 0) {
        file_.commit();
    }
    return poses_;
}

}  // namespace tricoil::host
