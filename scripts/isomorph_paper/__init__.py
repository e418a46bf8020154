"""The paper's tables and figures on our sequences. `scripts/paper.py` is the command.

sequences.py    .anime files, frames, volumes; PLY and CSV files
degrade.py      what is done to the inputs: swapped pairs, sparse and incomplete clouds
topology.py     two feet that merge: a sequence whose ends differ in topology
experiments.py  the table of all experiments: data, not code
inputs.py       makes the input files that a row of an experiment asks for
runs.py         calls `isomorph compare` and reads what it measured
compact.py      all of it in one JSON file, from which tables and figures are made
command_line.py options that several commands share
report.py       tables        figures.py  pictures        record.py  how it was made
"""


class PaperError(Exception):
    """Something that the user can put right; the message says how."""
