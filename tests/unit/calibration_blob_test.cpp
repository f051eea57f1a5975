#include "core/calibration/blob.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <vector>

#include "board/host/calibration/ideal_couplings.hpp"
#include "core/base/crc32.hpp"
#include "core/calibration/coil_correction.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::calibration {
namespace {

Calibration<double> sample() {
    test::RandomPoses random(41);
    Calibration<double> c;
    c.model.source_moment = 2.8e-3 * (Mat3<double>::Identity() + 0.05 * random.gaussian_matrix());
    c.model.sensor_sensitivity += 0.05 * random.gaussian_matrix();
    c.model.source_offset_m = 0.03 * random.gaussian_matrix();
    c.model.sensor_offset_m = 0.003 * random.gaussian_matrix();
    c.model.source_octupole_m2 = 1e-4 * random.gaussian_vector();
    c.model.sensor_octupole_m2 = 1e-5 * random.gaussian_vector();
    c.phase_rad = 0.1 * random.gaussian_vector();
    c.hemisphere = random.direction();
    c.output_linear += 1e-3 * random.gaussian_matrix();
    c.output_offset_m = 1e-4 * random.gaussian_vector();
    return c;
}

TEST(Crc32, HasTheStandardCheckValue) {
    const std::array<std::uint8_t, 9> digits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
    EXPECT_EQ(crc32(digits), 0xCBF43926U);
}

TEST(CalibrationBlob, ReadsBackBitForBit) {
    const Calibration<double> written = sample();
    const Blob blob = encode(written);
    const auto read = decode(blob);
    ASSERT_TRUE(read.ok()) << read.status().message();
    EXPECT_EQ(encode(*read), blob);
    EXPECT_EQ(read->model.source_moment, written.model.source_moment);
    EXPECT_EQ(read->model.sensor_sensitivity, written.model.sensor_sensitivity);
    EXPECT_EQ(read->model.source_offset_m, written.model.source_offset_m);
    EXPECT_EQ(read->model.sensor_offset_m, written.model.sensor_offset_m);
    EXPECT_EQ(read->model.source_octupole_m2, written.model.source_octupole_m2);
    EXPECT_EQ(read->model.sensor_octupole_m2, written.model.sensor_octupole_m2);
    EXPECT_EQ(read->phase_rad, written.phase_rad);
    EXPECT_EQ(read->hemisphere, written.hemisphere);
    EXPECT_EQ(read->output_linear, written.output_linear);
    EXPECT_EQ(read->output_offset_m, written.output_offset_m);
}

TEST(CalibrationBlob, RefusesEverySingleFlippedBit) {
    const Blob blob = encode(sample());
    for (std::size_t bit = 0; bit < 8 * blob.size(); ++bit) {
        Blob damaged = blob;
        damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
        EXPECT_FALSE(decode(damaged).ok()) << "bit " << bit;
    }
}

Calibration<double> sample_near_metal(std::size_t dipoles) {
    test::RandomPoses random(42);
    Calibration<double> c = sample();
    c.misfit_floor = 1.5e-3;
    for (std::size_t d = 0; d < dipoles; ++d) {
        EXPECT_TRUE(c.model.surroundings.push_back({random.direction(), 1e-6 * random.gaussian_matrix()}));
    }
    return c;
}

TEST(CalibrationBlob, StoresSurroundingsInSinglePrecision) {
    for (std::size_t dipoles = 0; dipoles <= field::kMaxInducedDipoles; ++dipoles) {
        const Calibration<double> written = sample_near_metal(dipoles);
        const Blob blob = encode(written);
        const auto read = decode(blob);
        ASSERT_TRUE(read.ok()) << read.status().message();
        EXPECT_EQ(encode(*read), blob);
        EXPECT_EQ(read->misfit_floor, static_cast<float>(written.misfit_floor));
        EXPECT_EQ(read->model.source_moment, written.model.source_moment.cast<float>().cast<double>());
        EXPECT_EQ(read->output_offset_m, written.output_offset_m.cast<float>().cast<double>());
        ASSERT_EQ(read->model.surroundings.size(), dipoles);
        for (std::size_t d = 0; d < dipoles; ++d) {
            const auto single = written.model.surroundings[d].cast<float>();
            EXPECT_EQ(read->model.surroundings[d].position_m, single.position_m.cast<double>());
            EXPECT_EQ(read->model.surroundings[d].moment, single.moment.cast<double>());
        }
        const auto in_single = decode_single(blob);
        ASSERT_TRUE(in_single.ok());
        EXPECT_EQ(in_single->model.surroundings.size(), dipoles);
    }
}

TEST(CalibrationBlob, RefusesFlippedBitsOfSurroundings) {
    const Blob blob = encode(sample_near_metal(field::kMaxInducedDipoles));
    for (std::size_t bit = 0; bit < 8 * blob.size(); ++bit) {
        Blob damaged = blob;
        damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
        EXPECT_FALSE(decode(damaged).ok()) << "bit " << bit;
    }
}

TEST(CalibrationBlob, RefusesVersion2WithoutItsNumbersOrWithBytesBehindThem) {
    const auto with_crc = [](Blob blob) {
        const std::uint32_t crc = crc32({blob.data(), kBlobBytes - 4});
        for (std::size_t i = 0; i < 4; ++i) {
            blob[kBlobBytes - 4 + i] = static_cast<std::uint8_t>(crc >> (8 * i));
        }
        return blob;
    };
    Blob blob = encode(sample_near_metal(2));
    blob[kBlobHeaderBytes + 4 * kLongBlobNumbers] = 1;
    EXPECT_EQ(decode(with_crc(blob)).status().code(), StatusCode::invalid_argument);
    blob = encode(sample_near_metal(0));
    std::fill_n(blob.begin() + kBlobHeaderBytes + 4 * kBlobNumbers, 4, std::uint8_t{0});
    EXPECT_EQ(decode(with_crc(blob)).status().code(), StatusCode::invalid_argument);
}

TEST(CalibrationBlob, RefusesSurroundingsOutOfRange) {
    auto c = sample_near_metal(1);
    c.model.surroundings[0].moment(1, 1) = std::numeric_limits<double>::infinity();
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::not_finite);
    c = sample_near_metal(1);
    c.model.surroundings[0].position_m = c.model.source_offset_m.col(2);
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::invalid_argument);
    c = sample_near_metal(0);
    c.misfit_floor = 0.2;
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::invalid_argument);
}

