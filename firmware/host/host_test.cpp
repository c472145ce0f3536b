// Tests of the protocol code on this machine, under address and undefined-behaviour sanitizers.
// Usage: host_test [random lines, default 1000000]
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include "board.h"
#include "crc8.h"
#include "decoder.h"
#include "reference.h"
#include "vectors.h"

using reference::Event;
using usv::Decoder;
using usv::Found;

static unsigned g_passed = 0, g_failed = 0;

static void check(bool good, const std::string &what) {
    if (good) {
        ++g_passed;
    } else if (++g_failed <= 20) {
        fprintf(stderr, "FAILED: %s\n", what.c_str());
    }
}

static std::string shown(const std::string &text) {
    std::string out;
    char piece[8];
    for (unsigned char c : text) {
        snprintf(piece, sizeof piece, c >= 32 && c < 127 ? "%c" : "\\x%02x", c);
        out += piece;
    }
    return out;
}

static Event event_of(const Decoder &decoder, Found found) {
    Event event;
    if (found == Found::kWord) event.word = std::string(decoder.word(), usv::kWordChars);
    if (found == Found::kCommand) {
        event.checked = decoder.command().checked;
        for (int pin = 0; pin < 4; ++pin) {
            if (decoder.command().mask & (1 << pin)) event.pulses[pin] = decoder.command().pulse_us[pin];
        }
    }
    return event;
}

// Feed text, then silence. The first checked command makes the decoder strict, as the board does.
static std::vector<Event> decode(Decoder &decoder, const std::string &text, uint32_t *now_ms) {
    std::vector<Event> events;
    const auto take = [&](Found found) {
        if (found == Found::kNothing) return;
        events.push_back(event_of(decoder, found));
        if (events.back().checked) decoder.strict = true;
    };
    for (unsigned char byte : text) take(decoder.byte(byte, *now_ms));
    *now_ms += 10;
    take(decoder.silence(*now_ms));
    return events;
}

static void test_vectors() {
    for (const auto &vector : kCrcVectors) {
        uint8_t crc = 0;
        for (unsigned char byte : vector.text) crc = usv::crc8(crc, byte);
        check(crc == vector.crc, "crc of " + vector.text);
    }
    for (const auto &vector : kEncodeVectors) {
        for (const auto &sent : {vector.newline, vector.bare, vector.checked}) {
            Decoder decoder;
            uint32_t now_ms = 0;
            std::map<int, int> pulses;
            for (const auto &event : decode(decoder, sent, &now_ms)) {
                for (const auto &item : event.pulses) pulses[item.first] = item.second;
            }
            for (int pin = 0; pin < 4; ++pin) check(pulses[pin] == int(vector.pulses[pin]), "decode of " + shown(sent));
            check(decoder.bad == 0, "no error in " + shown(sent));
        }
    }
    for (const auto &vector : kDecodeVectors) {
        Decoder decoder;
        decoder.strict = vector.strict;
        uint32_t now_ms = 0;
        unsigned pulses[4] = {0, 0, 0, 0};
        std::vector<std::string> words;
        for (const auto &event : decode(decoder, vector.send, &now_ms)) {
            for (const auto &item : event.pulses) pulses[item.first] = unsigned(item.second);
            if (!event.word.empty()) words.push_back(event.word);
        }
        for (int pin = 0; pin < 4; ++pin) check(pulses[pin] == vector.pulses[pin], vector.name);
        check(words == vector.words, vector.name);
        check(decoder.bad == vector.bad, std::string(vector.name) + ": bad " + std::to_string(decoder.bad));
    }
}

// Compare with the reference; returns false when they differ.
static bool agrees(const Decoder &start, const std::string &before, const std::string &text) {
    Decoder decoder = start;
    const unsigned bad_before = start.bad;
    uint32_t now_ms = 0;
    const auto got = decode(decoder, text, &now_ms);
    auto wanted = start.strict ? reference::read_strict(before + text) : reference::read_open(before + text);
    if (wanted.used < before.size() + text.size()) {
        const auto rest = reference::read_strict((before + text).substr(wanted.used));
        wanted.events.insert(wanted.events.end(), rest.events.begin(), rest.events.end());
        wanted.bad += rest.bad;
    }
    return got == wanted.events && decoder.bad - bad_before == wanted.bad;
}

// Three bytes complete nothing from a fresh start, and nothing is ever out of range.
static bool out_of_range(const Decoder &decoder, Found found, bool fresh) {
    if (found == Found::kNothing) return false;
    bool wrong = fresh;
    for (int pin = 0; pin < 4; ++pin) {
        const unsigned pulse = decoder.command().pulse_us[pin];
        wrong = wrong || (found == Found::kCommand && (decoder.command().mask & (1 << pin)) && (pulse < 1000 || pulse > 2000));
    }
    return wrong;
}

