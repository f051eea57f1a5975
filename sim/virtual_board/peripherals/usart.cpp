#include "sim/virtual_board/peripherals/usart.hpp"

#include <array>
#include <bit>

namespace tricoil::virtual_board {
namespace usart {

constexpr std::uint32_t kCr1 = 0x00;
constexpr std::uint32_t kCr2 = 0x04;
constexpr std::uint32_t kCr3 = 0x08;
constexpr std::uint32_t kBrr = 0x0C;
constexpr std::uint32_t kRqr = 0x18;
constexpr std::uint32_t kIsr = 0x1C;
constexpr std::uint32_t kIcr = 0x20;
constexpr std::uint32_t kRdr = 0x24;
constexpr std::uint32_t kTdr = 0x28;
constexpr std::uint32_t kPresc = 0x2C;

// Bits of CR1.
constexpr unsigned kEnable = 0;
constexpr unsigned kStopEnable = 1;  // UESM
constexpr unsigned kReceive = 2;
constexpr unsigned kTransmit = 3;
constexpr unsigned kOddParity = 9;
constexpr unsigned kParity = 10;
constexpr unsigned kWordM0 = 12;
constexpr unsigned kOver8 = 15;
constexpr unsigned kWordM1 = 28;
constexpr unsigned kFifoOn = 29;
// Bits of CR3.
constexpr unsigned kErrorInterrupt = 0;
constexpr unsigned kDmaReceive = 6;
constexpr unsigned kDmaTransmit = 7;
constexpr unsigned kNoOverrun = 12;
constexpr unsigned kWakeUpInterrupt = 22;
constexpr unsigned kSendThresholdInterrupt = 23;
constexpr unsigned kReceiveThresholdInterrupt = 28;
// Flags of ISR; several have the position of their interrupt enable in CR1.
constexpr unsigned kFramingError = 1;
constexpr unsigned kOverrun = 3;
constexpr unsigned kIdle = 4;
constexpr unsigned kNotEmpty = 5;
constexpr unsigned kComplete = 6;
constexpr unsigned kNotFull = 7;
constexpr unsigned kBusy = 16;
constexpr unsigned kWakeUp = 20;
constexpr unsigned kSendEnabled = 21;
constexpr unsigned kReceiveEnabled = 22;
constexpr unsigned kFifoEmpty = 23;  // interrupt enable: CR1 bit 30
constexpr unsigned kFifoFull = 24;   // CR1 bit 31
constexpr unsigned kReceiveThreshold = 26;
constexpr unsigned kSendThreshold = 27;

constexpr std::array<unsigned, 8> kThresholds{1, 2, 4, 6, 7, 8, 8, 8};  // bytes of the FIFO; RXFTCFG, TXFTCFG
constexpr std::array<unsigned, 16> kPrescalers{1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256, 256, 256, 256, 256};

}  // namespace usart

namespace {

std::vector<Register> usart_registers() {
    return {{usart::kCr1, 0, "CR1", 0xF00097FF, "WAKE@11 MME@13 CMIE@14 DEDT@16-20 DEAT@21-25 RTOIE@26 EOBIE@27"},
            {usart::kCr2, 0, "CR2", 0x3700,
             "SLVEN@0 DIS_NSS@3 ADDM7@4 LBDL@5 LBDIE@6 CLKEN@11 LINEN@14 SWAP@15 RXINV@16 TXINV@17 "
             "DATAINV@18 MSBFIRST@19 ABREN@20 ABRMOD@21-22 RTOEN@23 ADD@24-31"},
            {usart::kCr3, 0, "CR3", 0xFEF01FC1,
             "IREN@1 IRLP@2 HDSEL@3 NACK@4 SCEN@5 DDRE@13 DEM@14 DEP@15 SCARCNT@17-19 "
             "TCBGTIE@24"},
            {usart::kBrr, 0, "BRR", 0xFFFFF},
            {0x10, 0, "GTPR", 0, "PSC@0-7 GT@8-15"},
            {0x14, 0, "RTOR", 0, "RTO@0-23 BLEN@24-31"},
            {usart::kRqr, 0, "RQR", 0x18, "ABRRQ@0 SBKRQ@1 MMRQ@2"},
            {usart::kIsr, 0, "ISR", kAllBits},
            {usart::kIcr, 0, "ICR", kAllBits},
            {usart::kRdr, 0, "RDR", kAllBits},
            {usart::kTdr, 0, "TDR", 0x1FF},
            {usart::kPresc, 0, "PRESC", 0xF}};
}

}  // namespace

Usart::Usart(Machine& machine, Dma& dma, UsartParams params)
    : RegisterPeripheral(usart_registers()),
      machine_(machine),
      dma_(dma),
      params_(std::move(params)),
      sent_(machine.events, [this] { sent(); }),
      idle_(machine.events, [this] {
          raised_ |= 1U << usart::kIdle;
          show_interrupt();
      }) {
    dma_.on_enable(params_.receive_request, [this] { serve_dma(); });
    dma_.on_enable(params_.send_request, [this] { serve_dma(); });
}

Ticks Usart::bit_time() const {
    const Ticks cycle = params_.clock() * Ticks{usart::kPrescalers[registers_[usart::kPresc] & 0xFU]};
    const std::uint32_t brr = registers_[usart::kBrr];
    if (params_.low_power) {
        return cycle * Ticks{brr} / 256;
    }
    if (is_set(registers_[usart::kCr1], usart::kOver8)) {
        return cycle * Ticks{(brr & 0xFFF0U) | (brr & 7U) << 1U} / 2;
    }
    return cycle * Ticks{brr};
}

/// Data bits of a frame, without parity.
unsigned Usart::data_bits() const {
    const std::uint32_t cr1 = registers_[usart::kCr1];
    const unsigned bits = is_set(cr1, usart::kWordM1) ? 7 : is_set(cr1, usart::kWordM0) ? 9 : 8;
    return bits - (is_set(cr1, usart::kParity) ? 1 : 0);
}

double Usart::stop_bits() const {
    constexpr std::array<double, 4> kStops{1, 0.5, 2, 1.5};
    return kStops[field(registers_[usart::kCr2], 12, 2)];
}

Ticks Usart::byte_time() const {
    const double bits = 1 + data_bits() + (is_set(registers_[usart::kCr1], usart::kParity) ? 1 : 0) + stop_bits();
    return static_cast<Ticks>(bits * static_cast<double>(bit_time()));
}

double Usart::baud() const { return static_cast<double>(kTicksPerSecond) / static_cast<double>(bit_time()); }

bool Usart::listens() const {
    return is_set(registers_[usart::kCr1], usart::kEnable) && is_set(registers_[usart::kCr1], usart::kReceive) &&
           (!machine_.events.is_frozen() || is_set(registers_[usart::kCr1], usart::kStopEnable));
}

std::size_t Usart::room() const { return is_set(registers_[usart::kCr1], usart::kFifoOn) ? kFifo : 1; }

/// The other end sends with the same parity; the parity bit is above the data bits in RDR.
void Usart::receive(std::uint8_t byte, bool framing_error) {
    if (!listens()) {
        return;
    }
    std::uint32_t word = byte & ((1U << data_bits()) - 1U);
    if (is_set(registers_[usart::kCr1], usart::kParity)) {
        const bool odd = std::popcount(word) % 2 == 1;
        word |= flag(odd != is_set(registers_[usart::kCr1], usart::kOddParity), data_bits());
    }
    if (incoming_.size() >= room() && !is_set(registers_[usart::kCr3], usart::kNoOverrun)) {
        raised_ |= 1U << usart::kOverrun;
    } else {
        if (incoming_.size() >= room()) {
            incoming_.pop_back();
        }
        incoming_.push_back({word, framing_error});
        raised_ |= flag(framing_error && incoming_.size() == 1, usart::kFramingError);
    }
    if (machine_.events.is_frozen()) {
        wake_up();
    }
    idle_.in(byte_time() + bit_time() / 2);  // the next byte of an unbroken stream comes before
    serve_dma();
    show_interrupt();
}

/// A byte in Stop mode: WUF, if CR3.WUS selects the start bit or the received byte.
void Usart::wake_up() {
    fail_if(!is_set(registers_[usart::kCr3], 21), "wake-up by an address (CR3.WUS = 0) is not in this model");
    raised_ |= 1U << usart::kWakeUp;
}

void Usart::send() {
    if (!outgoing_.empty() && !sent_.is_due() && is_set(registers_[usart::kCr1], usart::kTransmit)) {
        params_.check_pins();
        sent_.in(byte_time());
    }
}

void Usart::sent() {
    const std::uint8_t byte = outgoing_.front();
    outgoing_.pop_front();
    on_sent(byte);
    send();
    serve_dma();
    raised_ |= flag(outgoing_.empty(), usart::kComplete);
    show_interrupt();
}

/// Requests last as long as there is a byte to read, or room for one.
void Usart::serve_dma() {
    const std::uint32_t cr3 = registers_[usart::kCr3];
    if (serving_dma_ || !is_set(registers_[usart::kCr1], usart::kEnable)) {
        return;
    }
    serving_dma_ = true;
    for (std::size_t before = incoming_.size(); is_set(cr3, usart::kDmaReceive) && before > 0; before = incoming_.size()) {
        if (!dma_.request(params_.receive_request) || incoming_.size() == before) {
            break;
        }
    }
    while (is_set(cr3, usart::kDmaTransmit) && is_set(registers_[usart::kCr1], usart::kTransmit) && queued() < room()) {
        const std::size_t before = outgoing_.size();
        if (!dma_.request(params_.send_request) || outgoing_.size() == before) {
            break;
        }
    }
    serving_dma_ = false;
}

std::uint32_t Usart::flags() const {
    const std::uint32_t cr1 = registers_[usart::kCr1];
    const std::uint32_t cr3 = registers_[usart::kCr3];
    const bool fifo = is_set(cr1, usart::kFifoOn);
    const bool enabled = is_set(cr1, usart::kEnable);
    return raised_ | flag(!incoming_.empty(), usart::kNotEmpty) | flag(queued() < room(), usart::kNotFull) |
           flag(idle_.is_due(), usart::kBusy) | flag(enabled && is_set(cr1, usart::kTransmit), usart::kSendEnabled) |
           flag(enabled && is_set(cr1, usart::kReceive), usart::kReceiveEnabled) |
           flag(fifo && queued() == 0, usart::kFifoEmpty) | flag(fifo && incoming_.size() == kFifo, usart::kFifoFull) |
           flag(fifo && incoming_.size() >= usart::kThresholds[field(cr3, 25, 3)], usart::kReceiveThreshold) |
           flag(fifo && kFifo - queued() >= usart::kThresholds[field(cr3, 29, 3)], usart::kSendThreshold);
}

void Usart::show_interrupt() {
    constexpr std::uint32_t kSamePositions =
        1U << usart::kIdle | 1U << usart::kNotEmpty | 1U << usart::kComplete | 1U << usart::kNotFull;
    const std::uint32_t cr1 = registers_[usart::kCr1];
    const std::uint32_t cr3 = registers_[usart::kCr3];
    const std::uint32_t now = flags();
    const bool wanted =
        (now & cr1 & kSamePositions) != 0 || (is_set(now, usart::kWakeUp) && is_set(cr3, usart::kWakeUpInterrupt)) ||
        (is_set(now, usart::kFramingError) && is_set(cr3, usart::kErrorInterrupt)) ||
        (is_set(now, usart::kOverrun) && (is_set(cr1, usart::kNotEmpty) || is_set(cr3, usart::kErrorInterrupt))) ||
        (is_set(now, usart::kFifoEmpty) && is_set(cr1, 30)) || (is_set(now, usart::kFifoFull) && is_set(cr1, 31)) ||
        (is_set(now, usart::kReceiveThreshold) && is_set(cr3, usart::kReceiveThresholdInterrupt)) ||
        (is_set(now, usart::kSendThreshold) && is_set(cr3, usart::kSendThresholdInterrupt));
    machine_.nvic.set_level(params_.interrupt, is_set(cr1, usart::kEnable) && wanted);
}

std::uint32_t Usart::take() {
    std::uint32_t word = 0;
    if (!incoming_.empty()) {
        word = incoming_.front().word;
        incoming_.pop_front();
        raised_ |= flag(!incoming_.empty() && incoming_.front().framing_error, usart::kFramingError);
    }
    show_interrupt();
    return word;
}

std::uint32_t Usart::read(std::uint32_t offset) {
    return offset == usart::kIsr ? flags() : offset == usart::kRdr ? take() : registers_.at(offset);
}

void Usart::put(std::uint32_t value) {
    fail_if(queued() >= room() || !is_set(registers_[usart::kCr1], usart::kEnable),
            "TDR is written while it is full or the USART is off");
    outgoing_.push_back(static_cast<std::uint8_t>(value & ((1U << data_bits()) - 1U)));
    raised_ &= ~(1U << usart::kComplete);
    send();
}

void Usart::control(std::uint32_t value) {
    constexpr std::uint32_t kFixed = 1U << usart::kFifoOn | 1U << usart::kWordM0 | 1U << usart::kWordM1 | 1U << usart::kOver8 |
                                     1U << usart::kParity | 1U << usart::kOddParity;
    const std::uint32_t before = registers_[usart::kCr1];
    fail_if(is_set(before, usart::kEnable) && is_set(value, usart::kEnable) && ((before ^ value) & kFixed) != 0,
            "CR1: FIFOEN, M, OVER8, PCE or PS changes while the USART is on");
    fail_if(params_.low_power && is_set(value, usart::kOver8), "CR1: an LPUART has no OVER8");
    fail_if(is_set(value, usart::kEnable) && registers_[usart::kBrr] < (params_.low_power ? 0x300U : 16U),
            "the USART is enabled without a valid baud rate");
    fail_if(is_set(value, usart::kEnable) && params_.clock() == 0, "the USART is enabled without a kernel clock (RCC CCIPR)");
    registers_.at(usart::kCr1) = value;
    if (!is_set(value, usart::kEnable)) {
        outgoing_.clear();
        incoming_.clear();
        sent_.cancel();
        idle_.cancel();
        raised_ |= 1U << usart::kComplete;
    }
    send();
}

void Usart::apply(std::uint32_t offset, std::uint32_t value) {
    const bool set_up = offset == usart::kCr2 || offset == usart::kBrr || offset == usart::kPresc;
    fail_if(set_up && value != registers_.at(offset) && is_set(registers_[usart::kCr1], usart::kEnable),
            "CR2, BRR or PRESC is written while the USART is on");
    switch (offset) {
        case usart::kTdr:
            put(value);
            break;
        case usart::kIcr:
            raised_ &= ~value;
            break;
        case usart::kCr1:
            control(value);
            break;
        case usart::kRqr:
            if (is_set(value, 3)) {
                incoming_.clear();
            }
            if (is_set(value, 4)) {
                outgoing_.resize(sent_.is_due() ? 1 : 0);
            }
            break;
        default:
            registers_.at(offset) = value;
    }
    serve_dma();
    show_interrupt();
}

/// DMA and drivers write bytes to the data register.
void Usart::write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) {
    if (offset != usart::kTdr) {
        Peripheral::write_narrow(offset, value, bytes);
    }
    write(offset, value);
}

void Usart::reset() {
    registers_.reset();
    raised_ = 0;
    control(0);
    show_interrupt();
}

}  // namespace tricoil::virtual_board
