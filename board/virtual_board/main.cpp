// The `tricoil-virtual-board` program: runs a flash image with simulated coils and connects its links to interfaces of this
// machine.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "board/command_line/parse.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/output_file.hpp"
#include "board/support/sim_input/fault_text.hpp"
#include "board/support/sim_input/scenario_file.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/text_table.hpp"
#include "board/virtual_board/board_fault_text.hpp"
#include "board/virtual_board/bridges.hpp"
#include "board/virtual_board/symbols_file.hpp"
#include "drivers/posix/monotonic_clock.hpp"
#include "sim/virtual_board/board_fault.hpp"
#include "sim/virtual_board/machine/run_failure.hpp"
#include "sim/virtual_board/machine/symbols.hpp"
#include "sim/virtual_board/run_report.hpp"
#include "sim/world/metal_check.hpp"

namespace tricoil::virtual_board {
namespace {

using nlohmann::ordered_json;

struct Options {
    std::string image;
    std::string elf;
    std::string scenario = "hand";
    std::uint64_t seed = 1;
    std::uint64_t board_seed = 0;
    double warmer_k = 0;
    double duration_s = 0;
    std::string can;
    std::string can_rate;
    bool list_registers = false;
    bool as_chip = false;
    bool usbip = false;
    bool serial = false;
    std::string pace = "auto";
    std::vector<std::string> faults;
    std::string flash;
    std::string report;
};

constexpr double kEndlessS = 3e6;  // range of Ticks
constexpr double kLargestChangeK = 60;
constexpr double kStepS = 250e-6;       // simulated time between two transfers of data on the links
constexpr unsigned kLowestHz = 10'000;  // ISO 11898: 1 Mbit/s in the arbitration phase, 8 Mbit/s in the data phase
constexpr unsigned kHighestNominalHz = 1'000'000;
constexpr unsigned kHighestDataHz = 8'000'000;

/// An unknown name is reported with the names of the world's faults and of the board's faults.
void check_fault_name(const std::string& text) {
    std::vector<std::string> names = host::fault_names();
    const std::vector<std::string> of_the_board = board_fault_names();
    names.insert(names.end(), of_the_board.begin(), of_the_board.end());
    (void)host::index_of_name("fault", text.substr(0, text.find_first_of(":@")), names);
}

/// NOMINAL or NOMINAL/DATA in bit/s; without DATA both phases have the same rate. Throws host::InputError.
CanWire::Rates parse_can_rate(const std::string& text) {
    const auto slash = text.find('/');
    const unsigned nominal = host::number_from<unsigned>(text.substr(0, slash)).value_or(0);
    const unsigned data = slash == std::string::npos ? nominal : host::number_from<unsigned>(text.substr(slash + 1)).value_or(0);
    host::refuse_if(nominal < kLowestHz || nominal > kHighestNominalHz || data < nominal || data > kHighestDataHz,
                    "--can-rate '{}': give NOMINAL or NOMINAL/DATA in bit/s: NOMINAL 10000 to 1000000, DATA up to 8000000, for "
                    "example 500000/2000000",
                    text);
    return {static_cast<double>(nominal), static_cast<double>(data)};
}

/// Any image that the board accepts: a stack pointer and a reset vector.
std::vector<std::uint8_t> smallest_image() {
    std::vector<std::uint8_t> image(256, 0);
    image[3] = 0x20;  // 0x20000100
    image[1] = 0x01;
    image[4] = 0x81;  // 0x08000081
    image[7] = 0x08;
    return image;
}

/// A Markdown table: peripheral, register, address, reset value, modelled bits, refused fields.
std::string register_list(const sim::Scenario& scenario) {
    VirtualBoard board(smallest_image(), scenario);
    std::vector<Mapping> mappings = board.machine.bus.mappings();
    std::sort(mappings.begin(), mappings.end(), [](const Mapping& a, const Mapping& b) { return a.base < b.base; });
    std::string text =
        "| peripheral | register | address | reset | modelled bits | refused fields |\n|---|---|---|---|---|---|\n";
    for (const Mapping& mapping : mappings) {
        for (const Register& r : mapping.device->registers()) {
            text += fmt::format("| {} | {} | {:#010x} | {:#010x} | {:#010x} | {} |\n", mapping.name, r.name,
                                mapping.base + r.offset, r.reset, r.modelled, r.others);
        }
    }
    return text;
}

std::vector<std::uint8_t> read_file(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        throw host::InputError(path + ": cannot be read; give a raw .bin for flash address 0x08000000");
    }
    return {std::istreambuf_iterator<char>(file), {}};
}

/// Loads flash bank 2 from the end of the last run. A missing file means an erased bank.
void load_flash(VirtualBoard& board, const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (path.empty() || !file) {
        return;
    }
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
    host::refuse_if(bytes.size() != board.flash.content().size(),
                    "{}: a copy of flash bank 2 has {} bytes; this file has another size", path, board.flash.content().size());
    board.flash.content() = bytes;
}

void save_flash(VirtualBoard& board, const std::string& path) {
    if (path.empty()) {
        return;
    }
    const auto& bytes = board.flash.content();
    host::write_whole_file(path, {bytes.begin(), bytes.end()});
}

class Run {
public:
    explicit Run(const Options& options)
        : options_(options), scenario_(host::load_scenario(options.scenario, options.seed)), symbols_(symbols(options.elf)) {
        std::vector<BoardFault> faults;
        for (const std::string& text : options.faults) {
            check_fault_name(text);
            if (is_board_fault(text)) {
                faults.push_back(parse_board_fault(text));
            } else {
                scenario_.faults.push_back(host::parse_fault(text));
            }
        }
        scenario_.duration_s = options.duration_s > 0 ? options.duration_s : std::numeric_limits<double>::infinity();
        sim::check_metal(scenario_);
        board_.emplace(read_file(options.image), scenario_, BoardCircuit::draw(options.board_seed, options.warmer_k));
        load_flash(*board_, options.flash);
        if (options.as_chip) {
            board_->machine.bus.on_doubt = [this](const std::string& text) {
                if (doubts_.insert(text).second) {
                    host::print_error("tricoil-virtual-board: warning", text);
                }
            };
        }
        if (!options.can_rate.empty()) {
            board_->can.set_rates(parse_can_rate(options.can_rate));
        }
        faults_.emplace(*board_, std::move(faults));
        connect();
    }