// From every start, every sequence up to length 2 against the reference, and every one of length 3 for values out of range; the
// fresh decoder's three bytes are compared as well where a byte means anything to the protocol.
static void test_all_short_sequences() {
    const std::vector<std::pair<bool, std::string>> starts = {
        {false, ""}, {true, ""}, {false, "m15"}, {false, "M1999m1500.5"}, {false, "m1500*"}, {true, "m1999*"}, {true, "l1777"}};
    const std::string meaning("mMlL#*\n\r.059AF\0;-", 17);
    for (const auto &start : starts) {
        Decoder decoder;
        decoder.strict = start.first;
        for (unsigned char byte : start.second) decoder.byte(byte, 0);
        unsigned wrong = 0;
        const bool fresh = start.second.empty();
        for (unsigned first = 0; first < 256; ++first) {
            wrong += !agrees(decoder, start.second, std::string(1, char(first)));
            Decoder one = decoder;
            wrong += out_of_range(one, one.byte(uint8_t(first), 0), fresh);
            for (unsigned second = 0; second < 256; ++second) {
                wrong += !agrees(decoder, start.second, {char(first), char(second)});
                Decoder two = one;
                wrong += out_of_range(two, two.byte(uint8_t(second), 0), fresh);
                for (unsigned third = 0; third < 256; ++third) {
                    Decoder three = two;
                    wrong += out_of_range(three, three.byte(uint8_t(third), 0), fresh);
                }
            }
        }
        for (char first : meaning) {
            for (char second : meaning) {
                for (char third : meaning) wrong += !agrees(decoder, start.second, {first, second, third});
            }
        }
        check(wrong == 0, "all sequences after '" + start.second + "': " + std::to_string(wrong) + " wrong");
    }
}

class Generator {
  public:
    explicit Generator(unsigned seed) : random_(seed) {}
    unsigned below(unsigned limit) { return std::uniform_int_distribution<unsigned>(0, limit - 1)(random_); }

    std::string line() {
        std::string text;
        switch (below(5)) {
            case 0: text = bytes(below(40)); break;
            case 1: text = level0(); break;
            case 2: text = "#" + bytes(5); text = closed(text); break;
            default: text = closed(groups(1 + below(5))); break;
        }
        for (unsigned edits = below(3); edits; --edits) edit(text);
        return text;
    }

  private:
    std::string bytes(unsigned length) {
        static const std::string likely("mMlL0123456789*#\n\r.;-AF ");
        std::string text;
        for (unsigned i = 0; i < length; ++i) text += below(4) ? likely[below(unsigned(likely.size()))] : char(below(256));
        return text;
    }
    std::string groups(unsigned count) {
        std::string text;
        for (unsigned i = 0; i < count; ++i) text += "mMlL"[below(8) ? i % 4 : below(4)] + std::to_string(900 + below(1200));
        return text;
    }
    std::string level0() {
        static const char *const ends[] = {"", "\n", "\r\n", ";", ".000000\n"};
        return groups(1 + below(6)) + ends[below(5)];
    }
    std::string closed(std::string text) {
        char digits[8];
        snprintf(digits, sizeof digits, "*%02X\n", reference::crc(text));
        return text + digits;
    }
    void edit(std::string &text) {
        if (text.empty()) return;
        const size_t place = below(unsigned(text.size()));
        switch (below(3)) {
            case 0: text[place] = char(text[place] ^ (1 << below(8))); break;
            case 1: text.erase(place, 1); break;
            default: text.insert(place, 1, char(below(256))); break;
        }
    }
    std::mt19937 random_;
};

static void test_random_lines(unsigned count) {
    Generator generator(20240229);
    unsigned wrong = 0;
    for (unsigned done = 0; done < count;) {
        std::string text;
        const unsigned together = 1 + generator.below(6);
        for (unsigned i = 0; i < together; ++i, ++done) text += generator.line();
        Decoder decoder;
        decoder.strict = generator.below(2);
        if (!agrees(decoder, "", text) && ++wrong <= 5) fprintf(stderr, "differs: %s\n", shown(text).c_str());
    }
    check(wrong == 0, std::to_string(wrong) + " random texts read differently");
}

struct Sent {
    uint16_t pulse_us[4];
    bool operator==(const usv::Command &command) const {
        for (int pin = 0; pin < 4; ++pin) {
            if (command.pulse_us[pin] != pulse_us[pin]) return false;
        }
        return command.mask == 0x0F;
    }
};

static size_t write_line(char *line, const Sent &sent) {
    size_t length = 0;
    for (int pin = 0; pin < 4; ++pin) {
        line[length++] = "mMlL"[pin];
        for (unsigned place = 1000; place; place /= 10) line[length++] = char('0' + sent.pulse_us[pin] / place % 10);
    }
    const unsigned crc = reference::crc(std::string(line, length));
    line[length++] = '*';
    line[length++] = usv::hex_digit(uint8_t(crc >> 4));
    line[length++] = usv::hex_digit(crc & 15);
    line[length++] = '\n';
    return length;
}

