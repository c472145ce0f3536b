/* One simulated board: an AVR with the firmware in it, its serial line, its pins. Runs on libsimavr (GPL-3: a test
 * program only, never shipped). Times are microseconds of simulated time since chip_new; nothing here knows a clock. */
#ifndef USV_CHIP_H
#define USV_CHIP_H
#include <stddef.h>
#include <stdint.h>

#define CHIP_PINS 4
#define CHIP_CYCLES_PER_US 16

typedef struct chip chip_t;

typedef struct {
    uint64_t rise_cycles;
    uint32_t width_cycles;
    uint32_t pin;
} chip_pulse_t;

/* NULL when the ELF file cannot be read or the chip is unknown. `mmcu`: atmega328p or atmega2560. */
chip_t *chip_new(const char *elf_path, const char *mmcu);
void chip_free(chip_t *chip);
/* Run until the simulated time is at least `until_us`. Returns 0, or -1 when the chip crashed. */
int chip_run(chip_t *chip, uint64_t until_us);
uint64_t chip_cycles(const chip_t *chip);
/* Put bytes on the line; they arrive one after another at 115200 baud. Returns how many found room (16 KiB). */
size_t chip_feed(chip_t *chip, const uint8_t *data, size_t length);
/* Bytes that have not reached the chip yet. */
size_t chip_waiting(const chip_t *chip);
/* Take what the board has sent. */
size_t chip_read(chip_t *chip, uint8_t *data, size_t room);
/* Take finished pulses, oldest first (the last 1024 are kept). */
size_t chip_take_pulses(chip_t *chip, chip_pulse_t *pulses, size_t room);
/* Last finished pulse of a pin: width in cycles, 0 when there was none in the last 60 ms. */
uint32_t chip_width(const chip_t *chip, int pin);
/* Press reset; for `boot_loader_us` the chip then does nothing, its pins float and bytes are lost. */
void chip_reset(chip_t *chip, uint64_t boot_loader_us);
/* Emergency-stop switch: 1 open (stop), 0 closed. */
void chip_stop(chip_t *chip, int open);
/* Voltage at A0, mV. */
void chip_millivolts(chip_t *chip, unsigned millivolts);
/* Read or write data memory (symbol address without the 0x800000 of the ELF). */
uint8_t chip_peek(const chip_t *chip, uint16_t address);
void chip_poke(chip_t *chip, uint16_t address, uint8_t value);
#endif
