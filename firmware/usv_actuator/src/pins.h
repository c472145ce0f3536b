// Which pin does what; the wiring guide (docs/WIRING.md) says the same.
#pragma once
#include <Arduino.h>

namespace usv {

constexpr uint8_t kThruster1Pin = 9;   // wire id m
constexpr uint8_t kThruster2Pin = 10;  // wire id M
constexpr uint8_t kRudder1Pin = 7;     // wire id l
constexpr uint8_t kRudder2Pin = 8;     // wire id L
constexpr uint8_t kStopPin = 4;        // normally closed switch to ground; open = stop. Not 2 or 3: the
                                       // simulator polls a low interrupt pin in every cycle
constexpr uint8_t kVoltagePin = A0;    // supply through a divider; tie to ground when there is none

#ifndef USV_DIVIDER_PERCENT
#define USV_DIVIDER_PERCENT 500  // supply / pin voltage, in percent: 500 = 40 kOhm over 10 kOhm
#endif
constexpr uint16_t kLeastMillivolts = 1000;  // less is no measurement

#ifdef USV_LED_BENCH
// Each thruster as a lamp: green ahead, red astern, brighter with more thrust; blue stopped.
#ifdef __AVR_ATmega2560__
constexpr uint8_t kLampGreen[2] = {5, 44};
constexpr uint8_t kLampRed[2] = {6, 45};
#else
constexpr uint8_t kLampGreen[2] = {5, 3};
constexpr uint8_t kLampRed[2] = {6, 11};
#endif
constexpr uint8_t kLampBlue[2] = {A1, A2};
#endif

}  // namespace usv
