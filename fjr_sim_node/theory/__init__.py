"""Theory of the rig: linear dynamics G0, delayed loop, statistical linearisation."""
