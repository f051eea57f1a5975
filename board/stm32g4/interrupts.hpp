// Interrupt handlers of a tracker board: used in tracker_vectors.cpp, defined in tracker_main.cpp.
#pragma once

extern "C" {
void nmi_handler();
void tick_handler();
void over_current_handler();
void block_end_handler();
void serial_handler();
void can_handler();
void usb_handler();
}
