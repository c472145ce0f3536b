#include "chip.h"

#include <stdlib.h>
#include <string.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

#define IN_BYTES 16384
#define OUT_BYTES 16384
#define PULSES 1024
/* A byte takes 1389 cycles at 115200 baud; libsimavr's receiver counts a bit more and needs 1496. */
#define BYTE_CYCLES 1500
#define PULSE_GONE_CYCLES (60000ull * CHIP_CYCLES_PER_US)

typedef struct {
    char port;
    int bit;
} pin_t;

typedef struct {
    chip_t *chip;
    int pin;
    uint64_t rise;
    int high;
    uint32_t width;
    uint64_t end;
} watch_t;

struct chip {
    avr_t *avr;
    const pin_t *pins; /* four outputs, then the stop input */
    uint64_t cycles;
    uint64_t held_until;
    uint64_t interrupts_on;
    uint64_t next_byte;
    uint8_t in[IN_BYTES];
    size_t in_head, in_count;
    int uart_full;
    uint8_t out[OUT_BYTES];
    size_t out_head, out_count;
    chip_pulse_t pulses[PULSES];
    size_t pulse_head, pulse_count;
    watch_t watch[CHIP_PINS];
    unsigned millivolts;
};

static const pin_t UNO[] = {{'B', 1}, {'B', 2}, {'D', 7}, {'B', 0}, {'D', 4}};
static const pin_t MEGA[] = {{'H', 6}, {'B', 4}, {'H', 4}, {'H', 5}, {'G', 5}};

/* Data addresses that both chips share, and the watchdog as the firmware sets it. */
#define MCUSR_ADDRESS 0x54
#define WDTCSR_ADDRESS 0x60
#define WDRF_BIT 3
#define WDE_BIT 3
#define WDIE_BIT 6
#define WATCHDOG_CYCLES (250000ull * CHIP_CYCLES_PER_US)

static void quiet(avr_t *avr, const int level, const char *format, va_list arguments) {
    (void)avr, (void)level, (void)format, (void)arguments;
}

/* The simulated chip must not sleep in real time. */
static void no_sleep(avr_t *avr, avr_cycle_count_t how_long) { (void)avr, (void)how_long; }

static void on_output(struct avr_irq_t *irq, uint32_t value, void *param) {
    chip_t *chip = param;
    (void)irq;
    if (chip->out_count == OUT_BYTES) return;
    chip->out[(chip->out_head + chip->out_count++) % OUT_BYTES] = (uint8_t)value;
}

static void on_full(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)value;
    ((chip_t *)param)->uart_full = 1;
}

static void on_room(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)value;
    ((chip_t *)param)->uart_full = 0;
}

static void keep_pulse(chip_t *chip, const watch_t *watch) {
    if (chip->pulse_count == PULSES) {
        chip->pulse_head = (chip->pulse_head + 1) % PULSES;
        chip->pulse_count--;
    }
    chip_pulse_t *slot = &chip->pulses[(chip->pulse_head + chip->pulse_count++) % PULSES];
    slot->rise_cycles = watch->rise;
    slot->width_cycles = watch->width;
    slot->pin = (uint32_t)watch->pin;
}

static void on_pin(struct avr_irq_t *irq, uint32_t value, void *param) {
    watch_t *watch = param;
    (void)irq;
    const uint64_t now = watch->chip->avr->cycle;
    const int high = value & 1;
    if (high == watch->high) return;
    watch->high = high;
    if (high) {
        watch->rise = now;
    } else {
        watch->width = (uint32_t)(now - watch->rise);
        watch->end = now;
        keep_pulse(watch->chip, watch);
    }
}

static void connect(chip_t *chip) {
    avr_t *avr = chip->avr;
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_output, chip);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF), on_full, chip);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON), on_room, chip);
    for (int pin = 0; pin < CHIP_PINS; pin++) {
        chip->watch[pin] = (watch_t){.chip = chip, .pin = pin};
        avr_irq_register_notify(
            avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(chip->pins[pin].port), (unsigned)chip->pins[pin].bit), on_pin,
            &chip->watch[pin]);
    }
}

chip_t *chip_new(const char *elf_path, const char *mmcu) {
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof firmware);
    avr_global_logger_set(quiet);
    if (elf_read_firmware(elf_path, &firmware) != 0) return NULL;
    avr_t *avr = avr_make_mcu_by_name(mmcu);
    if (!avr) return NULL;
    avr_init(avr);
    avr->log = LOG_NONE;
    avr->sleep = no_sleep;
    avr_load_firmware(avr, &firmware);
    avr->frequency = 16000000;
    avr->vcc = avr->avcc = avr->aref = 5000;
    chip_t *chip = calloc(1, sizeof *chip);
    chip->avr = avr;
    chip->pins = strcmp(mmcu, "atmega2560") == 0 ? MEGA : UNO;
    connect(chip);
    chip_stop(chip, 0);
    return chip;
}

void chip_free(chip_t *chip) {
    if (!chip) return;
    avr_terminate(chip->avr);
    free(chip);
}

uint64_t chip_cycles(const chip_t *chip) { return chip->cycles; }

