"""The LoRa radio: compact frames, authentication and repeats over some 650 bit/s."""
