// Handlers of a tracker board: tracker_vectors.cpp puts them into the vectors, tracker_main.cpp defines them.
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
