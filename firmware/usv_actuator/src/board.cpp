#include "board.h"

#include "crc8.h"

namespace usv {

namespace {

bool same(const char *text, const char *other) {
    for (; *text && *text == *other; ++text, ++other) {
    }
    return *text == *other;
}

bool near_stop(uint16_t pulse_us) { return pulse_us + kStopBandUs >= kStopUs && pulse_us <= kStopUs + kStopBandUs; }

// Four decimal digits, or 0.
uint16_t four_digits(const char *text) {
    uint16_t value = 0;
    for (uint8_t i = 0; i < 4; ++i) {
        if (text[i] < '0' || text[i] > '9') return 0;
        value = uint16_t(value * 10 + (text[i] - '0'));
    }
    return value;
}

}  // namespace

void Board::begin(char cause, const char *name, uint32_t now_ms) {
    cause_ = cause;
    name_ = name;
    status_ms_ = input_ms_ = now_ms;
    put('\n');  // ends a line that the reset cut
    line_start_ = tx_length_;
    put_text("#B,1,");
    put_text(kVersion);
    put(',');
    put_text(name_);
    put(',');
    put(cause_);
    finish_line();
}

void Board::receive(uint8_t byte, uint32_t now_ms) {
    switch (decoder_.byte(byte, now_ms)) {
        case Found::kCommand: command(decoder_.command(), now_ms); break;
        case Found::kWord: word(decoder_.word(), now_ms); break;
        case Found::kNothing: break;
    }
}

void Board::tick(uint32_t now_ms, bool stop_pressed, uint16_t millivolts, const uint16_t pins[kPins]) {
    if (decoder_.silence(now_ms) == Found::kCommand) command(decoder_.command(), now_ms);
    read_estop(stop_pressed, now_ms);
    check_silence(now_ms);
    if (now_ms - status_ms_ >= kStatusMs) {
        status_ms_ = now_ms - (now_ms - status_ms_) % kStatusMs;
        if (tx_length_ == 0) say_status(now_ms, millivolts, pins);
    }
}

void Board::wanted(uint16_t pulses_us[kPins]) const {
    for (uint8_t pin = 0; pin < kPins; ++pin) {
        const bool stopped = estop_ || (interlock_ && pin < 2);
        pulses_us[pin] = stopped ? kStopUs : target_[pin];
    }
}

void Board::command(const Command &command, uint32_t now_ms) {
    ++good_;
    heard_ = true;
    heard_ms_ = now_ms;
    failsafe_ = false;
    if (command.checked && !decoder_.strict) {
        decoder_.strict = true;
        lock();
    }
    for (uint8_t pin = 0; pin < kPins; ++pin) {
        if (!(command.mask & (1 << pin))) continue;
        target_[pin] = command.pulse_us[pin];
        if (pin < 2) stop_seen_[pin] = near_stop(command.pulse_us[pin]);
    }
    if (!estop_ && stop_seen_[0] && stop_seen_[1]) interlock_ = false;
}

void Board::word(const char *text, uint32_t now_ms) {
    if (same(text, "#VERS?")) {
        put_text("#V,1,");
        put_text(kVersion);
        put(',');
        put_text(name_);
        put_field(silence_ms_);
        finish_line();
    } else if (same(text, "#NEUTR")) {
        Command neutral;
        neutral.checked = true;
        neutral.mask = 0x0F;
        for (uint8_t pin = 0; pin < kPins; ++pin) neutral.pulse_us[pin] = kStopUs;
        command(neutral, now_ms);
    } else if (same(text, "#ZERO0")) {
        good_ = decoder_.bad = 0;
    } else if (text[1] == 'T' && four_digits(text + 2) >= 200 && four_digits(text + 2) <= 2000) {
        silence_ms_ = four_digits(text + 2);
#ifdef USV_TEST_HANG
    } else if (same(text, "#HANG1") || same(text, "#HANG2")) {
        hang = uint8_t(text[5] - '0');
#endif
    } else {
        ++decoder_.bad;
    }
}

void Board::lock() {
    interlock_ = true;
    stop_seen_[0] = stop_seen_[1] = false;
}

void Board::all_stop() {
    for (uint8_t pin = 0; pin < kPins; ++pin) target_[pin] = kStopUs;
}

void Board::read_estop(bool pressed, uint32_t now_ms) {
    if (pressed != input_seen_) {
        input_seen_ = pressed;
        input_ms_ = now_ms;
    }
    if (pressed != estop_ && now_ms - input_ms_ >= kEstopFilterMs) {
        estop_ = pressed;
        lock();
    }
}

void Board::check_silence(uint32_t now_ms) {
    if (!heard_ || failsafe_) return;
    const uint16_t limit_ms = decoder_.strict ? silence_ms_ : uint16_t(USV_LEVEL0_SILENCE_MS);
    if (now_ms - heard_ms_ < limit_ms) return;
    failsafe_ = true;
    all_stop();
    if (decoder_.strict) lock();
}

char Board::state() const {
    if (estop_) return 'E';
    if (failsafe_) return 'F';
    if (!heard_) return 'B';
    if (interlock_) return 'I';
    return decoder_.strict ? 'C' : 'A';
}

void Board::say_status(uint32_t now_ms, uint16_t millivolts, const uint16_t pins[kPins]) {
    const uint32_t silent_ms = now_ms - heard_ms_;
    put_text("#S,");
    put(state());
    put_field(decoder_.strict ? 1 : 0);
    put_field(!heard_ || silent_ms > 65535 ? 65535 : silent_ms);
    put_field(good_);
    put_field(decoder_.bad);
    for (uint8_t pin = 0; pin < kPins; ++pin) put_field(pins[pin]);
    put(',');
    put(cause_);
    put_field(millivolts);
    finish_line();
}

void Board::put(char value) {
    if (tx_length_ < kTxBytes) {
        tx_[tx_length_++] = value;
    } else {
        line_overflow_ = true;
    }
}

void Board::put_text(const char *text) {
    while (*text) put(*text++);
}

void Board::put_number(uint32_t value) {
    char digits[10];
    uint8_t count = 0;
    do {
        digits[count++] = char('0' + value % 10);
        value /= 10;
    } while (value);
    while (count) put(digits[--count]);
}

void Board::put_field(uint32_t value) {
    put(',');
    put_number(value);
}

// Close the line with its check digits; a line that found no room is taken back whole.
void Board::finish_line() {
    uint8_t crc = 0;
    for (uint8_t i = line_start_; i < tx_length_; ++i) crc = crc8(crc, uint8_t(tx_[i]));
    put('*');
    put(hex_digit(crc >> 4));
    put(hex_digit(crc & 15));
    put('\n');
    if (line_overflow_) tx_length_ = line_start_;
    line_overflow_ = false;
    line_start_ = tx_length_;
}

bool Board::next(uint8_t *byte) {
    if (tx_sent_ == tx_length_) {
        tx_sent_ = tx_length_ = line_start_ = 0;
        return false;
    }
    *byte = uint8_t(tx_[tx_sent_++]);
    return true;
}

}  // namespace usv
