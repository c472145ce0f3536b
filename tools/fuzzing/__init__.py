"""What the fuzzers drive: the decoders that strangers reach, makers of frames that are nearly right, and IMC's bridge."""
