// Format of a recording: a folder with a description and three line files. README.md describes it.
#pragma once

#include <array>
#include <cstddef>

namespace tricoil::host {

constexpr const char* kRecordingFormat = "tricoil recording";
constexpr int kRecordingVersion = 2;
constexpr const char* kDescriptionFile = "recording.json";

/// Line files.
enum class RecordFile : std::size_t { inputs, poses, events };
constexpr std::array<const char*, 3> kRecordFiles{"inputs.csv", "poses.csv", "events.csv"};

/// Kinds of input lines. `begin`: the trackers were created again.
constexpr std::array<const char*, 4> kInputKinds{"column", "tick", "hemisphere", "begin"};
enum class InputKind : std::size_t { column, tick, hemisphere, begin };

constexpr std::array<const char*, 3> kRecordHeaders{
    "kind,sensor,time_us,state,state_sequence,sequence,flags,in_phase_1,in_phase_2,in_phase_3,quadrature_1,quadrature_2,"
    "quadrature_3,sigma_1,sigma_2,sigma_3",
    "sensor,sequence,time_us,valid,flags,state,x_m,y_m,z_m,qw,qx,qy,qz,cov_xx,cov_xy,cov_xz,cov_xrx,cov_xry,cov_xrz,cov_yy,cov_"
    "yz,"
    "cov_yrx,cov_yry,cov_yrz,cov_zz,cov_zrx,cov_zry,cov_zrz,cov_rxrx,cov_rxry,cov_rxrz,cov_ryry,cov_ryrz,cov_rzrz,"
    "distortion_chi_square,snr_db,predicted_error_mm,predicted_error_deg,x11,x21,x31,x12,x22,x32,x13,x23,x33",
    "time_us,sensor,event,detail"};

}  // namespace tricoil::host
