// Actuator board of the USV companion: two thrusters, two rudders, one serial line. Uno and Mega.
// Everything that decides is in src/board.cpp; this file joins it to the hardware.
#include <avr/sleep.h>

#include "src/board.h"
#include "src/pins.h"
#include "src/pulses.h"

#ifndef USV_BAUD
#define USV_BAUD 115200
#endif

#ifdef __AVR_ATmega2560__
static const char kBoardName[] = "MEGA";
#else
static const char kBoardName[] = "UNO";
#endif

static usv::Board board;
static uint16_t supply_mv = 0;
static uint32_t supply_ms = 0;

void setup() {
    usv::pulses_begin();
    pinMode(usv::kStopPin, INPUT_PULLUP);
    pinMode(LED_BUILTIN, OUTPUT);
#ifdef USV_LED_BENCH
    for (uint8_t i = 0; i < 2; ++i) pinMode(usv::kLampBlue[i], OUTPUT);
#endif
    Serial.begin(USV_BAUD);
    board.begin(usv::reset_cause(), kBoardName, millis());
    usv::watchdog_begin();
}

static uint16_t supply() {
    const uint32_t millivolts = analogRead(usv::kVoltagePin) * 5000UL / 1024UL * USV_DIVIDER_PERCENT / 100UL;
    return millivolts < usv::kLeastMillivolts || millivolts > 65535UL ? 0 : uint16_t(millivolts);
}

#ifdef USV_LED_BENCH
static void show(uint8_t lamp, uint16_t pulse_us) {
    const int16_t thrust = int16_t(pulse_us) - int16_t(usv::kStopUs);
    const int16_t level = (thrust < 0 ? -thrust : thrust) / 2;
    analogWrite(usv::kLampGreen[lamp], thrust > 0 ? level : 0);
    analogWrite(usv::kLampRed[lamp], thrust < 0 ? level : 0);
    digitalWrite(usv::kLampBlue[lamp], thrust == 0 ? HIGH : LOW);
}
#endif

#ifdef USV_TEST_HANG
static void hang(uint8_t kind) {
    if (kind == 2) noInterrupts();
    for (;;) {
    }
}
#endif

void loop() {
    usv::watchdog_kick();
    const uint32_t now_ms = millis();
    for (uint8_t budget = 32; budget && Serial.available(); --budget) board.receive(uint8_t(Serial.read()), now_ms);
    if (now_ms - supply_ms >= 100) {
        supply_ms = now_ms;
        supply_mv = supply();
    }
    uint16_t pulses_us[usv::kPins];
    usv::pulses_get(pulses_us);
    board.tick(now_ms, digitalRead(usv::kStopPin) == HIGH, supply_mv, pulses_us);
    board.wanted(pulses_us);
    usv::pulses_set(pulses_us);
#ifdef USV_LED_BENCH
    for (uint8_t i = 0; i < 2; ++i) show(i, pulses_us[i]);
#endif
    digitalWrite(LED_BUILTIN, board.active() || (now_ms & 512) ? HIGH : LOW);  // steady: thrust allowed
    uint8_t byte;
    while (Serial.availableForWrite() > 0 && board.next(&byte)) Serial.write(byte);
#ifdef USV_TEST_HANG
    if (board.hang) hang(board.hang);
#endif
    sleep_mode();  // idle until the next interrupt, at most a millisecond (Timer0)
}
