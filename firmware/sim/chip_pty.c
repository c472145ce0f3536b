/* The simulated board in real time, its serial line on a pseudo-terminal.
 *   chip_pty FIRMWARE.elf MCU LINK [BOOT_LOADER_MS]
 * LINK becomes a symbolic link to the terminal. With BOOT_LOADER_MS the chip restarts whenever the terminal is opened, as a real
 * board does, and is deaf for that long. Every 20 ms of its own time a line on stdout: that time as the machine's monotonic
 * one in us, four pulse widths in us (0 = no pulse). A board has a processor of its own: on a busy machine the chip falls behind
 * and catches up, and its clock, never ahead of the machine's, still tells when its pins moved.
 * Lines on stdin: "reset [MS]", "stop 0|1", "mv N" (at A0), "quit"; end of file ends the program too. */
#include "chip.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define SLICE_US 1000
#define REPORT_US 20000
#define LATE_US 200000 /* after a longer pause (a stopped process) simulated time goes on from now, it does not race */
#define LINE_BYTES 256 /* what the serial converter and its driver hold for the chip */

static uint64_t monotonic_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

static int open_terminal(const char *link) {
    int master, slave;
    char name[128];
    struct termios raw;
    cfmakeraw(&raw);
    if (openpty(&master, &slave, name, NULL, NULL) != 0) return -1;
    tcgetattr(slave, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave, TCSANOW, &raw);
    close(slave);
    fcntl(master, F_SETFL, O_NONBLOCK);
    unlink(link);
    return symlink(name, link) == 0 ? master : -1;
}

/* Is a program at the other end? */
static int connected(int master) {
    struct pollfd item = {.fd = master, .events = POLLIN};
    poll(&item, 1, 0);
    return !(item.revents & POLLHUP);
}

/* What was written before the other end closed still arrives; nothing is said to nobody. */
static void shuttle(chip_t *chip, int master, int is_connected) {
    uint8_t data[LINE_BYTES];
    const size_t waiting = chip_waiting(chip);
    if (waiting < LINE_BYTES) {
        const ssize_t count = read(master, data, LINE_BYTES - waiting);
        if (count > 0) chip_feed(chip, data, (size_t)count);
    }
    const size_t said = chip_read(chip, data, sizeof data);
    if (said && is_connected && write(master, data, said) < 0 && errno != EAGAIN && errno != EIO) exit(1);
}

/* Carry out one line from stdin; 0 when it ends the program. */
static int command(chip_t *chip, const char *line) {
    if (strncmp(line, "reset", 5) == 0) chip_reset(chip, (uint64_t)atol(line + 5) * 1000);
    if (strncmp(line, "stop", 4) == 0) chip_stop(chip, atoi(line + 4));
    if (strncmp(line, "mv", 2) == 0) chip_millivolts(chip, (unsigned)atoi(line + 2));
    return strncmp(line, "quit", 4) != 0;
}

static int commands(chip_t *chip) {
    static char line[64];
    static size_t length;
    char byte;
    ssize_t count;
    while ((count = read(STDIN_FILENO, &byte, 1)) == 1) {
        if (byte != '\n') {
            if (length < sizeof line - 1) line[length++] = byte;
            continue;
        }
        line[length] = 0;
        length = 0;
        if (!command(chip, line)) return 0;
    }
    return count != 0;
}

static void tell_pins(const chip_t *chip, uint64_t at_us) {
    printf("%llu %.1f %.1f %.1f %.1f\n", (unsigned long long)at_us, chip_width(chip, 0) / 16.0,
           chip_width(chip, 1) / 16.0, chip_width(chip, 2) / 16.0, chip_width(chip, 3) / 16.0);
}

int main(int argc, char **argv) {
    if (argc < 4) {
        fprintf(stderr, "usage: %s FIRMWARE.elf MCU LINK [BOOT_LOADER_MS]\n", argv[0]);
        return 2;
    }
    const uint64_t boot_loader_us = argc > 4 ? (uint64_t)atol(argv[4]) * 1000 : 0;
    chip_t *chip = chip_new(argv[1], argv[2]);
    const int master = chip ? open_terminal(argv[3]) : -1;
    if (master < 0) {
        fprintf(stderr, "cannot load %s or make %s\n", argv[1], argv[3]);
        return 1;
    }
    fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    setvbuf(stdout, NULL, _IOLBF, 0);
    uint64_t start = monotonic_us(), simulated = 0, report = 0;
    int was_connected = 0;
    while (commands(chip)) {
        const uint64_t now = monotonic_us();
        if (now - start > simulated + LATE_US) start = now - simulated;
        const int is_connected = connected(master);
        if (is_connected && !was_connected && boot_loader_us) chip_reset(chip, boot_loader_us);
        was_connected = is_connected;
        shuttle(chip, master, is_connected);
        while (simulated < now - start) {
            simulated += SLICE_US;
            if (chip_run(chip, simulated) != 0) return 1;
            if (simulated < report) continue;
            report = simulated + REPORT_US;
            tell_pins(chip, start + simulated);
        }
        usleep(SLICE_US);
    }
    unlink(argv[3]);
    chip_free(chip);
    return 0;
}
