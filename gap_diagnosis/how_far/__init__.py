"""How far the gap shrinks, on data held out from the fits."""
