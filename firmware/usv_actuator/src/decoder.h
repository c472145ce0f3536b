// Bytes from the companion into commands and words. No Arduino headers: the same file runs in the host tests.
//
// Until the first valid checked line both levels are understood: groups are staged and take effect together at a
// terminator, after 5 ms of silence, or when a fifth group begins (no checked line holds five). A '*' turns what is
// staged into a checked line, which counts whole or not at all. Once `strict` is set only checked lines are read.
#pragma once
#include <stdint.h>

namespace usv {

constexpr uint8_t kPins = 4;
constexpr uint16_t kLowUs = 1000;
constexpr uint16_t kHighUs = 2000;
constexpr uint8_t kLineBytes = 32;
constexpr uint8_t kWordChars = 6;
constexpr uint8_t kSilenceMs = 5;

// Pulses for the pins whose bit is set in `mask`, to be applied together.
struct Command {
    uint8_t mask = 0;
    bool checked = false;
    uint16_t pulse_us[kPins] = {0, 0, 0, 0};
};

enum class Found : uint8_t { kNothing, kCommand, kWord };

class Decoder {
  public:
    bool strict = false;
    uint32_t bad = 0;

    // Take one byte; what it completes is in command() or word() until the next call.
    Found byte(uint8_t value, uint32_t now_ms);
    // Call often: ends an unfinished level-0 command when the line has been quiet.
    Found silence(uint32_t now_ms);
    const Command &command() const { return command_; }
    const char *word() const { return word_; }

  private:
    Found strict_byte(uint8_t value);
    Found open_byte(uint8_t value);
    Found open_group(uint8_t value, bool in_word);
    Found open_rest(uint8_t value);
    Found finish_checked();
    Found parse_checked();
    bool parse_groups(uint8_t length);
    Found commit();
    void end_group();
    void append(uint8_t value);
    void restart();

    Command command_;
    char word_[kWordChars + 1] = {0};
    uint8_t line_[kLineBytes];
    uint8_t length_ = 0;
    bool overflow_ = false;
    bool star_ = false;
    Command staged_;
    uint8_t groups_ = 0;
    int8_t pin_ = -1;
    uint8_t digits_ = 0;
    uint16_t value_ = 0;
    bool fraction_ = false;
    uint32_t last_byte_ms_ = 0;
};

}  // namespace usv
