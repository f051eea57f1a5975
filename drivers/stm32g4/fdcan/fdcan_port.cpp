#include "drivers/stm32g4/fdcan/fdcan_port.hpp"

#include "drivers/stm32g4/fdcan/bit_timing.hpp"
#include "drivers/stm32g4/interrupts_off.hpp"
#include "drivers/stm32g4/wait.hpp"

namespace tricoil::stm32g4 {
namespace {

using namespace fdcan;
using protocol::CanFrame;

constexpr std::uint32_t kModePolls = 100'000;  // a mode change takes effect between two bits on the bus
constexpr std::int64_t kBusOffPauseUs = 100'000;
constexpr std::uint32_t kInterrupts = IR_RF0N | IR_RF0L | IR_TC | IR_EP | IR_BO;
constexpr std::uint32_t kRunning = CCCR_FDOE | CCCR_BRSE;
constexpr std::uint32_t kAllBuffers = 7;

constexpr std::uint32_t nominal_register(const BitTiming& t) {
    return (t.jump - 1) << NBTP_NSJW_Pos | (t.prescaler - 1) << NBTP_NBRP_Pos | (t.segment_1 - 1) << NBTP_NTSEG1_Pos |
           (t.segment_2 - 1) << NBTP_NTSEG2_Pos;
}

constexpr std::uint32_t data_register(const BitTiming& t) {
    return DBTP_TDC | (t.prescaler - 1) << DBTP_DBRP_Pos | (t.segment_1 - 1) << DBTP_DTSEG1_Pos |
           (t.segment_2 - 1) << DBTP_DTSEG2_Pos | (t.jump - 1) << DBTP_DSJW_Pos;
}

/// Transmitter delay compensation offset: the sample point, in clock cycles.
constexpr std::uint32_t delay_register(const BitTiming& t) { return (1 + t.segment_1) * t.prescaler << TDCR_TDCO_Pos; }

constexpr std::array<std::uint8_t, 16> kLengths{0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};

constexpr std::uint32_t length_code(std::uint8_t length) {
    std::uint32_t code = 0;
    while (code < kLengths.size() - 1 && kLengths[code] < length) {
        ++code;
    }
    return code;
}

}  // namespace

Status FdcanPort::lost(const char* reason) {
    reason_ = reason;
    return {StatusCode::device_lost, reason};
}

Status FdcanPort::do_open() {
    reason_ = "";
    is_bus_off_ = false;
    exchange_.reset();
    incoming_.clear();
    outgoing_.clear();
    if (bit_timing(params_.kernel_clock_hz, params_.bit_rate, kNominalLimits).prescaler == 0 ||
        bit_timing(params_.kernel_clock_hz, params_.data_bit_rate, kDataLimits).prescaler == 0) {
        return lost("CAN: a bit is not a whole number of time quanta; choose another clock or bit rate");
    }
    registers_.CCCR = CCCR_INIT;  // also leaves sleep mode
    const auto stopped = [this] { return (registers_.CCCR & (CCCR_INIT | CCCR_CSA)) == CCCR_INIT; };
    if (!wait_until(stopped, kModePolls, "CAN controller does not answer").ok()) {
        return lost("CAN: the controller does not answer; is its clock on?");
    }
    configure();
    registers_.CCCR = kRunning;
    const auto started = [this] { return (registers_.CCCR & CCCR_INIT) == 0; };
    if (!wait_until(started, kModePolls, "CAN controller does not start").ok()) {
        return lost("CAN: the controller does not start; is its clock on?");
    }
    return {};
}

void FdcanPort::configure() {
    const BitTiming nominal = bit_timing(params_.kernel_clock_hz, params_.bit_rate, kNominalLimits);
    const BitTiming data = bit_timing(params_.kernel_clock_hz, params_.data_bit_rate, kDataLimits);
    registers_.CCCR = CCCR_INIT | CCCR_CCE;
    registers_.CCCR = CCCR_INIT | CCCR_CCE | kRunning;
    registers_.NBTP = nominal_register(nominal);
    registers_.DBTP = data_register(data);
    registers_.TDCR = delay_register(data);
    registers_.TXBC = 0;  // FIFO mode: frames are sent in order
    registers_.RXGFC = RXGFC_RRFE | RXGFC_RRFS | RXGFC_ANFE_reject | RXGFC_ANFS_reject | 1U << RXGFC_LSS_Pos;
    write_filter();
    registers_.TXBTIE = kAllBuffers;
    registers_.ILS = 0;
    registers_.IR = 0xFFFF'FFFF;
    registers_.IE = kInterrupts;
    registers_.ILE = ILE_EINT0;
}

/// Accepts only commands and segments of this node. The RAM is not cleared at reset.
void FdcanPort::write_filter() {
    for (volatile std::uint32_t& word : ram_.standard_filters) {
        word = 0;
    }
    for (volatile std::uint32_t& word : ram_.extended_filters) {
        word = 0;
    }
    const std::uint32_t commands = protocol::can_id(protocol::MessageType::command, params_.node);
    ram_.standard_filters[0] = SFT_dual | SFEC_fifo_0 | commands << SFID1_Pos | exchange_.incoming_segments();
}

void FdcanPort::do_close() {
    registers_.IE = 0;
    registers_.CCCR = CCCR_INIT;
}

Status FdcanPort::do_send(std::span<const std::uint8_t> message) {
    supervise();
    CanFrame frame;
    bool taken = false;
    if (protocol::to_frame(message, params_.node, frame)) {
        taken = queue(frame);
    } else if (message.size() < protocol::kPrefixBytes || message.size() > kBoardMessageBytes) {
        return {StatusCode::invalid_argument, "message is too short or too long"};
    } else {
        taken = !is_bus_off_ && exchange_.begin(message, to_us(clock_.now()));
        send_segments();
    }
    counts().send_queue_full += taken ? 0U : 1U;
    return taken ? Status{} : Status{StatusCode::not_ready, "the send queue is full, or the controller is bus-off"};
}

bool FdcanPort::queue(const CanFrame& frame) {
    if (is_bus_off_ || !outgoing_.push(frame)) {
        return false;
    }
    interrupt_.pend();
    return true;
}

void FdcanPort::send_segments() { damaged().count(exchange_.send_due(to_us(clock_.now()), Sender{*this})); }

/// The controller stops at bus-off. After a pause it may start again; it is back on the bus after 129 times 11 recessive bits.
/// No frame from before bus-off is sent after it: configuration access empties the controller's buffers.
void FdcanPort::supervise() {
    interrupt_counts_.copy_to(counts());
    const bool stopped = (registers_.CCCR & CCCR_INIT) != 0;
    const std::int64_t now_us = to_us(clock_.now());
    if (stopped && !is_bus_off_) {
        is_bus_off_ = true;
        bus_off_us_ = now_us;
        ++bus_offs_;
        exchange_.reset();
        {
            const InterruptsOff guard;
            outgoing_.clear();
        }
        reason_ = "CAN: bus-off; check the wiring and the bit rates";
    } else if (stopped && now_us - bus_off_us_ >= kBusOffPauseUs) {
        registers_.CCCR = CCCR_INIT | CCCR_CCE | kRunning;
        registers_.CCCR = kRunning;
    } else if (!stopped && is_bus_off_) {
        is_bus_off_ = false;
        reason_ = "";
    }
    counts().link_faults += bus_offs_;
}

Status FdcanPort::do_receive(hal::ReceivedMessage& message) {
    supervise();
    send_segments();
    for (std::size_t waiting = incoming_.size(); waiting > 0 && incoming_.pop(frame_); --waiting) {
        const std::int64_t now_us = to_us(clock_.now());
        const protocol::CanArrival arrival = exchange_.take(frame_.can, frame_.is_fd, now_us, message.bytes, Sender{*this});
        damaged().count(arrival.error);
        if (arrival.complete) {
            message.arrival = host_time_us(now_us);
            message.hardware_time_us = 0;
            return {};
        }
    }
    return {StatusCode::not_ready, "no message"};
}

Status FdcanPort::do_wait(Microseconds timeout) {
    const DeviceTime end = clock_.now() + timeout;
    do {
        if (incoming_.size() > 0) {
            return {};
        }
        send_segments();
    } while (clock_.now() < end);
    return {StatusCode::timed_out, "no message"};
}

void FdcanPort::on_interrupt() {
    const std::uint32_t flags = registers_.IR & kInterrupts;
    registers_.IR = flags;
    if ((flags & IR_RF0L) != 0) {
        interrupt_counts_.note_dropped();
    }
    if ((flags & IR_EP) != 0) {
        interrupt_counts_.note_fault();
    }
    take_frame();
    send_frame();
}

void FdcanPort::take_frame() {
    const std::uint32_t state = registers_.RXF0S;
    const std::uint32_t fill = state & RXF0S_F0FL_Msk;
    if (fill == 0) {
        return;
    }
    const std::uint32_t index = (state >> RXF0S_F0GI_Pos & 3U) % 3U;
    const FdcanElement& element = ram_.rx_fifo_0[index];
    const std::uint32_t head = element.R0;
    const std::uint32_t format = element.R1;
    Frame frame;
    frame.is_fd = (format & R1_FDF) != 0;
    frame.can.id = head >> R0_standard_id_Pos & 0x7FFU;
    frame.can.length = kLengths[format >> R1_DLC_Pos & 0xFU];
    if (!frame.is_fd) {
        frame.can.length = std::min<std::uint8_t>(frame.can.length, 8);
    }
    for (std::size_t i = 0; i < frame.can.length; ++i) {
        frame.can.data[i] = static_cast<std::uint8_t>(element.data[i / 4] >> (8 * (i % 4)));
    }
    registers_.RXF0A = index;
    if ((head & (R0_XTD | R0_RTR)) == 0 && !incoming_.push(frame)) {
        interrupt_counts_.note_dropped();
    }
    if (fill > 1) {
        interrupt_.pend();  // for the next frame, because the interrupt flag is already cleared
    }
}

void FdcanPort::send_frame() {
    const std::uint32_t state = registers_.TXFQS;
    CanFrame frame;
    if ((state & TXFQS_TFQF) != 0 || !outgoing_.pop(frame)) {
        return;
    }
    const std::uint32_t index = (state >> TXFQS_TFQPI_Pos & 3U) % 3U;
    FdcanElement& element = ram_.tx_buffers[index];
    element.R0 = frame.id << R0_standard_id_Pos;
    element.R1 = length_code(frame.length) << R1_DLC_Pos | R1_FDF | R1_BRS;
    for (std::size_t i = 0; i < frame.length; i += 4) {
        element.data[i / 4] = static_cast<std::uint32_t>(frame.data[i]) | static_cast<std::uint32_t>(frame.data[i + 1]) << 8U |
                              static_cast<std::uint32_t>(frame.data[i + 2]) << 16U |
                              static_cast<std::uint32_t>(frame.data[i + 3]) << 24U;
    }
    registers_.TXBAR = 1U << index;
    if (outgoing_.size() > 0) {
        interrupt_.pend();  // if no buffer was free, the end of a transmission raises the interrupt again
    }
}

}  // namespace tricoil::stm32g4
