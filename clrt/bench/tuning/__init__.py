"""Choice of how a device renders, by measurement on that device: a trial of the candidates on two scenes."""
