// OpenIGTLink sessions; messages are read with the OpenIGTLink library.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <igtlMessageHeader.h>
#include <igtlStatusMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTransformMessage.h>
#include <igtl_util.h>
#include <sys/socket.h>

#include <array>
#include <cstring>
#include <optional>
#include <random>
#include <thread>

#include "board/host/serve/openigtlink/igtl_session.hpp"
#include "board/pose_text/openigtlink/igtl_messages.hpp"
#include "board/support/errors.hpp"
#include "tests/serve/poisoned_heap.hpp"

namespace tricoil::host::igtl_output {
namespace {

constexpr std::size_t kHeader = 58;
constexpr std::int64_t kNow = 1'700'000'000'123'456;

ServedPose pose_at(std::int64_t utc_us, std::uint8_t sensor = 0) {
    ServedPose served;
    served.pose.sensor = sensor;
    served.pose.position_m = {0.1, -0.2, 0.3};
    served.pose.q_source_sensor = Quat<double>(0.5, 0.5, -0.5, 0.5);
    served.utc = utc_time_us(utc_us);
    return served;
}

ServedPose invalid_at(std::int64_t utc_us, std::uint8_t sensor = 0) {
    ServedPose served = pose_at(utc_us, sensor);
    served.pose.flags.set(tracking::PoseFlag::low_signal);
    return served;
}

template <typename Message>
typename Message::Pointer unpack(const std::string& bytes, int& unpacked) {
    igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
    header->InitPack();
    std::memcpy(header->GetPackPointer(), bytes.data(), kHeader);
    header->Unpack();
    typename Message::Pointer message = Message::New();
    message->SetMessageHeader(header);
    message->AllocatePack();
    std::memcpy(message->GetPackBodyPointer(), bytes.data() + kHeader, bytes.size() - kHeader);
    unpacked = message->Unpack(1);
    return message;
}

std::string type_of(const std::string& bytes) { return std::string(bytes.data() + 2, strnlen(bytes.data() + 2, 12)); }

TEST(IgtlMessages, TransformIsInMillimetresAtItsOwnTime) {
    int unpacked = 0;
    const auto message = unpack<igtl::TransformMessage>(transform_message(pose_at(kNow)), unpacked);
    ASSERT_TRUE(unpacked & igtl::MessageHeader::UNPACK_BODY);
    igtl::Matrix4x4 matrix;
    message->GetMatrix(matrix);
    EXPECT_FLOAT_EQ(matrix[0][3], 100);
    EXPECT_FLOAT_EQ(matrix[1][3], -200);
    EXPECT_FLOAT_EQ(matrix[2][3], 300);
    const Mat3<double> r = pose_at(0).pose.q_source_sensor.toRotationMatrix();
    EXPECT_FLOAT_EQ(matrix[1][0], static_cast<float>(r(1, 0)));
    EXPECT_FLOAT_EQ(matrix[2][1], static_cast<float>(r(2, 1)));
    const igtl::TimeStamp::Pointer stamp = igtl::TimeStamp::New();
    igtl::TimeStamp::Pointer taken = stamp;
    message->GetTimeStamp(taken);
    EXPECT_NEAR(static_cast<double>(taken->GetTimeStampInNanoseconds() / 1000 % 1'000'000'000), kNow % 1'000'000'000, 1);
    EXPECT_STREQ(message->GetDeviceName(), "tricoil_1");
}

/// All sent messages. New heap memory is filled with `pattern`.
std::vector<std::string> all_messages(int pattern) {
    test::poison_fresh_memory(pattern);
    std::vector<ServedPose> poses{pose_at(kNow, 0), pose_at(kNow, 1)};
    std::vector<std::string> messages{transform_message(poses[0]), tracking_data_message(poses, "Patient"),
                                      tracking_data_message({}, "Patient"), status_message(pose_at(kNow)),
                                      status_message(invalid_at(kNow))};
    for (std::string message : {waiting_message(), tracking_stopped_message()}) {
        constexpr std::size_t kTimeAt = 34;
        constexpr std::size_t kTimeBytes = 8;
        constexpr std::size_t kCrcAt = 50;
        constexpr std::size_t kCrcBytes = 8;
        message.replace(kTimeAt, kTimeBytes, kTimeBytes, '\0').replace(kCrcAt, kCrcBytes, kCrcBytes, '\0');  // time of sending
        messages.push_back(std::move(message));
    }
    test::poison_fresh_memory(-1);
    return messages;
}

TEST(IgtlMessages, NoMessageHoldsUninitializedMemory) {
    const auto first = all_messages(0x55);
    const auto second = all_messages(0x2A);
    for (std::size_t n = 0; n < first.size(); ++n) {
        EXPECT_EQ(first[n], second[n]) << type_of(first[n]) << ", message " << n;
    }
}

TEST(IgtlMessages, StatusHoldsWholeFlagsAndSubCodeZero) {
    ServedPose served = invalid_at(kNow);
    served.pose.flags.set(tracking::PoseFlag::hemisphere_unknown);
    int unpacked = 0;
    const auto message = unpack<igtl::StatusMessage>(status_message(served), unpacked);
    EXPECT_EQ(message->GetSubCode(), 0);
    EXPECT_STREQ(message->GetErrorName(), "low_signal");
    EXPECT_STREQ(
        message->GetStatusString(),
        "no valid pose: low_signal, hemisphere_unknown; the hemisphere is unknown: set it to the half space of the sensor, "
        "or use --confined if the sensor never leaves it");
}

/// A session, and the client at the other end of its connection.
class IgtlSession : public ::testing::Test {
protected:
    void SetUp() override {
        std::array<int, 2> ends{};
        ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0);
        stream_.emplace(ends[0]);
        client_.reset(ends[1]);
        session_.emplace(*stream_);
    }
    void have(const ServedPose& served) { session_->take({&served, 1}); }
    void wait_out() { std::this_thread::sleep_for(Session::kQueryTimeout + std::chrono::milliseconds(20)); }
    void ask(const std::string& bytes) { session_->receive(bytes); }

    /// Received messages.
    std::vector<std::string> messages() {
        std::array<char, 65536> buffer{};
        const ssize_t n = ::recv(client_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
        std::vector<std::string> all;
        for (ssize_t at = 0; at < n;) {
            igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
            header->InitPack();
            std::memcpy(header->GetPackPointer(), buffer.data() + at, kHeader);
            header->Unpack();
            const auto size = static_cast<ssize_t>(kHeader) + static_cast<ssize_t>(header->GetBodySizeToRead());
            all.emplace_back(buffer.data() + at, static_cast<std::size_t>(size));
            at += size;
        }
        return all;
    }
    std::vector<std::string> types() {
        std::vector<std::string> names;
        for (const std::string& message : messages()) {
            names.push_back(type_of(message));
        }
        return names;
    }
    static std::string start(int resolution_ms) {
        const igtl::StartTrackingDataMessage::Pointer message = igtl::StartTrackingDataMessage::New();
        message->SetDeviceName("test");
        message->SetResolution(resolution_ms);
        message->SetCoordinateName("Patient");
        message->Pack();
        return {static_cast<const char*>(message->GetPackPointer()), static_cast<std::size_t>(message->GetPackSize())};
    }
    template <typename Message>
    static std::string header_only() {
        const typename Message::Pointer message = Message::New();
        message->SetDeviceName("test");
        message->Pack();
        return {static_cast<const char*>(message->GetPackPointer()), static_cast<std::size_t>(message->GetPackSize())};
    }

    std::optional<Stream> stream_;
    drivers::FileDescriptor client_;
    std::optional<Session> session_;
};

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST_F(IgtlSession, AClientWithoutRequestGetsTransforms) {
    have(pose_at(kNow));
    EXPECT_THAT(types(), IsEmpty());
    wait_out();
    have(pose_at(kNow + 4167));
    have(pose_at(kNow + 8333));
    EXPECT_THAT(types(), ElementsAre("TRANSFORM", "TRANSFORM"));
}

TEST_F(IgtlSession, TrackingDataHasTheRequestedRate) {
    ask(start(20));
    for (int n = 0; n < 240; ++n) {
        have(pose_at(kNow + n * 4167));
    }
    EXPECT_NEAR(static_cast<double>(types().size()), 50, 1);
    ask(header_only<igtl::StopTrackingDataMessage>());
    have(pose_at(kNow + 2'000'000));
    EXPECT_THAT(types(), ElementsAre("RTS_TDATA"));
    ask(start(0));
    have(pose_at(kNow + 2'004'167));
    have(pose_at(kNow + 2'008'333));
    EXPECT_THAT(types(), ElementsAre("TDATA", "TDATA"));
}

TEST_F(IgtlSession, TrackingDataHoldsAllSensorsThatAreValid) {
    ask(start(0));
    have(pose_at(kNow, 0));
    ServedPose of_one_coil = pose_at(kNow, 1);
    of_one_coil.pose.flags.set(tracking::PoseFlag::roll_undefined);
    have(of_one_coil);
    have(invalid_at(kNow, 2));
    (void)messages();
    have(pose_at(kNow + 4167, 0));
    int unpacked = 0;
    const auto all = messages();
    ASSERT_EQ(all.size(), 1U);
    const auto message = unpack<igtl::TrackingDataMessage>(all[0], unpacked);
    ASSERT_TRUE(unpacked & igtl::MessageHeader::UNPACK_BODY);
    ASSERT_EQ(message->GetNumberOfTrackingDataElements(), 2);
    igtl::TrackingDataElement::Pointer element;
    message->GetTrackingDataElement(1, element);
    EXPECT_STREQ(element->GetName(), "tricoil_2");
    EXPECT_EQ(element->GetType(), igtl::TrackingDataElement::TYPE_5D);
    message->GetTrackingDataElement(0, element);
    EXPECT_EQ(element->GetType(), igtl::TrackingDataElement::TYPE_6D);
    EXPECT_STREQ(message->GetDeviceName(), "Patient");
}

TEST_F(IgtlSession, TrackingDataLeavesOutOldPoses) {
    ask(start(0));
    for (int n = 0; n < 3; ++n) {
        have(pose_at(kNow + n * 4167, 0));
        have(pose_at(kNow + n * 4167, 1));
    }
    for (int n = 3; n < 7; ++n) {  // no more poses of the second sensor
        have(pose_at(kNow + n * 4167, 0));
    }
    std::vector<int> elements;
    for (const std::string& bytes : messages()) {
        int unpacked = 0;
        elements.push_back(unpack<igtl::TrackingDataMessage>(bytes, unpacked)->GetNumberOfTrackingDataElements());
    }
    EXPECT_THAT(elements, ElementsAre(1, 2, 2, 2, 2, 2, 2, 2, 1, 1));
}

TEST_F(IgtlSession, SensorsHaveTheNamesOfTheUser) {
    session_.emplace(*stream_, DeviceNames({"SensorToTracker"}));
    wait_out();
    have(pose_at(kNow, 0));
    have(pose_at(kNow, 1));
    have(invalid_at(kNow + 4167, 0));
    ask(start(0));
    have(pose_at(kNow + 8333, 1));
    const auto all = messages();
    ASSERT_EQ(all.size(), 4U);
    int unpacked = 0;
    EXPECT_STREQ(unpack<igtl::TransformMessage>(all[0], unpacked)->GetDeviceName(), "SensorToTracker");
    EXPECT_STREQ(unpack<igtl::TransformMessage>(all[1], unpacked)->GetDeviceName(), "tricoil_2");
    EXPECT_STREQ(unpack<igtl::StatusMessage>(all[2], unpacked)->GetDeviceName(), "SensorToTracker");
    EXPECT_EQ(type_of(all[3]), "TDATA");
}

TEST(IgtlMessages, RefusesNamesThatCannotBeSent) {
    const std::vector<std::vector<std::string>> wrong{
        {""}, {"123456789012345678901"}, {"two words"}, {"\xc3\xbc"}, {"a", "a"}, {"tricoil_2"}, {"a", "b", "c", "d", "e"}};
    for (const auto& names : wrong) {
        EXPECT_THROW(DeviceNames(names, "--igtl-name"), InputError) << names.front();
    }
    EXPECT_EQ(DeviceNames({"12345678901234567890", "tricoil_2"}).of(1), "tricoil_2");
}

/// A message of version 2: with an extended header, and metadata behind the content.
std::string as_version_2(const std::string& message) {
    const std::string extended{"\x00\x0c\x00\x02\x00\x00\x00\x03\x00\x00\x00\x01", 12};
    const std::string metadata{"\0\0xyz", 5};
    std::string body = extended + message.substr(kHeader) + metadata;
    std::string bytes = message.substr(0, kHeader) + body;
    bytes[1] = 2;
    const std::uint64_t crc = crc64(reinterpret_cast<unsigned char*>(body.data()), body.size(), 0);  // NOLINT
    for (unsigned n = 0; n < 8; ++n) {
        bytes[49 - n] = static_cast<char>(std::uint64_t{body.size()} >> (8 * n));
        bytes[57 - n] = static_cast<char>(crc >> (8 * n));
    }
    return bytes;
}

TEST_F(IgtlSession, AStartOfVersion2IsUnderstood) {
    ask(as_version_2(start(20)));
    for (int n = 0; n < 240; ++n) {
        have(pose_at(kNow + n * 4167));
    }
    const auto all = messages();
    EXPECT_NEAR(static_cast<double>(all.size()), 50, 1);
    int unpacked = 0;
    EXPECT_STREQ(unpack<igtl::TrackingDataMessage>(all.at(0), unpacked)->GetDeviceName(), "Patient");
    ask(header_only<igtl::StopTrackingDataMessage>());
    (void)messages();
    std::string damaged = as_version_2(start(20));
    damaged[70] = static_cast<char>(damaged[70] ^ 1);
    ask(damaged);
    std::string too_long = as_version_2(start(20));
    too_long[kHeader] = 1;  // an extended header that is longer than the message, with a correct CRC
    const std::uint64_t crc =
        crc64(reinterpret_cast<unsigned char*>(too_long.data() + kHeader), too_long.size() - kHeader, 0);  // NOLINT
    for (unsigned n = 0; n < 8; ++n) {
        too_long[57 - n] = static_cast<char>(crc >> (8 * n));
    }
    ask(too_long);
    have(pose_at(kNow + 2'000'000));
    EXPECT_THAT(types(), IsEmpty());
}

TEST_F(IgtlSession, AnInvalidPoseIsNeverSent) {
    wait_out();
    have(pose_at(kNow));
    have(invalid_at(kNow + 4167));
    have(invalid_at(kNow + 8333));
    have(pose_at(kNow + 12'500));
    const auto all = messages();
    ASSERT_EQ(all.size(), 4U);
    EXPECT_EQ(type_of(all[0]), "TRANSFORM");
    EXPECT_EQ(type_of(all[3]), "TRANSFORM");
    int unpacked = 0;
    const auto begins = unpack<igtl::StatusMessage>(all[1], unpacked);
    EXPECT_EQ(begins->GetCode(), igtl::StatusMessage::STATUS_NOT_READY);
    EXPECT_STREQ(begins->GetErrorName(), "low_signal");
    EXPECT_EQ(unpack<igtl::StatusMessage>(all[2], unpacked)->GetCode(), igtl::StatusMessage::STATUS_OK);
}

/// A viewer that shows the last pose is told again and again that it is old, and at once why.
TEST_F(IgtlSession, AnInvalidPeriodIsReportedWhileItLasts) {
    wait_out();
    have(pose_at(kNow));
    for (int n = 1; n <= 3 * 240; ++n) {  // three seconds; the flags change after two
        ServedPose served = invalid_at(kNow + n * 4167);
        if (n > 2 * 240 + 20) {
            served.pose.flags.set(tracking::PoseFlag::no_sensor);
        }
        have(served);
    }
    std::vector<std::string> names;
    for (const std::string& message : messages()) {
        int unpacked = 0;
        names.push_back(type_of(message) == "STATUS" ? unpack<igtl::StatusMessage>(message, unpacked)->GetErrorName() : "pose");
    }
    EXPECT_THAT(names, ElementsAre("pose", "low_signal", "low_signal", "low_signal", "low_signal"));
}

TEST_F(IgtlSession, AnswersRequests) {
    ask(header_only<igtl::GetStatusMessage>());
    EXPECT_THAT(types(), ElementsAre("STATUS"));
    have(pose_at(kNow));
    ask(header_only<igtl::GetTransformMessage>() + header_only<igtl::GetStatusMessage>());
    EXPECT_THAT(types(), ElementsAre("TRANSFORM", "STATUS"));
    have(invalid_at(kNow));
    ask(header_only<igtl::GetTransformMessage>());
    EXPECT_THAT(types(), ElementsAre("STATUS"));
}

TEST_F(IgtlSession, DamagedRequestsAreDropped) {
    std::string damaged = start(0);
    damaged.back() = static_cast<char>(damaged.back() ^ 1);
    ask(damaged);
    have(pose_at(kNow));
    EXPECT_THAT(types(), IsEmpty());
    ask(start(0));  // the next pose is sent
    have(pose_at(kNow));
    EXPECT_THAT(types(), ElementsAre("TDATA"));
    ask(start(0).substr(0, 70));  // half a request
    have(pose_at(kNow));
    EXPECT_THAT(types(), ElementsAre("TDATA"));
}

TEST_F(IgtlSession, GarbageEndsTheConnection) {
    std::mt19937 random(3);
    int gone = 0;
    for (int n = 0; n < 200; ++n) {
        SetUp();
        std::string bytes(random() % 300, ' ');
        for (char& c : bytes) {
            c = static_cast<char>(random());
        }
        ask(bytes);
        have(pose_at(kNow));
        gone += stream_->gone() ? 1 : 0;
    }
    EXPECT_GT(gone, 150);  // all with a complete header
}

}  // namespace
}  // namespace tricoil::host::igtl_output
