"""Other people's denoisers and ground segmentations, to compare with."""
