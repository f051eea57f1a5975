// GPIO lines through libgpiod 1.6.
#include <gpiod.h>

#include "drivers/gpiod/gpio_line.hpp"

namespace tricoil::drivers {
namespace {

class GpioLineV1 final : public GpioLine {
public:
    bool open_chip(const std::string& path) override {
        chip_.reset(gpiod_chip_open(path.c_str()));
        return chip_ != nullptr;
    }
    [[nodiscard]] std::string chip_label() const override { return gpiod_chip_label(chip_.get()); }

    bool find(const std::string& name) override {
        line_ = gpiod_chip_find_line(chip_.get(), name.c_str());
        return line_ != nullptr;
    }
    bool find(unsigned offset) override {
        line_ = gpiod_chip_get_line(chip_.get(), offset);
        return line_ != nullptr;
    }
    bool request(Use use, bool active_low, const char* consumer) override {
        const int flags = active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
        const int status = use == Use::output ? gpiod_line_request_output_flags(line_, consumer, flags, 0)
                                              : gpiod_line_request_rising_edge_events_flags(line_, consumer, flags);
        return status == 0;
    }
    [[nodiscard]] std::string consumer() const override {
        const char* name = gpiod_line_consumer(line_);
        return name != nullptr ? name : "";
    }

    bool set(bool on) override { return gpiod_line_set_value(line_, on ? 1 : 0) == 0; }
    [[nodiscard]] int edge_fd() const override { return gpiod_line_event_get_fd(line_); }
    bool read_edge(std::uint64_t& time_ns) override {
        gpiod_line_event event{};
        const bool is_read = gpiod_line_event_read(line_, &event) == 0;
        time_ns = static_cast<std::uint64_t>(event.ts.tv_sec) * 1'000'000'000 + static_cast<std::uint64_t>(event.ts.tv_nsec);
        return is_read;
    }

private:
    struct Closer {
        void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }  // also releases its lines
    };
    std::unique_ptr<gpiod_chip, Closer> chip_;
    gpiod_line* line_ = nullptr;
};

}  // namespace

std::unique_ptr<GpioLine> make_gpio_line() { return std::make_unique<GpioLineV1>(); }

}  // namespace tricoil::drivers