    void go() {
        const host::InterruptGuard guard;
        const double end_s = options_.duration_s > 0 ? options_.duration_s : kEndlessS;
        const bool paced = options_.pace == "real" || (options_.pace == "auto" && !bridges_.empty());
        const HostTime began = drivers::host_now();
        while (!guard.interrupted() && board_->now_s() < end_s && !board_->machine.cpu.in_bootloader()) {
            faults_->update();
            step(std::min(board_->now_s() + kStepS, end_s));
            for (const auto& bridge : bridges_) {
                bridge->serve();
            }
            const std::int64_t ahead = static_cast<std::int64_t>(1e6 * board_->now_s()) - (drivers::host_now() - began).count();
            if (paced && ahead > 0) {
                ::usleep(static_cast<unsigned>(ahead));
            }
        }
        save_flash(*board_, options_.flash);
    }

    [[nodiscard]] ordered_json report() {
        const Cpu& cpu = board_->machine.cpu;
        const WorstLatency latency = worst_latency(*board_);
        ordered_json json = {
            {"simulated_s", board_->now_s()},
            {"cpu_load", static_cast<double>(cpu.busy_cycles()) / static_cast<double>(std::max<std::uint64_t>(cpu.cycles(), 1))},
            {"worst_interrupt_latency_us", 1e6 * latency.seconds},
            {"worst_interrupt", latency.interrupt},
            {"resets", board_->resets()},
            {"in_bootloader", cpu.in_bootloader()},
            {"coils_driven", board_->bench.any_driven()},
            {"led_changes", board_->led_changes()},
            {"output_bytes", hash_.bytes()},
            {"output_hash", fmt::format("{:016x}", hash_.value())}};
        const auto bottom = symbols_.address_of("stack_bottom");
        const auto top = symbols_.address_of("stack_top");
        if (bottom && top) {
            const StackUse stack = stack_use(*board_, *bottom, *top);
            json["stack_bytes"] = stack.used;
            json["stack_size"] = stack.size;
        }
        return json;
    }

private:
    static Symbols symbols(const std::string& path) { return path.empty() ? Symbols() : read_symbols(path); }

    void connect() {
        if (options_.serial) {
            auto bridge = std::make_unique<SerialBridge>(board_->serial);
            fmt::print("serial {}\n", bridge->path());
            std::fflush(stdout);
            bridges_.push_back(std::move(bridge));
        }
        if (!options_.can.empty()) {
            bridges_.push_back(std::make_unique<CanBridge>(board_->can, options_.can));
        }
        if (options_.usbip) {
            bridges_.push_back(std::make_unique<UsbBridge>(board_->usb_wire));
        }
        board_->serial.on_byte = [this, before = board_->serial.on_byte](std::uint8_t byte) {
            hash_.add(OutputHash::Link::serial, {&byte, 1});
            if (before) {
                before(byte);
            }
        };
        board_->can.on_frame = [this, before = board_->can.on_frame](const CanFrame& frame) {
            hash_.add(OutputHash::Link::can, frame.data);
            if (before) {
                before(frame);
            }
        };
    }

    void step(double until_s) {
        try {
            board_->run_until(until_s);
        } catch (const RunFailure& failure) {
            const auto pc = static_cast<std::uint32_t>(std::stoul(failure.what(), nullptr, 16));
            const std::string place = symbols_.name_of(pc);
            throw RunFailure(fmt::format("firmware failure at {:.6f} s, pc {}{}", board_->now_s(), failure.what(),
                                         place.empty() ? "" : " (in " + place + ")"));
        }
    }

