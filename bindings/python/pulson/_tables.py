"""The files of a folder of results."""

import csv
import json
import os
from collections.abc import Mapping

import numpy as np


def _columns(text):
    """A csv file as a dictionary of columns: numbers where all are, NA being nan."""
    rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
    columns = {}
    for i, name in enumerate(rows[0] if rows else []):
        values = [row[i] if i < len(row) else "" for row in rows[1:]]
        try:
            columns[name] = np.array([float("nan") if value in ("NA", "") else float(value) for value in values])
        except ValueError:
            columns[name] = values
    return columns


class Tables(Mapping):
    """csv files by name, as columns."""

    def __init__(self, texts):
        self._texts = texts
        self._columns = {}

    def __getitem__(self, name):
        if name not in self._columns:
            self._columns[name] = _columns(self._texts[name])
        return self._columns[name]

    def __iter__(self):
        return iter(self._texts)

    def __len__(self):
        return len(self._texts)

    def text(self, name):
        """The file as it is."""
        return self._texts[name]

    def __repr__(self):
        return f"<Tables: {', '.join(self._texts)}>"


def collect(folder, record_name):
    """Record, tables and arrays of a folder of results."""
    with open(os.path.join(folder, record_name), encoding="utf-8") as file:
        record = json.load(file)
    tables, arrays = {}, {}
    for name in sorted(os.listdir(folder)):
        path = os.path.join(folder, name)
        if name.endswith(".npy"):
            arrays[name[:-4]] = np.load(path)
        elif name.endswith(".csv") and os.path.isfile(path):
            with open(path, encoding="utf-8", newline="") as file:
                tables[name] = file.read()
    return record, Tables(tables), arrays
