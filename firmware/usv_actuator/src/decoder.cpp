#include "decoder.h"

#include "crc8.h"

namespace usv {

namespace {

int8_t pin_of(uint8_t value) {
    switch (value) {
        case 'm': return 0;
        case 'M': return 1;
        case 'l': return 2;
        case 'L': return 3;
        default: return -1;
    }
}

bool is_digit(uint8_t value) { return value >= '0' && value <= '9'; }

bool in_range(uint16_t pulse_us) { return pulse_us >= kLowUs && pulse_us <= kHighUs; }

}  // namespace

Found Decoder::byte(uint8_t value, uint32_t now_ms) {
    last_byte_ms_ = now_ms;
    return strict ? strict_byte(value) : open_byte(value);
}

Found Decoder::silence(uint32_t now_ms) {
    const bool idle = length_ == 0 && !overflow_;
    if (strict || idle || now_ms - last_byte_ms_ <= kSilenceMs) return Found::kNothing;
    if (star_ || line_[0] == '#') {
        ++bad;
        restart();
        return Found::kNothing;
    }
    return commit();
}

void Decoder::restart() {
    length_ = 0;
    overflow_ = false;
    star_ = false;
    staged_ = Command();
    groups_ = 0;
    pin_ = -1;
}

void Decoder::append(uint8_t value) {
    if (length_ < kLineBytes) {
        line_[length_++] = value;
    } else {
        overflow_ = true;
    }
}

Found Decoder::strict_byte(uint8_t value) {
    if (value != '\n') {
        append(value);
        return Found::kNothing;
    }
    return length_ == 0 ? Found::kNothing : finish_checked();
}

Found Decoder::finish_checked() {
    const Found found = overflow_ ? Found::kNothing : parse_checked();
    restart();
    if (found == Found::kNothing) ++bad;
    return found;
}

// The line without its newline is right to the last byte, or nothing.
Found Decoder::parse_checked() {
    uint8_t length = length_;
    if (length > 0 && line_[length - 1] == '\r') --length;
    if (length < 3) return Found::kNothing;
    const uint8_t body = uint8_t(length - 3);
    uint8_t crc = 0;
    for (uint8_t i = 0; i < body; ++i) crc = crc8(crc, line_[i]);
    if (line_[body] != '*' || line_[body + 1] != hex_digit(crc >> 4) || line_[body + 2] != hex_digit(crc & 15)) {
        return Found::kNothing;
    }
    if (body > 0 && line_[0] == '#') {
        if (body != kWordChars) return Found::kNothing;
        for (uint8_t i = 0; i < body; ++i) {
            if (pin_of(line_[i]) >= 0) return Found::kNothing;
            word_[i] = char(line_[i]);
        }
        return Found::kWord;
    }
    return parse_groups(body) ? Found::kCommand : Found::kNothing;
}

bool Decoder::parse_groups(uint8_t length) {
    if (length % 5 != 0 || length < 5 || length > 5 * kPins) return false;
    Command command;
    command.checked = true;
    for (uint8_t start = 0; start < length; start = uint8_t(start + 5)) {
        const int8_t pin = pin_of(line_[start]);
        if (pin < 0 || (command.mask & (1 << pin))) return false;
        uint16_t value = 0;
        for (uint8_t i = 1; i < 5; ++i) {
            if (!is_digit(line_[start + i])) return false;
            value = uint16_t(value * 10 + (line_[start + i] - '0'));
        }
        if (!in_range(value)) return false;
        command.mask = uint8_t(command.mask | (1 << pin));
        command.pulse_us[pin] = value;
    }
    command_ = command;
    return true;
}

Found Decoder::open_byte(uint8_t value) {
    const bool in_word = length_ > 0 && line_[0] == '#';
    if (value == '\n') return star_ || in_word ? finish_checked() : commit();
    if (pin_of(value) >= 0) return open_group(value, in_word);
    if (star_ || in_word) {
        append(value);
        return Found::kNothing;
    }
    return open_rest(value);
}

Found Decoder::open_group(uint8_t value, bool in_word) {
    Found done = Found::kNothing;
    if (star_ || in_word) {
        ++bad;
        restart();
    } else {
        end_group();
        if (groups_ == kPins) done = commit();
    }
    append(value);
    pin_ = pin_of(value);
    digits_ = 0;
    value_ = 0;
    fraction_ = false;
    return done;
}

Found Decoder::open_rest(uint8_t value) {
    if (is_digit(value)) {
        append(value);
        if (pin_ >= 0 && !fraction_ && digits_ < 5) {
            ++digits_;
            if (digits_ <= 4) value_ = uint16_t(value_ * 10 + (value - '0'));
        }
        return Found::kNothing;
    }
    if (value == '.' && pin_ >= 0 && digits_ > 0 && !fraction_) {
        append(value);
        fraction_ = true;
        return Found::kNothing;
    }
    if (value == '*') {
        end_group();
        star_ = true;
        append(value);
        return Found::kNothing;
    }
    const Found done = commit();
    if (value == '#') append(value);
    return done;
}

void Decoder::end_group() {
    if (pin_ < 0) return;
    if (digits_ == 4 && in_range(value_)) {
        staged_.pulse_us[pin_] = value_;
        staged_.mask = uint8_t(staged_.mask | (1 << pin_));
        ++groups_;
    } else {
        ++bad;
    }
    pin_ = -1;
}

// Give out what is staged as a level-0 command and begin a new line.
Found Decoder::commit() {
    end_group();
    const bool any = staged_.mask != 0;
    if (any) command_ = staged_;
    restart();
    return any ? Found::kCommand : Found::kNothing;
}

}  // namespace usv
