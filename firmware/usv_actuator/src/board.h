// What the board decides: which pulses the pins get, and what it says of itself. No Arduino headers.
//
// Neutral from the first frame on. 500 ms (checked level; 200 to 2000 by word) or 1000 ms (level 0) without a command:
// all neutral. After a reset, a silence or an emergency stop on the checked level thrust is refused until both thrusters were
// commanded to stop once (interlock). The emergency-stop input must be steady for 10 ms.
#pragma once
#include <stdint.h>

#include "decoder.h"

namespace usv {

constexpr uint16_t kStopUs = 1500;
constexpr uint16_t kStopBandUs = 25;
constexpr uint16_t kDefaultSilenceMs = 500;
#ifndef USV_LEVEL0_SILENCE_MS
#define USV_LEVEL0_SILENCE_MS 1000  // up to 5000 for a host that, like the seed's, speaks once per second
#endif
static_assert(USV_LEVEL0_SILENCE_MS >= 200 && USV_LEVEL0_SILENCE_MS <= 5000, "level-0 silence limit: 200 to 5000 ms");
constexpr uint16_t kStatusMs = 100;
constexpr uint8_t kEstopFilterMs = 10;
constexpr uint8_t kTxBytes = 160;
constexpr const char *kVersion = "1.0";

class Board {
  public:
    // `cause`: why the last reset came: P power, X external, O brown-out, W watchdog, U unknown.
    void begin(char cause, const char *name, uint32_t now_ms);
    void receive(uint8_t byte, uint32_t now_ms);
    // `pins`: the pulses that the hardware makes at present, for the status line; `millivolts` 0 = not measured.
    void tick(uint32_t now_ms, bool stop_pressed, uint16_t millivolts, const uint16_t pins[kPins]);
    // The pulses that the hardware should make from the next frame on.
    void wanted(uint16_t pulses_us[kPins]) const;
    // Next byte to send, if any.
    bool next(uint8_t *byte);
    // Is thrust allowed (for the lamp)?
    bool active() const { return heard_ && !failsafe_ && !interlock_ && !estop_; }
    bool strict() const { return decoder_.strict; }
#ifdef USV_TEST_HANG
    uint8_t hang = 0;  // 1: endless loop, 2: the same with interrupts off
#endif

  private:
    void command(const Command &command, uint32_t now_ms);
    void word(const char *text, uint32_t now_ms);
    void lock();
    void all_stop();
    void read_estop(bool pressed, uint32_t now_ms);
    void check_silence(uint32_t now_ms);
    char state() const;
    void say_status(uint32_t now_ms, uint16_t millivolts, const uint16_t pins[kPins]);

    void put(char value);
    void put_text(const char *text);
    void put_number(uint32_t value);
    void put_field(uint32_t value);
    void finish_line();

    Decoder decoder_;
    const char *name_ = "";
    char cause_ = 'U';
    uint32_t good_ = 0;
    uint16_t target_[kPins] = {kStopUs, kStopUs, kStopUs, kStopUs};
    bool heard_ = false;
    bool failsafe_ = false;
    bool interlock_ = false;
    bool stop_seen_[2] = {false, false};
    bool estop_ = false;
    bool input_seen_ = false;
    uint32_t input_ms_ = 0;
    uint32_t heard_ms_ = 0;
    uint32_t status_ms_ = 0;
    uint16_t silence_ms_ = kDefaultSilenceMs;

    char tx_[kTxBytes];
    uint8_t tx_length_ = 0;
    uint8_t tx_sent_ = 0;
    uint8_t line_start_ = 0;
    bool line_overflow_ = false;
};

}  // namespace usv
