"""Records of rigs without ROS, of any excitation, turned into bags of the interface.

Files and a map of columns go in, bags come out. Begin with `importer.read_files` (what the files
hold) and `importer.write_bags`.

- The map: `import_map` reads which column is which signal, in which unit; `likely_columns` proposes
  a map by the names of columns, `stated_units` takes units that the file states.
- File formats: `columns` reads any of them, by `text`, `mat`, `numpy_file`, `hdf5` and `json_log`;
  `source` is what they share, `structures` finds names and units beside data, `table_head` reads
  the lines above a table in text. `record_file` reads one file and says what is doubtful in it.
- Stamps: `timing` decides when samples were taken and brings them onto an even grid by `stamps`;
  `rounded_stamps` finds the even samples behind coarse stamps, `clock_stamps` reads calendar and
  clock, `split_stamps` joins seconds and nanoseconds, `own_stamps` are of signals that were not
  sampled together; `part` cuts the part that is asked for, `refresh` finds signals that are
  refreshed more slowly than they are logged.
- Signals: `words` restores signs that a log left out, `wraps` turns that an encoder leaves out;
  `integrals` makes angles of speeds, `made_torque` the torque of a described controller;
  `known_torque` is what a robot model says that other axes and gravity need of the torque.
- The kind of run: `repetition` and `coherence` say whether a run is periodic and whether its
  signals belong together; `describe` tells repeats from realizations. `doubts` says what is
  evidently wrong, of which `impossible` is what no axis gives.
"""