TEST(CalibrationBlob, RefusesOtherVersionsLengthsAndErasedFlash) {
    Blob blob = encode(sample());
    for (std::size_t length = 0; length < blob.size(); ++length) {
        EXPECT_FALSE(decode({blob.data(), length}).ok()) << length;
    }
    std::vector<std::uint8_t> longer(blob.begin(), blob.end());
    longer.push_back(0);
    EXPECT_FALSE(decode(longer).ok());
    EXPECT_FALSE(decode(std::vector<std::uint8_t>(kBlobBytes, 0xFF)).ok());
    blob[4] = kLongBlobVersion + 1;
    const std::uint32_t crc = crc32({blob.data(), kBlobBytes - 4});
    for (std::size_t i = 0; i < 4; ++i) {
        blob[kBlobBytes - 4 + i] = static_cast<std::uint8_t>(crc >> (8 * i));
    }
    EXPECT_STREQ(decode(blob).status().message(), "calibration of another version; calibrate again with this software");
}

TEST(CalibrationBlob, RefusesNumbersOutOfRange) {
    auto c = sample();
    c.model.source_moment(1, 1) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::not_finite);
    c = sample();
    c.model.sensor_sensitivity.col(2) = c.model.sensor_sensitivity.col(1);
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::invalid_argument);
    c = sample();
    c.model.source_offset_m(0, 0) = 30;  // offsets in millimetres instead of metres
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::invalid_argument);
}

TEST(CalibrationApply, UndoesGains) {
    auto c = sample();
    c.model.source_offset_m.setZero();
    c.model.sensor_offset_m.setZero();
    c.model.source_octupole_m2.setZero();
    c.model.sensor_octupole_m2.setZero();
    const Vec3<double> p(0.3, -0.1, 0.2);
    const Mat3<double> o = geometry::attitude_matrix(geometry::Euler<double>{0.3, 0.4, -1.0});
    const Mat3<double> x = field::signal_matrix(c.model, p, o);
    EXPECT_TRUE(host::ideal_couplings(c.model, x).isApprox(field::signal_matrix<double>(1.0, p, o), 1e-12));
    c.output_linear.setIdentity();
    EXPECT_TRUE(CoilCorrection<double>::phases(c).corrected_position(p).isApprox(p + c.output_offset_m, 1e-12));
}

}  // namespace
}  // namespace tricoil::calibration