/* Give the next byte to the UART when its time on the line is over; a receiver that is full loses it. */
static void feed_line(chip_t *chip) {
    if (chip->in_count == 0 || chip->cycles < chip->next_byte) return;
    const uint8_t byte = chip->in[chip->in_head];
    chip->in_head = (chip->in_head + 1) % IN_BYTES;
    chip->in_count--;
    chip->next_byte = chip->cycles + BYTE_CYCLES;
    if (chip->uart_full || chip->cycles < chip->held_until) return;
    avr_raise_irq(avr_io_getirq(chip->avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), byte);
}

/* libsimavr never resets a chip whose watchdog interrupt cannot run because interrupts are off. The data sheet does: "if
 * the interrupt is not executed before the next time-out, a system reset is applied". */
static void deaf_watchdog(chip_t *chip) {
    avr_t *avr = chip->avr;
    const uint8_t control = avr->data[WDTCSR_ADDRESS];
    const int armed = (control & (1 << WDE_BIT)) && (control & (1 << WDIE_BIT));
    if (avr->sreg[S_I] || !armed) {
        chip->interrupts_on = chip->cycles;
    } else if (chip->cycles - chip->interrupts_on > WATCHDOG_CYCLES) {
        avr_reset(avr);
        avr->data[MCUSR_ADDRESS] = 1 << WDRF_BIT;
        chip->interrupts_on = chip->cycles;
    }
}

int chip_run(chip_t *chip, uint64_t until_us) {
    const uint64_t end = until_us * CHIP_CYCLES_PER_US;
    avr_t *avr = chip->avr;
    while (chip->cycles < end) {
        feed_line(chip);
        if (chip->cycles < chip->held_until) {
            const uint64_t until = chip->held_until < end ? chip->held_until : end;
            const uint64_t byte = chip->in_count && chip->next_byte < until ? chip->next_byte : until;
            avr->cycle += byte - chip->cycles;
            chip->cycles = byte;
            if (chip->cycles == chip->held_until) {
                avr_reset(avr);
                avr_regbit_set(avr, avr->reset_flags.extrf);
            }
            continue;
        }
        const uint64_t before = avr->cycle;
        const int state = avr_run(avr);
        chip->cycles += avr->cycle - before;
        deaf_watchdog(chip);
        if (state == cpu_Done || state == cpu_Crashed) return -1;
    }
    return 0;
}

size_t chip_feed(chip_t *chip, const uint8_t *data, size_t length) {
    size_t taken = 0;
    if (chip->in_count == 0 && chip->next_byte < chip->cycles + BYTE_CYCLES) chip->next_byte = chip->cycles + BYTE_CYCLES;
    for (; taken < length && chip->in_count < IN_BYTES; taken++) {
        chip->in[(chip->in_head + chip->in_count++) % IN_BYTES] = data[taken];
    }
    return taken;
}

size_t chip_waiting(const chip_t *chip) { return chip->in_count; }

size_t chip_read(chip_t *chip, uint8_t *data, size_t room) {
    size_t count = 0;
    while (count < room && chip->out_count) {
        data[count++] = chip->out[chip->out_head];
        chip->out_head = (chip->out_head + 1) % OUT_BYTES;
        chip->out_count--;
    }
    return count;
}

size_t chip_take_pulses(chip_t *chip, chip_pulse_t *pulses, size_t room) {
    size_t count = 0;
    while (count < room && chip->pulse_count) {
        pulses[count++] = chip->pulses[chip->pulse_head];
        chip->pulse_head = (chip->pulse_head + 1) % PULSES;
        chip->pulse_count--;
    }
    return count;
}

uint32_t chip_width(const chip_t *chip, int pin) {
    const watch_t *watch = &chip->watch[pin];
    if (watch->width == 0 || chip->avr->cycle - watch->end > PULSE_GONE_CYCLES) return 0;
    return watch->width;
}

void chip_reset(chip_t *chip, uint64_t boot_loader_us) {
    avr_reset(chip->avr);
    avr_regbit_set(chip->avr, chip->avr->reset_flags.extrf);
    chip->uart_full = 0;
    chip->in_count = 0;
    for (int pin = 0; pin < CHIP_PINS; pin++) chip->watch[pin].high = 0;
    if (boot_loader_us) {
        chip->held_until = chip->cycles + boot_loader_us * CHIP_CYCLES_PER_US;
        for (int pin = 0; pin < CHIP_PINS; pin++) chip->watch[pin].width = 0;
    }
}

void chip_stop(chip_t *chip, int open) {
    const pin_t pin = chip->pins[CHIP_PINS];
    avr_ioport_external_t external = {
        .name = (unsigned long)pin.port, .mask = 1u << pin.bit, .value = open ? 1u << pin.bit : 0};
    avr_ioctl(chip->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(pin.port), &external);
    avr_raise_irq(avr_io_getirq(chip->avr, AVR_IOCTL_IOPORT_GETIRQ(pin.port), (unsigned)pin.bit), (uint32_t)open);
}

void chip_millivolts(chip_t *chip, unsigned millivolts) {
    chip->millivolts = millivolts;
    avr_raise_irq(avr_io_getirq(chip->avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0), millivolts);
}

uint8_t chip_peek(const chip_t *chip, uint16_t address) { return chip->avr->data[address]; }

void chip_poke(chip_t *chip, uint16_t address, uint8_t value) { chip->avr->data[address] = value; }
