"""The bridge between IMC consoles and a MAVLink vehicle: what ``companion imc`` is made of."""
