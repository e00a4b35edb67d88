"""What the tests of the module share: the program beside it, and shapes."""

import json
import os
import subprocess
import tempfile
import unittest

import numpy as np

PROGRAM = os.environ.get("PULSON_PROGRAM", "pulson")
SAMPLES = os.path.join(os.path.dirname(__file__), "..", "..", "sample_shapes")

# What two runs of one task differ in.
_VOLATILE = {"seconds", "files", "command", "threads", "target_name", "version", "notes", "run"}


def sample(name):
    return os.path.join(SAMPLES, name)


def run(*words):
    """Runs the program, which must end well or unconverged."""
    done = subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 3):
        raise AssertionError(f"{words}: {done.returncode}, {done.stderr}")
    return done


def refusal(*words):
    done = subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode != 2:
        raise AssertionError(f"{words}: {done.returncode}")
    return done.stderr


def record_of(folder, name):
    with open(os.path.join(folder, name), encoding="utf-8") as file:
        return json.load(file)


def without(record, more=()):
    """A record without times and names of files."""
    dropped = _VOLATILE | set(more)
    if isinstance(record, dict):
        return {key: without(value, more) for key, value in record.items() if key not in dropped}
    if isinstance(record, list):
        return [without(value, more) for value in record]
    return record


class InFolder(unittest.TestCase):
    """A test with a folder of its own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="pulson-test-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def npy(self, name, array):
        np.save(self.path(name), array)
        return self.path(name)

    def assert_same(self, ours, theirs):
        """The same bits, or both nan."""
        ours, theirs = np.asarray(ours, dtype=float), np.asarray(theirs, dtype=float)
        self.assertEqual(ours.shape, theirs.shape)
        self.assertTrue(np.array_equal(ours, theirs, equal_nan=True), f"{ours} is not {theirs}")