    Options options_;
    sim::Scenario scenario_;
    Symbols symbols_;
    std::optional<VirtualBoard> board_;
    std::optional<BoardFaults> faults_;
    std::vector<std::unique_ptr<Bridge>> bridges_;
    OutputHash hash_;
    std::set<std::string> doubts_;  // each reported once
};

int run(const Options& options) {
    if (options.list_registers) {
        fmt::print("{}", register_list(host::load_scenario(options.scenario, options.seed)));
        return 0;
    }
    host::refuse_if(options.image.empty(), "image is missing; give a raw .bin for flash address 0x08000000");
    (void)host::index_of_name("--pace", options.pace, {"auto", "real", "fast"});
    if (!(options.duration_s >= 0 && options.duration_s <= kEndlessS)) {  // also refuses nan
        throw host::InputError(fmt::format("--duration must be a number of seconds up to {}; 0 runs until a signal", kEndlessS));
    }
    host::refuse_if(!(std::abs(options.warmer_k) <= kLargestChangeK), "--warmer must be a change of temperature of at most {} K",
                    kLargestChangeK);
    Run run(options);
    run.go();
    const std::string text = run.report().dump(2) + "\n";
    if (options.report.empty()) {
        fmt::print("{}", text);
    } else {
        host::write_whole_file(options.report, text);
    }
    return 0;
}

int main_program(int argc, char** argv) {
    Options o;
    CLI::App program{"Runs a flash image for a NUCLEO-G474RE, byte for byte, with the tracker's simulated coils",
                     "tricoil-virtual-board"};
    program.add_option("image", o.image, "Image (.bin) for flash address 0x08000000, of the tracker or any other firmware");
    program.add_option("--elf", o.elf, "ELF file of the image: function names and stack size");
    program.add_option("--scenario", o.scenario, "Built-in scenario or a .toml file")->capture_default_str();
    // CLI11 would convert -1 to the largest seed.
    const auto not_negative = [](const std::string& text) {
        return text.starts_with('-') ? "must be a whole number of at least 0" : "";
    };
    program.add_option("--seed", o.seed, "Seed of noise and motion")->check(not_negative)->capture_default_str();
    program
        .add_option("--board-seed", o.board_seed,
                    "Parts of the board: tolerances and converter errors; 0: nominal parts, exact converters")
        ->check(not_negative)
        ->capture_default_str();
    program.add_option("--warmer", o.warmer_k, "Temperature of the board above that of its calibration, K")
        ->capture_default_str();
    program.add_option("--duration", o.duration_s, "Simulated time in seconds; 0: run until a signal")->capture_default_str();
    program.add_option("--can", o.can, "CAN FD interface for the board's CAN bus, for example vcan0");
    program.add_option("--can-rate", o.can_rate,
                       "Bit rates of the CAN bus in bit/s, NOMINAL or NOMINAL/DATA; default 1000000/5000000");
    program.add_flag("--usbip", o.usbip, "Plug the board into the kernel's virtual USB host controller");
    program.add_flag("--serial", o.serial, "Connect the serial line to a pseudo terminal and print its path");
    program.add_option("--pace", o.pace, "Simulation speed: real, fast, or auto (real if a link is connected)")
        ->capture_default_str();
    program.add_option("--flash", o.flash, "Flash bank 2: read at the start if the file exists, written at the end");
    program.add_flag("--as-chip", o.as_chip,
                     "Go on, with a warning, as the chip does: access to a peripheral without a clock, core clock above the "
                     "limit of the core voltage, clock off in sleep mode, MPU region that is not checked");
    program.add_flag("--registers", o.list_registers, "Print every modelled register with its modelled bits, and exit");
    program.add_option("--report", o.report, "Write the final report to this file");
    std::string faults = "Fault of the simulated world (as in tricoil run --fault) or of the board, NAME[:NUMBER][@BEGIN[-END]]:";
    for (const BoardFaultKind& kind : board_fault_kinds()) {
        faults += std::string("\n") + kind.help;
    }
    program.add_option("--fault", o.faults, faults);
    return host::parse_command_line(program, argc, argv) ? run(o) : to_int(host::ExitCode::fine);
}

}  // namespace
}  // namespace tricoil::virtual_board

int main(int argc, char** argv) {
    constexpr const char* kName = "tricoil-virtual-board";
    return tricoil::host::exit_code_of(kName, [&] {
        try {
            return tricoil::virtual_board::main_program(argc, argv);
        } catch (const tricoil::virtual_board::RunFailure& error) {
            tricoil::host::print_error(kName, error.what());
            return to_int(tricoil::host::ExitCode::check_failed);
        }
    });
}
