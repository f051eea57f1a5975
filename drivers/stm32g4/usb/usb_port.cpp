#include "drivers/stm32g4/usb/usb_port.hpp"

#include <algorithm>

#include "drivers/stm32g4/wait.hpp"

namespace tricoil::stm32g4 {
namespace {

using namespace usb;

// Offsets in the packet memory, after the buffer table.
constexpr std::uint16_t kControlSend = 0x040;
constexpr std::uint16_t kControlReceive = 0x080;
constexpr std::uint16_t kBulkSend = 0x0C0;
constexpr std::uint16_t kBulkReceive = 0x100;

constexpr std::size_t kControl = 0;  // endpoint registers
constexpr std::size_t kBulkPair = 1;

constexpr std::uint16_t kInterrupts = CNTR_CTRM | CNTR_RESETM | CNTR_SUSPM | CNTR_WKUPM | CNTR_PMAOVRM;
constexpr Microseconds kTransceiverStart{2};  // DS12288: 1 us
constexpr std::uint32_t kStartPolls = 10'000;

/// An answer that consists of full packets and is shorter than requested must end with an empty packet. No answer has such a
/// length.
constexpr bool ends_short(std::size_t bytes) { return bytes % kControlPacketBytes != 0; }
static_assert(ends_short(kDevice.size()) && ends_short(kConfiguration.size()) && ends_short(kBos.size()) &&
              ends_short(kMicrosoftSet.size()) && std::tuple_size_v<StringBuffer> < kControlPacketBytes);

constexpr EndpointState idle_state(Pipe pipe) {
    return pipe == Pipe::open ? EndpointState::nak : pipe == Pipe::halted ? EndpointState::stall : EndpointState::disabled;
}

}  // namespace

Status UsbPort::start() {
    registers_.CNTR = CNTR_FRES;  // power on, still in reset
    if (registers_.CNTR != CNTR_FRES) {
        reason("USB: the peripheral does not answer; is its clock on?");
        return {StatusCode::device_lost, "the USB peripheral does not answer"};
    }
    const DeviceTime ready = clock().now() + kTransceiverStart;
    if (!wait_until([&] { return clock().now() >= ready; }, kStartPolls, "the clock does not run").ok()) {
        reason("USB: the clock does not run");
        return {StatusCode::device_lost, "the clock does not run"};
    }
    crs_.CFGR = (crs_.CFGR & ~crs::CFGR_SYNCSRC) | crs::CFGR_SYNCSRC_usb;
    crs_.CR = crs_.CR | crs::CR_AUTOTRIMEN | crs::CR_CEN;
    control_.reset();
    is_suspended_ = false;
    update_link();
    registers_.CNTR = kInterrupts;
    registers_.ISTR = 0;
    registers_.BTABLE = 0;
    registers_.BCDR = BCDR_DPPU;
    return {};
}

void UsbPort::do_close() {
    registers_.BCDR = 0;
    registers_.CNTR = CNTR_FRES | CNTR_PDWN;
    is_up_.store(false, std::memory_order_relaxed);
}

void UsbPort::on_interrupt() {
    if ((registers_.CNTR & CNTR_CTRM) == 0) {
        return;  // closed
    }
    const std::uint16_t flags = registers_.ISTR;
    set_flags_served(flags & (ISTR_RESET | ISTR_SUSP | ISTR_WKUP | ISTR_PMAOVR));
    if ((flags & ISTR_PMAOVR) != 0) {
        interrupt_counts().note_fault();
    }
    if ((flags & ISTR_WKUP) != 0) {
        on_wakeup();
    }
    if ((flags & ISTR_RESET) != 0) {
        on_reset();
        return;
    }
    serve_control();
    serve_bulk();
    if ((flags & ISTR_SUSP) != 0 && (flags & ISTR_WKUP) == 0) {
        on_suspend();
    }
}

/// The hardware has already cleared the endpoint registers and the address.
void UsbPort::on_reset() {
    if (is_up()) {
        interrupt_counts().note_loss();
    }
    registers_.CNTR = kInterrupts;
    control_.reset();
    control_data_ = {};
    takes_address_ = is_suspended_ = false;
    apply(ControlEffect::unconfigure);
    memory_.entries[kControl].ADDR_TX = kControlSend;
    memory_.entries[kControl].COUNT_TX = 0;
    memory_.entries[kControl].ADDR_RX = kControlReceive;
    memory_.entries[kControl].COUNT_RX = COUNT_RX_64_bytes;
    memory_.entries[kBulkPair].ADDR_TX = kBulkSend;
    memory_.entries[kBulkPair].COUNT_TX = 0;
    memory_.entries[kBulkPair].ADDR_RX = kBulkReceive;
    memory_.entries[kBulkPair].COUNT_RX = COUNT_RX_64_bytes;
    registers_.EP[kControl].R = EndpointChange(registers_.EP[kControl].R)
                                    .kind(EP_TYPE_control, 0)
                                    .receive(EndpointState::valid)
                                    .send(EndpointState::nak)
                                    .word();
    registers_.DADDR = DADDR_EF;
    serve_bulk();
}

void UsbPort::on_suspend() {
    registers_.CNTR = kInterrupts | CNTR_FSUSP;
    is_suspended_ = true;
    if (is_up()) {
        interrupt_counts().note_loss();
    }
    update_link();
}

void UsbPort::on_wakeup() {
    registers_.CNTR = kInterrupts;
    is_suspended_ = false;
    update_link();
}

void UsbPort::update_link() { is_up_.store(control_.is_configured() && !is_suspended_, std::memory_order_relaxed); }

void UsbPort::serve_control() {
    const std::uint16_t now = registers_.EP[kControl].R;
    if ((now & (EP_CTR_RX | EP_CTR_TX)) == 0) {
        return;
    }
    EndpointChange change(now);
    if ((now & EP_CTR_TX) != 0) {
        change.take_sent();
        if (takes_address_) {
            registers_.DADDR = static_cast<std::uint16_t>(DADDR_EF | control_.address());
            takes_address_ = false;
        }
    }
    if ((now & EP_CTR_RX) == 0) {
        if (!control_data_.empty()) {
            send_control(change);
        }
    } else {
        change.take_received();
        if ((now & EP_SETUP) != 0) {
            on_setup(change);
        } else {
            control_data_ = {};  // status stage: the host needs no more data
            change.receive(EndpointState::valid);
        }
    }
    registers_.EP[kControl].R = change.word();
}

void UsbPort::on_setup(EndpointChange& change) {
    std::array<std::uint8_t, kSetupBytes> bytes{};
    for (std::size_t i = 0; i < bytes.size(); i += 2) {
        const std::uint16_t two = memory_.half_words[(kControlReceive + i) / 2];
        bytes[i] = low(two);
        bytes[i + 1] = high(two);
    }
    const SetupPacket setup = setup_packet(bytes);
    const ControlAnswer answer = control_.on_setup(setup);
    if (!answer.accepted) {
        control_data_ = {};
        takes_address_ = false;
        change.receive(EndpointState::stall).send(EndpointState::stall);
        return;
    }
    takes_address_ = answer.effect == ControlEffect::set_address;
    if (answer.effect != ControlEffect::none && !takes_address_) {
        apply(answer.effect);
    }
    control_data_ = answer.data;
    send_control(change);
    change.receive(EndpointState::valid);
}

/// Sends one packet of the answer. If no data is left, the packet is empty; this also acknowledges a request without data.
void UsbPort::send_control(EndpointChange& change) {
    const std::size_t count = std::min<std::size_t>(control_data_.size(), kControlPacketBytes);
    write_packet(kControlSend, control_data_.first(count));
    memory_.entries[kControl].COUNT_TX = static_cast<std::uint16_t>(count);
    control_data_ = control_data_.subspan(count);
    change.send(EndpointState::valid);
}

/// Changes the state of the bulk endpoints. serve_bulk() writes the new state to the endpoint register.
void UsbPort::apply(ControlEffect effect) {
    switch (effect) {
        case ControlEffect::configure:
        case ControlEffect::unconfigure: {
            const Pipe pipe = effect == ControlEffect::configure ? Pipe::open : Pipe::off;
            out_ = in_ = {pipe, true};
            outgoing().clear();
            in_flight_ = 0;
            (void)incoming().push(0);  // ends a partial frame
            update_link();
            break;
        }
        case ControlEffect::halt_in:
            in_ = {Pipe::halted, true};
            break;
        case ControlEffect::halt_out:
            out_ = {Pipe::halted, true};
            break;
        case ControlEffect::resume_in:
            in_ = {Pipe::open, true};
            break;
        case ControlEffect::resume_out:
            out_ = {Pipe::open, true};
            break;
        case ControlEffect::set_address:
        case ControlEffect::none:
            break;
    }
}

void UsbPort::serve_bulk() {
    const std::uint16_t now = registers_.EP[kBulkPair].R;
    const std::uint16_t unchanged = EndpointChange(now).word();
    EndpointChange change(now);
    if (in_.is_new || out_.is_new) {
        change.kind(EP_TYPE_bulk, kEndpointOut);
    }
    serve_out(now, change);
    serve_in(now, change);
    if (change.word() != unchanged) {
        registers_.EP[kBulkPair].R = change.word();
    }
}

void UsbPort::serve_out(std::uint16_t now, EndpointChange& change) {
    bool is_ready = waits_for_room();
    if ((now & EP_CTR_RX) != 0) {
        change.take_received();
        take_packet();
        is_ready = true;
    }
    if (out_.is_new) {
        out_.is_new = false;
        change.restart_receiving().receive(idle_state(out_.pipe));
        is_ready = true;
    }
    const bool takes = is_ready && out_.pipe == Pipe::open && incoming().room() >= kBulkPacketBytes;
    if (takes) {
        change.receive(EndpointState::valid);
    }
    waits_for_room_.store(is_ready && !takes && out_.pipe == Pipe::open, std::memory_order_relaxed);
}

/// A packet stays in the queue until the host has received it; after a halt it is sent again.
void UsbPort::serve_in(std::uint16_t now, EndpointChange& change) {
    if ((now & EP_CTR_TX) != 0) {
        change.take_sent();
        outgoing().pop(in_flight_);
        in_flight_ = 0;
        is_sending_ = false;
    }
    if (in_.is_new) {
        in_.is_new = false;
        change.restart_sending().send(idle_state(in_.pipe));
        is_sending_ = sent_full_packet_ = false;
    }
    if (in_.pipe == Pipe::open && !is_sending_ && write_next_packet()) {
        change.send(EndpointState::valid);
        is_sending_ = true;
    }
}

void UsbPort::take_packet() {
    const std::size_t count = std::min<std::size_t>(memory_.entries[kBulkPair].COUNT_RX & COUNT_RX_COUNT, kBulkPacketBytes);
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint16_t two = memory_.half_words[(kBulkReceive + i) / 2];
        if (!incoming().push(i % 2 == 0 ? low(two) : high(two))) {
            interrupt_counts().note_dropped();
        }
    }
}

/// False if there is nothing to send. After a full last packet an empty packet ends the transfer for hosts with larger reads.
bool UsbPort::write_next_packet() {
    const auto waiting = outgoing().front();
    in_flight_ = std::min<std::size_t>(waiting.size(), kBulkPacketBytes);
    if (in_flight_ == 0 && !sent_full_packet_) {
        return false;
    }
    sent_full_packet_ = in_flight_ == kBulkPacketBytes;
    write_packet(kBulkSend, waiting.first(in_flight_));
    memory_.entries[kBulkPair].COUNT_TX = static_cast<std::uint16_t>(in_flight_);
    return true;
}

void UsbPort::write_packet(std::size_t address, std::span<const std::uint8_t> bytes) {
    for (std::size_t i = 0; i < bytes.size(); i += 2) {
        const unsigned second = i + 1 < bytes.size() ? bytes[i + 1] : 0U;
        memory_.half_words[(address + i) / 2] = static_cast<std::uint16_t>(bytes[i] | second << 8U);
    }
}

}  // namespace tricoil::stm32g4
