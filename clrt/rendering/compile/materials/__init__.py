"""Materials and textures packed for the device."""
