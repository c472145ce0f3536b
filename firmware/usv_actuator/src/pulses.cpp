#include "pulses.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>
#include <util/atomic.h>

#include "pins.h"

namespace usv {

namespace {

constexpr uint8_t kCount = 4;
constexpr uint16_t kTicksPerUs = 2;  // 16 MHz / 8
constexpr uint16_t kSlotTicks = 2500 * kTicksPerUs;
constexpr uint16_t kFrameTicks = 20000 * kTicksPerUs;
constexpr uint16_t kStopTicks = 1500 * kTicksPerUs;

constexpr uint8_t kPinNumbers[kCount] = {kThruster1Pin, kThruster2Pin, kRudder1Pin, kRudder2Pin};

volatile uint8_t *g_port[kCount];
uint8_t g_bit[kCount];
volatile uint16_t g_next[kCount];
volatile uint16_t g_live[kCount];
uint8_t g_slot = kCount - 1;
bool g_high = false;

constexpr uint16_t kMark = 0xB0A7;
uint16_t g_mark __attribute__((section(".noinit")));     // survives a reset: the watchdog interrupt was here
uint8_t g_mcusr __attribute__((section(".noinit")));

}  // namespace

// Before main: save why we restarted, and switch off a watchdog that a reset leaves running with its shortest period.
void save_cause() __attribute__((naked, used, section(".init3")));
void save_cause() {
    g_mcusr = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

char reset_cause() {
    const bool marked = g_mark == kMark;
    g_mark = 0;
    if (g_mcusr & _BV(PORF)) return 'P';
    if (g_mcusr & _BV(BORF)) return 'O';
    if (marked || (g_mcusr & _BV(WDRF))) return 'W';
    return (g_mcusr & _BV(EXTRF)) ? 'X' : 'U';
}

void pulses_begin() {
    for (uint8_t i = 0; i < kCount; ++i) {
        g_port[i] = portOutputRegister(digitalPinToPort(kPinNumbers[i]));
        g_bit[i] = digitalPinToBitMask(kPinNumbers[i]);
        g_next[i] = g_live[i] = kStopTicks;
        digitalWrite(kPinNumbers[i], LOW);
        pinMode(kPinNumbers[i], OUTPUT);
    }
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        TCCR1A = 0;
        TCCR1B = _BV(CS11);  // free running, 0.5 us
        TCNT1 = 0;
        OCR1A = 2000;
        TIFR1 = _BV(OCF1A);
        TIMSK1 = _BV(OCIE1A);
    }
}

void pulses_set(const uint16_t pulses_us[4]) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        for (uint8_t i = 0; i < kCount; ++i) g_next[i] = uint16_t(pulses_us[i] * kTicksPerUs);
    }
}

void pulses_get(uint16_t pulses_us[4]) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        for (uint8_t i = 0; i < kCount; ++i) pulses_us[i] = g_live[i] / kTicksPerUs;
    }
}

void watchdog_begin() {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        wdt_reset();
        WDTCSR = _BV(WDCE) | _BV(WDE);
        WDTCSR = _BV(WDIE) | _BV(WDE) | _BV(WDP1) | _BV(WDP0);  // 125 ms to the interrupt, 125 more to the reset
    }
}

void watchdog_kick() {
    wdt_reset();
    if (!(WDTCSR & _BV(WDIE))) {  // the interrupt came, and yet we run: a slow turn, not a hang
        g_mark = 0;
        WDTCSR |= _BV(WDIE);
    }
}

// One edge per match. A pin is raised at the start of its slot and lowered after its width.
ISR(TIMER1_COMPA_vect) {
    if (g_high) {
        *g_port[g_slot] &= uint8_t(~g_bit[g_slot]);
        g_high = false;
        OCR1A += (g_slot == kCount - 1 ? kFrameTicks - (kCount - 1) * kSlotTicks : kSlotTicks) - g_live[g_slot];
        return;
    }
    const uint8_t slot = g_slot == kCount - 1 ? 0 : uint8_t(g_slot + 1);
    *g_port[slot] |= g_bit[slot];
    g_slot = slot;
    g_high = true;
    if (slot == 0) {
        for (uint8_t i = 0; i < kCount; ++i) g_live[i] = g_next[i];
    }
    OCR1A += g_live[slot];
}

ISR(WDT_vect) {
    for (uint8_t i = 0; i < kCount; ++i) g_next[i] = kStopTicks;
    g_mark = kMark;
}

}  // namespace usv
