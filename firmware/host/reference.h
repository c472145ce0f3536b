// The protocol written a second time, over whole strings with look-ahead, so that the decoder has something independent to
// agree with. `read_open` covers level 0 with checked lines in between, `read_strict` the checked level alone.
#pragma once
#include <array>
#include <map>
#include <string>
#include <vector>

namespace reference {

struct Event {
    bool checked = false;
    std::map<int, int> pulses;
    std::string word;
    bool operator==(const Event &other) const {
        return checked == other.checked && pulses == other.pulses && word == other.word;
    }
};

struct Reading {
    std::vector<Event> events;
    unsigned bad = 0;
    size_t used = 0;  // bytes read when a checked command ended the open level
};

inline std::array<unsigned char, 256> crc_table() {
    std::array<unsigned char, 256> table{};
    for (int i = 0; i < 256; ++i) {
        int value = i;
        for (int bit = 0; bit < 8; ++bit) value = (value << 1) ^ (value & 0x80 ? 0x107 : 0);
        table[size_t(i)] = static_cast<unsigned char>(value);
    }
    return table;
}

inline unsigned char crc(const std::string &text) {
    static const auto table = crc_table();
    unsigned char value = 0;
    for (unsigned char byte : text) value = table[value ^ byte];
    return value;
}

inline bool is_id(char c) { return std::string("mMlL").find(c) != std::string::npos; }
inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

// A whole line without its newline: true and an event when it is right.
inline bool checked_line(std::string line, Event *event) {
    if (line.size() > 32) return false;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.size() < 3) return false;
    const std::string body = line.substr(0, line.size() - 3);
    char digits[4];
    snprintf(digits, sizeof digits, "*%02X", crc(body));
    if (line.substr(line.size() - 3) != digits) return false;
    *event = Event();
    if (!body.empty() && body[0] == '#') {
        event->word = body;
        return body.size() == 6 && body.find_first_of("mMlL") == std::string::npos;
    }
    event->checked = true;
    if (body.empty() || body.size() % 5 || body.size() > 20) return false;
    for (size_t i = 0; i < body.size(); i += 5) {
        const auto pin = std::string("mMlL").find(body[i]);
        const std::string value = body.substr(i + 1, 4);
        if (pin == std::string::npos || value.find_first_not_of("0123456789") != std::string::npos) return false;
        if (value < "1000" || value > "2000" || event->pulses.count(int(pin))) return false;
        event->pulses[int(pin)] = std::stoi(value);
    }
    return true;
}

// Everything after the last newline is unfinished and says nothing.
inline Reading read_strict(const std::string &text) {
    Reading reading;
    size_t start = 0;
    for (size_t end; (end = text.find('\n', start)) != std::string::npos; start = end + 1) {
        if (end == start) continue;
        Event event;
        if (checked_line(text.substr(start, end - start), &event)) {
            reading.events.push_back(event);
        } else {
            ++reading.bad;
        }
    }
    reading.used = text.size();
    return reading;
}

// Text that ends with silence.
inline Reading read_open(const std::string &text) {
    Reading reading;
    Event staged;
    int groups = 0;
    size_t line = 0, i = 0;
    const auto commit = [&](size_t next) {
        if (!staged.pulses.empty()) reading.events.push_back(staged);
        staged = Event();
        groups = 0;
        line = next;
    };
    while (i < text.size()) {
        const char c = text[i];
        if (c == '*' || c == '#') {
            if (c == '#') commit(i);  // a word begins a line of its own
            const size_t end = text.find_first_of("\nmMlL", i + 1);
            Event event;
            if (end != std::string::npos && text[end] == '\n' && checked_line(text.substr(line, end - line), &event)) {
                reading.events.push_back(event);
                if (event.checked) {
                    reading.used = end + 1;
                    return reading;
                }
            } else {
                ++reading.bad;
            }
            i = end == std::string::npos ? text.size() : end + (text[end] == '\n' ? 1 : 0);
            staged = Event();
            groups = 0;
            line = i;
        } else if (is_id(c)) {
            if (groups == 4) commit(i);
            size_t j = i + 1;
            while (j < text.size() && is_digit(text[j])) ++j;
            const std::string value = text.substr(i + 1, j - i - 1);
            if (value.size() == 4 && value >= "1000" && value <= "2000") {
                staged.pulses[int(std::string("mMlL").find(c))] = std::stoi(value);
                ++groups;
            } else {
                ++reading.bad;
            }
            if (!value.empty() && j < text.size() && text[j] == '.') {
                ++j;
                while (j < text.size() && is_digit(text[j])) ++j;
            }
            i = j;
        } else if (is_digit(c)) {
            ++i;
        } else {
            ++i;
            commit(i);
        }
    }
    commit(i);
    reading.used = text.size();
    return reading;
}

}  // namespace reference
