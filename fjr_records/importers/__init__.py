"""Records of rigs without ROS, of any excitation, turned into bags of the interface.

Files and a map of columns go in, bags come out. Begin with `importer.read_files` (what the files
hold) and `importer.write_bags`; `columns` reads any format, `stamps` brings it onto an even grid,
`repetition` and `coherence` say what kind of run it is, `describe` tells repeats from realizations.
"""
