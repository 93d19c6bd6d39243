"""Files of other programs as run files: what is not stated is guessed and shown, and everything is checked."""

from rigctl.foreign_endings import ENDINGS
from rigctl.foreign_files.choice import CHANNELS, Choice, ColumnChoice, choice_from, column_choice
from rigctl.foreign_files.files import import_file, import_tables
from rigctl.foreign_files.headings import Head, split_heading
from rigctl.foreign_files.imported import ColumnTaken, Imported
from rigctl.foreign_files.mapping import Mapping, Rule, read_mapping
from rigctl.foreign_files.table import Table, Values

__all__ = [
    "CHANNELS",
    "ENDINGS",
    "Choice",
    "ColumnChoice",
    "ColumnTaken",
    "Head",
    "Imported",
    "Mapping",
    "Rule",
    "Table",
    "Values",
    "choice_from",
    "column_choice",
    "import_file",
    "import_tables",
    "read_mapping",
    "split_heading",
]
