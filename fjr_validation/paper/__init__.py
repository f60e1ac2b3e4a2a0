"""The paper's experiments run again and set beside its statements: `fjr paper`."""
