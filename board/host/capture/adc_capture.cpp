#include "board/host/capture/adc_capture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "board/support/errors.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil::host {
namespace {

constexpr std::array kOrder{"state", "repeat", "sample"};
constexpr std::array kNotChannels{"", "state", "repeat", "sample", "time_us", "time_s"};

int parse_state(std::string_view cell, const TextPlace& place) {
    const bool is_state = cell.size() == 2 && cell[0] == 'S' && cell[1] >= '1' && cell[1] < '1' + kSourceCoils;
    refuse_if(!is_state, "{}: state '{}' is not S1, S2 or S3", place, shown(cell));
    return cell[1] - '1';
}

}  // namespace

CaptureReader::CaptureReader(const std::string& path, const CaptureForm& form) : path_(path), follows_(form.follows) {
    refuse_if(form.bits < CaptureForm::kFewestBits || form.bits > CaptureForm::kMostBits,
              "--bits: {} is not possible; give {} to {}", form.bits, CaptureForm::kFewestBits, CaptureForm::kMostBits);
    LineReader lines(path, form.follows);
    if (lines.starts_with("RIFF")) {
        wav_.emplace(std::move(lines));
        full_scale_ = 0.9999;  // codes of 16 bits end at 0.99997
        frame_.resize(wav_->channels());
        names_.assign(frame_.size(), "");
    } else {
        table_.emplace(std::move(lines));
        codes_ = static_cast<int>((std::int64_t{1} << form.bits) - 1);
        full_scale_ = codes_ / 2;
        for (std::size_t n = 0; n < table_->cells().size(); ++n) {
            names_.push_back(table_->name(n));
        }
        for (std::size_t n = 0; n < kOrder.size() && table_->has("state"); ++n) {
            order_.push_back(table_->column(kOrder[n], "state,repeat,sample and the channels"));
        }
    }
    for (std::size_t n = 0; n < names_.size(); ++n) {
        names_[n] = wav_ ? fmt::format("channel {}", n + 1) : names_[n];
        if (form.columns.empty() && std::ranges::find(kNotChannels, names_[n]) == kNotChannels.end()) {
            columns_.push_back(n);
        }
    }
    for (const std::string& name : form.columns) {
        columns_.push_back(column_of(name));
    }
    for (const std::size_t column : columns_) {
        channels_.push_back(names_[column]);
    }
    refuse_if(channels_.size() != kSensorCoils && channels_.size() != kSensorCoils + 1,
              "{}: {} channels; three sensor coils are needed, and optionally the reference: select them with --columns", path_,
              channels_.size());
    values_.resize(columns_.size());
    has_sample_ = next_sample();
}

std::size_t CaptureReader::column_of(const std::string& name) const {
    const auto number = number_from<std::size_t>(name);
    const std::size_t column = number   ? *number - 1
                               : table_ ? table_->column(name, "the channels of --columns and --reference")
                                        : names_.size();
    refuse_if(column >= names_.size(), "{}: no column '{}'; it has {}", path_, name, names_.size());
    return column;
}

std::size_t CaptureReader::channel_of(const std::string& name) const {
    const auto found = std::ranges::find(columns_, column_of(name));
    refuse_if(found == columns_.end(), "{}: the reference '{}' is not one of --columns", path_, name);
    return static_cast<std::size_t>(found - columns_.begin());
}

bool CaptureReader::next_sample() {
    if (wav_ ? !wav_->next(frame_) : !table_->next()) {
        return false;
    }
    const auto has_fraction = [&](std::size_t column) {
        return table_->cells()[column].find_first_not_of("+-0123456789") != std::string_view::npos;
    };
    if (table_ && read_ == 0 && std::ranges::any_of(columns_, has_fraction)) {
        codes_ = 0;
        full_scale_ = 0;
    }
    ++read_;
    std::ranges::transform(columns_, values_.begin(), [&](std::size_t column) {
        return wav_ ? frame_[column] : codes_ == 0 ? table_->number(column) : table_->whole(column, -codes_ / 2 - 1, codes_);
    });
    if (has_states()) {
        coil_ = parse_state(table_->cells()[order_[0]], table_->place());
        repeat_ = table_->whole(order_[1], 0, 1'000'000);
        number_ = table_->whole(order_[2], 0, 1'000'000);
    }
    return true;
}

bool CaptureReader::next(CapturedBlock& block, std::size_t samples) {
    block = {coil_, has_states() ? repeat_ : block.repeat + 1, read_ - (has_sample_ ? 1 : 0), {}};
    std::size_t count = 0;
    std::size_t line = 0;
    for (; has_sample_ && (has_states() ? coil_ == block.coil && repeat_ == block.repeat : count < samples); ++count) {
        refuse_if(has_states() && number_ != static_cast<int>(count),
                  "{}: sample {} instead of {}; samples are missing or out of order", table_->place(), number_, count);
        line = table_ ? table_->place().line : 0;
        block.values.insert(block.values.end(), values_.begin(), values_.end());
        has_sample_ = next_sample();
    }
    const std::size_t whole = has_states() ? block_samples_ : samples;
    if (count == 0 || (count < whole && !has_sample_ && (!has_states() || follows_))) {
        return false;
    }
    refuse_if(block_samples_ != 0 && count != block_samples_,
              "{}: the block that ends here has {} samples, the first has {}; the recording is incomplete",
              TextPlace{path_, line}, count, block_samples_);
    block_samples_ = count;
    if (!centre_) {
        centre_ = codes_ != 0 && *std::ranges::min_element(block.values) >= 0 ? full_scale_ + 1 : 0;  // codes without a sign
    }
    std::ranges::for_each(block.values, [&](double& value) { value -= *centre_; });
    return true;
}

}  // namespace tricoil::host
