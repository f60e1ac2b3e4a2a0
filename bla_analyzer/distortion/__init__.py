"""Levels of signal, distortion and noise at excited, odd and even lines."""
