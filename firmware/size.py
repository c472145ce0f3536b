"""Check firmware sizes: flash and RAM below half of the chip's. Arguments: FILE.elf:FLASH:RAM ..."""

import subprocess
import sys


def main(arguments: list[str]) -> int:
    failed = False
    for item in arguments:
        path, flash_max, ram_max = item.rsplit(":", 2)
        table = subprocess.run(["avr-size", "-A", path], check=True, capture_output=True, text=True).stdout
        sizes = {
            words[0]: int(words[1])
            for line in table.splitlines()
            if len(words := line.split()) == 3 and words[1].isdigit()
        }
        flash = sizes.get(".text", 0) + sizes.get(".data", 0)
        ram = sizes.get(".data", 0) + sizes.get(".bss", 0) + sizes.get(".noinit", 0)
        fits = flash * 2 < int(flash_max) and ram * 2 < int(ram_max)
        failed |= not fits
        sys.stdout.write(
            f"{path}: flash {flash} of {flash_max} bytes ({100 * flash / int(flash_max):.1f} %), "
            f"RAM {ram} of {ram_max} bytes ({100 * ram / int(ram_max):.1f} %){'' if fits else ': more than half'}\n"
        )
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