// The board latched to the checked level, its line disturbed: a value may be applied only if it was sent. Chances per 65536.
static void test_noise(unsigned count, unsigned flip, unsigned lose, const char *name) {
    std::mt19937 random(4711);
    Decoder decoder;
    decoder.strict = true;
    unsigned wrong = 0, applied = 0;
    Sent sent[2] = {};
    for (unsigned i = 0; i < count; ++i) {
        for (auto &pulse : sent[i & 1].pulse_us) pulse = uint16_t(1000 + random() % 1001);
        char line[32];
        const size_t length = write_line(line, sent[i & 1]);
        for (size_t k = 0; k < length; ++k) {
            const uint32_t draw = random();
            uint8_t byte = uint8_t(line[k]);
            if ((draw & 0xFFFF) < lose) continue;
            if ((draw >> 16) < flip) byte = uint8_t(byte ^ (1 << (random() & 7)));
            if (decoder.byte(byte, i * 50) != Found::kCommand) continue;
            ++applied;
            wrong += !(sent[0] == decoder.command()) && !(sent[1] == decoder.command());
        }
    }
    printf("noise, %s: %u of %u lines applied, %u wrong\n", name, applied, count, wrong);
    check(wrong == 0, std::string("noise: ") + name);
    check(applied > count * 9 / 10, std::string("most lines survive: ") + name);
}

static uint16_t wanted(const usv::Board &board, int pin) {
    uint16_t pulses[4];
    board.wanted(pulses);
    return pulses[pin];
}

static void send(usv::Board &board, const std::string &text, uint32_t now_ms) {
    for (unsigned char byte : text) board.receive(byte, now_ms);
}

// Milliseconds wrap after 49.7 days; the silence limit must not care.
static void test_board_across_the_wrap() {
    const uint16_t pins[4] = {1500, 1500, 1500, 1500};
    usv::Board board;
    uint32_t now_ms = UINT32_MAX - 700;
    board.begin('P', "HOST", now_ms);
    const std::string neutral = kEncodeVectors[0].checked, ahead = kEncodeVectors[1].checked;
    send(board, neutral, now_ms);
    for (unsigned i = 0; i < 1000; ++i, ++now_ms) {
        if (i % 50 == 0) send(board, ahead, now_ms);
        board.tick(now_ms, false, 12000, pins);
        uint8_t byte;
        while (board.next(&byte)) {
        }
        if (i > 0) check(wanted(board, 0) == 1750, "thrust holds across the wrap");
    }
    unsigned stopped = 0;
    for (unsigned i = 0; i < 600; ++i, ++now_ms) {
        board.tick(now_ms, false, 12000, pins);
        stopped += wanted(board, 0) == 1500 && wanted(board, 2) == 1500;
    }
    check(stopped >= 145 && stopped <= 152, "silence limit after the wrap: " + std::to_string(stopped));
}

// A full transmit buffer never blocks, never cuts a line.
static void test_board_never_blocks() {
    const uint16_t pins[4] = {1500, 1500, 1500, 1500};
    usv::Board board;
    board.begin('P', "HOST", 0);
    for (uint32_t now_ms = 0; now_ms < 5000; ++now_ms) {
        board.tick(now_ms, false, 12000, pins);
        if (now_ms % 10 == 0) send(board, "#VERS?*58\n", now_ms);
    }
    std::string said;
    uint8_t byte;
    while (board.next(&byte)) said += char(byte);
    unsigned lines = 0;
    for (size_t start = 0, end; (end = said.find('\n', start)) != std::string::npos; start = end + 1, ++lines) {
        const std::string line = said.substr(start, end - start);
        if (line.empty()) continue;  // the banner begins with a newline
        check(line.size() > 3, "whole line: " + line);
        char digits[4];
        snprintf(digits, sizeof digits, "*%02X", reference::crc(line.substr(0, line.size() - 3)));
        check(line.substr(line.size() - 3) == digits, "whole line: " + line);
    }
    check(lines >= 2 && !said.empty() && said.back() == '\n', "lines are whole");
}

int main(int argc, char **argv) {
    const unsigned lines = argc > 1 ? unsigned(atol(argv[1])) : 1000000;
    test_vectors();
    test_board_across_the_wrap();
    test_board_never_blocks();
    test_all_short_sequences();
    test_random_lines(lines);
    test_noise(lines, 66, 0, "one bit flipped in 0.1 % of bytes");
    test_noise(lines, 0, 66, "0.1 % of bytes lost");
    test_noise(lines, 66, 66, "both");
    printf("%u passed, %u failed\n", g_passed, g_failed);
    return g_failed ? 1 : 0;
}
