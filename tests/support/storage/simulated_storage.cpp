#include "tests/support/storage/simulated_storage.hpp"

#include <cstring>

namespace tricoil::sim {
namespace {

constexpr Status kNoPower{StatusCode::device_lost, "the power has failed"};
constexpr Status kInvalidAddress{StatusCode::invalid_argument, "address outside the storage"};

}  // namespace

SimulatedStorage::SimulatedStorage(std::size_t slots, std::size_t slot_bytes)
    : slots_(slots), slot_bytes_(slot_bytes), words_(slots * slot_bytes / kWordBytes) {}

bool SimulatedStorage::is_valid_range(std::size_t slot, std::size_t offset, std::size_t bytes) const {
    return slot < slots_ && offset % kWordBytes == 0 && bytes % kWordBytes == 0 && offset + bytes <= slot_bytes_;
}

bool SimulatedStorage::fails_now() {
    ++operations_;
    if (left_ == kForever) {
        return false;
    }
    return --left_ == 0;
}

Status SimulatedStorage::do_erase(std::size_t slot) {
    if (!is_valid_range(slot, 0, 0)) {
        return kInvalidAddress;
    }
    if (!has_power()) {
        return kNoPower;
    }
    const bool fails = fails_now();
    for (std::size_t at = 0; at < slot_bytes_; at += kWordBytes) {
        Word& one = word(slot, at);
        const std::size_t kind = at / kWordBytes % 3;  // word after an interrupted erase: 0 unchanged, 1 erased, 2 unreadable
        one.is_damaged = fails && (kind == 2 || (kind == 0 && one.is_damaged));
        one.value = fails && kind == 0 ? one.value : ~std::uint64_t{0};
    }
    return fails ? kNoPower : Status{};
}

Status SimulatedStorage::do_program(std::size_t slot, std::size_t offset, std::uint64_t value) {
    if (!is_valid_range(slot, offset, kWordBytes)) {
        return kInvalidAddress;
    }
    if (!has_power()) {
        return kNoPower;
    }
    Word& one = word(slot, offset);
    if (one.is_damaged || one.value != ~std::uint64_t{0}) {
        return {StatusCode::device_lost, "programmed twice without an erase"};
    }
    one.value = value;
    one.is_damaged = fails_now();
    return one.is_damaged ? kNoPower : Status{};
}

Status SimulatedStorage::do_read(std::size_t slot, std::size_t offset, std::span<std::uint8_t> to) {
    if (!is_valid_range(slot, offset, to.size())) {
        return kInvalidAddress;
    }
    for (std::size_t at = 0; at < to.size(); at += kWordBytes) {
        const Word& one = word(slot, offset + at);
        if (one.is_damaged) {
            return {StatusCode::degenerate, "a double-word is damaged"};
        }
        std::memcpy(to.data() + at, &one.value, kWordBytes);
    }
    return {};
}

}  // namespace tricoil::sim
