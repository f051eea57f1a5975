// GPIO lines through libgpiod 2.
#include <gpiod.h>

#include <cerrno>

#include "drivers/gpiod/gpio_line.hpp"

namespace tricoil::drivers {
namespace {

template <auto free_object>
struct Freed {
    template <typename Object>
    void operator()(Object* object) const {
        free_object(object);
    }
};
using Chip = std::unique_ptr<gpiod_chip, Freed<gpiod_chip_close>>;
using ChipInfo = std::unique_ptr<gpiod_chip_info, Freed<gpiod_chip_info_free>>;
using LineInfo = std::unique_ptr<gpiod_line_info, Freed<gpiod_line_info_free>>;
using Settings = std::unique_ptr<gpiod_line_settings, Freed<gpiod_line_settings_free>>;
using LineConfig = std::unique_ptr<gpiod_line_config, Freed<gpiod_line_config_free>>;
using RequestConfig = std::unique_ptr<gpiod_request_config, Freed<gpiod_request_config_free>>;
using Request = std::unique_ptr<gpiod_line_request, Freed<gpiod_line_request_release>>;
using Edges = std::unique_ptr<gpiod_edge_event_buffer, Freed<gpiod_edge_event_buffer_free>>;

class GpioLineV2 final : public GpioLine {
public:
    bool open_chip(const std::string& path) override {
        chip_.reset(gpiod_chip_open(path.c_str()));
        return chip_ != nullptr;
    }
    [[nodiscard]] std::string chip_label() const override {
        const ChipInfo info(gpiod_chip_get_info(chip_.get()));
        return info ? gpiod_chip_info_get_label(info.get()) : "";
    }

    bool find(const std::string& name) override {
        const int offset = gpiod_chip_get_line_offset_from_name(chip_.get(), name.c_str());
        return offset >= 0 && find(static_cast<unsigned>(offset));
    }
    bool find(unsigned offset) override {
        info_.reset(gpiod_chip_get_line_info(chip_.get(), offset));
        return info_ != nullptr;
    }
    bool request(Use use, bool active_low, const char* consumer) override {
        const Settings settings(gpiod_line_settings_new());
        const LineConfig lines(gpiod_line_config_new());
        const RequestConfig config(gpiod_request_config_new());
        edges_.reset(gpiod_edge_event_buffer_new(1));
        if (!settings || !lines || !config || !edges_) {
            errno = ENOMEM;
            return false;
        }
        const bool is_output = use == Use::output;
        gpiod_line_settings_set_direction(settings.get(), is_output ? GPIOD_LINE_DIRECTION_OUTPUT : GPIOD_LINE_DIRECTION_INPUT);
        gpiod_line_settings_set_edge_detection(settings.get(), is_output ? GPIOD_LINE_EDGE_NONE : GPIOD_LINE_EDGE_RISING);
        gpiod_line_settings_set_active_low(settings.get(), active_low);
        gpiod_request_config_set_consumer(config.get(), consumer);
        offset_ = gpiod_line_info_get_offset(info_.get());
        if (gpiod_line_config_add_line_settings(lines.get(), &offset_, 1, settings.get()) != 0) {
            return false;
        }
        request_.reset(gpiod_chip_request_lines(chip_.get(), config.get(), lines.get()));
        return request_ != nullptr;
    }
    [[nodiscard]] std::string consumer() const override {
        const char* name = gpiod_line_info_get_consumer(info_.get());
        return name != nullptr ? name : "";
    }

    bool set(bool on) override {
        const gpiod_line_value value = on ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
        return gpiod_line_request_set_value(request_.get(), offset_, value) == 0;
    }
    [[nodiscard]] int edge_fd() const override { return gpiod_line_request_get_fd(request_.get()); }
    bool read_edge(std::uint64_t& time_ns) override {
        if (gpiod_line_request_read_edge_events(request_.get(), edges_.get(), 1) != 1) {
            return false;
        }
        time_ns = gpiod_edge_event_get_timestamp_ns(gpiod_edge_event_buffer_get_event(edges_.get(), 0));
        return true;
    }

private:
    Chip chip_;
    LineInfo info_;
    unsigned offset_ = 0;
    Edges edges_;
    Request request_;
};

}  // namespace

std::unique_ptr<GpioLine> make_gpio_line() { return std::make_unique<GpioLineV2>(); }

}  // namespace tricoil::drivers
