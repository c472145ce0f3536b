// CRC-8 of the actuator protocol: polynomial 0x07, start 0, no reflection.
#pragma once
#include <stdint.h>

namespace usv {

inline uint8_t crc8(uint8_t crc, uint8_t byte) {
    crc ^= byte;
    for (uint8_t bit = 0; bit < 8; ++bit) crc = (crc & 0x80) ? uint8_t(crc << 1) ^ 0x07 : uint8_t(crc << 1);
    return crc;
}

inline char hex_digit(uint8_t nibble) { return nibble < 10 ? char('0' + nibble) : char('A' + nibble - 10); }

}  // namespace usv
