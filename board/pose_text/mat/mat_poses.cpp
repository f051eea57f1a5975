#include "board/pose_text/mat/mat_poses.hpp"

#include <fmt/format.h>
#include <matio.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <limits>
#include <memory>
#include <string>

#include "board/pose_text/flag_names.hpp"
#include "board/pose_text/pose_fields.hpp"
#include "board/support/errors.hpp"
#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kMostPoses = 4'000'000;  // 2 GB; the format has 32-bit sizes
constexpr const char* kHeader = "MATLAB 5.0 MAT-file, written by tricoil";

[[noreturn]] void fail() { throw DeviceError("the MAT file could not be written; is the memory full?"); }

struct FreeVariable {
    void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

Variable checked(matvar_t* variable) {
    if (variable == nullptr) {
        fail();
    }
    return Variable(variable);
}

/// Copies `values`, which are in column-major order.
Variable array_of(const char* name, std::vector<std::size_t> dimensions, const std::vector<double>& values) {
    return checked(Mat_VarCreate(name, MAT_C_DOUBLE, MAT_T_DOUBLE, static_cast<int>(dimensions.size()), dimensions.data(),
                                 const_cast<double*>(values.data()), 0));  // NOLINT: the library only reads
}

/// Adds to a structure, which then owns the variable.
void set_field(matvar_t* structure, const char* name, Variable variable) {
    if (Mat_VarAddStructField(structure, name) != 0) {
        fail();
    }
    Mat_VarSetStructFieldByName(structure, name, 0, variable.release());
}

using Poses = std::vector<tracking::PoseEstimate<double>>;

/// One column for each number of the field.
Variable column_of(const Poses& poses, const PoseField& field, const PoseUnits& units) {
    std::vector<double> values(field.count * poses.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t row = 0; row < poses.size(); ++row) {
        std::array<double, PoseField::kMostNumbers> numbers{};
        if (field.integer != nullptr) {
            values[row] = static_cast<double>(field.integer(poses[row]));
        } else if (field.numbers({poses[row]}, units, numbers.data())) {
            for (std::size_t i = 0; i < field.count; ++i) {
                values[i * poses.size() + row] = numbers[i];
            }
        }
    }
    return array_of(pose_key(field, units).c_str(), {poses.size(), field.count}, values);
}

template <typename Member>
Variable matrices_of(const char* name, const Poses& poses, Member member, std::size_t size) {
    std::vector<double> values;
    values.reserve(size * size * poses.size());
    for (const auto& pose : poses) {
        const auto& matrix = pose.*member;
        values.insert(values.end(), matrix.data(), matrix.data() + matrix.size());
    }
    return array_of(name, {size, size, poses.size()}, values);
}

Variable structure_of(const Poses& poses, const PoseUnits& units) {
    std::array<std::size_t, 2> one{1, 1};
    Variable structure = checked(Mat_VarCreateStruct("poses", 2, one.data(), nullptr, 0));
    for_each_field(kPoseForm, units, [&](const PoseField& field) {
        if (!field.is_names()) {
            set_field(structure.get(), pose_key(field, units).c_str(), column_of(poses, field, units));
        }
    });
    using Pose = tracking::PoseEstimate<double>;
    set_field(structure.get(), "covariance", matrices_of("covariance", poses, &Pose::covariance, 6));
    set_field(structure.get(), "couplings", matrices_of("couplings", poses, &Pose::signal_matrix, 3));
    return structure;
}

/// Cell array of strings.
Variable names_of_flags() {
    const auto names = flag_names();
    std::array<std::size_t, 2> dimensions{1, names.size()};
    Variable cells = checked(Mat_VarCreate("flag_names", MAT_C_CELL, MAT_T_CELL, 2, dimensions.data(), nullptr, 0));
    for (std::size_t n = 0; n < names.size(); ++n) {
        std::string name = names[n];
        std::array<std::size_t, 2> length{1, name.size()};
        Variable text = checked(Mat_VarCreate(nullptr, MAT_C_CHAR, MAT_T_UTF8, 2, length.data(), name.data(), 0));
        Mat_VarSetCell(cells.get(), static_cast<int>(n), text.release());
    }
    return cells;
}

}  // namespace

void MatPoses::add(const tracking::PoseEstimate<double>& pose) {
    refuse_if(poses_.size() == kMostPoses, "a MAT file holds at most {} poses; use --to csv or mcap", kMostPoses);
    poses_.push_back(pose);
}

void MatPoses::finish(const std::function<void(std::string_view)>& put) const {
    const drivers::FileDescriptor memory(::memfd_create("poses.mat", MFD_CLOEXEC));  // the library writes only to paths
    const std::string path = fmt::format("/proc/self/fd/{}", memory.get());
    {
        const std::unique_ptr<mat_t, int (*)(mat_t*)> file(Mat_CreateVer(path.c_str(), kHeader, MAT_FT_MAT5), Mat_Close);
        if (!file || Mat_VarWrite(file.get(), structure_of(poses_, units_).get(), MAT_COMPRESSION_NONE) != 0 ||
            Mat_VarWrite(file.get(), names_of_flags().get(), MAT_COMPRESSION_NONE) != 0) {
            fail();
        }
    }
    std::array<char, 65536> buffer{};
    for (ssize_t size = 0; (size = ::read(memory.get(), buffer.data(), buffer.size())) != 0;) {
        if (size < 0) {
            fail();
        }
        put({buffer.data(), static_cast<std::size_t>(size)});
    }
}

}  // namespace tricoil::host
