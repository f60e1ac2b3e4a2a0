"""Levels of signal, distortion and noise at excited, odd and even lines.

Begin with `levels`. Where detection lines are few, `local_power` gives the expected power between
lines, `resonant_poles` where a spectrum behind the plant peaks, and `third_order` where third-order
distortion of a multisine falls.
"""
