// Four common ways in which sketches read the seed's commands, to test the companion against: no check, no failsafe, no
// status. The build chooses: USV_STYLE 1 parseInt, 2 readStringUntil, 3 blocks of five bytes, 4 up to the next other byte.
#include "../usv_actuator/src/pulses.h"

static uint16_t pulses_us[4] = {1500, 1500, 1500, 1500};

static void apply(char id, long value) {
    const char *const ids = "mMlL";
    for (uint8_t pin = 0; pin < 4; ++pin) {
        if (ids[pin] == id && value >= 1000 && value <= 2000) pulses_us[pin] = uint16_t(value);
    }
    usv::pulses_set(pulses_us);
}

void setup() {
    usv::pulses_begin();
    Serial.begin(115200);
}

#if USV_STYLE == 1
void loop() {
    if (!Serial.available()) return;
    const char id = char(Serial.read());
    if (id == 'm' || id == 'M' || id == 'l' || id == 'L') apply(id, Serial.parseInt());
}
#elif USV_STYLE == 2
void loop() {
    if (!Serial.available()) return;
    const String line = Serial.readStringUntil('\n');
    apply(line[0], line.substring(1).toInt());
}
#elif USV_STYLE == 3
void loop() {
    if (Serial.available() < 5) return;
    char block[6] = {0};
    Serial.readBytes(block, 5);
    apply(block[0], atol(block + 1));
}
#else
void loop() {
    static char id = 0;
    static long value = 0;
    if (!Serial.available()) return;
    const char byte = char(Serial.read());
    if (byte >= '0' && byte <= '9') {
        value = value * 10 + (byte - '0');
        return;
    }
    if (id) apply(id, value);
    id = byte;
    value = 0;
}
#endif
