// Servo pulses on four pins from Timer1, and the last word of the hardware watchdog.
#pragma once
#include <stdint.h>

namespace usv {

// Start with 1500 us on all pins. The pins take turns, 2.5 ms each, at the start of the 20 ms frame; new widths take effect together.
void pulses_begin();
// Widths for the next frame, us; safe against the interrupt.
void pulses_set(const uint16_t pulses_us[4]);
// Widths of the present frame.
void pulses_get(uint16_t pulses_us[4]);

// Arm the watchdog: after 125 ms without pulses_watchdog_kick() the pulses go to 1500 us, after 250 ms the chip restarts.
void watchdog_begin();
void watchdog_kick();
// Why the chip restarted: P power, X external, O brown-out, W watchdog, U unknown (a boot loader hid it).
char reset_cause();

}  // namespace usv
