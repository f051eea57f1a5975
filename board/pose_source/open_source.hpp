// Opens a source of poses by its name.
#pragma once

#include <memory>
#include <string>

#include "board/pose_source/pose_source.hpp"

namespace tricoil::host {

/// name:
/// - can:INTERFACE, usb:VENDOR:PRODUCT or serial:PATH: a device; a configuration file whose name ends in .toml: its device;
/// - columns:WHERE, couplings:WHERE or poses:WHERE[,KEY=VALUE...]: text of other hardware (linux_board::TextSource);
/// - sim:SCENARIO[,KEY=VALUE...]: a simulation. Keys: mux (tdm, fdm, dual-band), rate_hz, duration_s, seed, noise (yes, no),
///   stations (1 to 4 sensors), realtime (yes, no; default no: as fast as poses are polled);
/// - recording:FOLDER: a recording of `tricoil run --record`.
/// tracker: direct, previous, scaat, or dual-band for mux=dual-band; scaat and dual-band may be followed by ,predict_s=SECONDS;
/// empty: that of the configuration or recording, otherwise direct.
/// Throws InputError, naming the invalid part, or DeviceError if a coil line cannot be opened.
std::unique_ptr<PoseSource> open_source(const std::string& name, const std::string& tracker);

}  // namespace tricoil::host
