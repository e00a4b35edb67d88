"""The stubs say what the module has."""

import ast
import os
import sys
import unittest

import pulson

BINDINGS = os.path.join(os.path.dirname(__file__), "..", "..", "bindings", "python")
sys.path.insert(0, os.path.join(BINDINGS, "tools"))


class Stubs(unittest.TestCase):
    def test_they_are_those_of_the_tables(self):
        import make_stubs
        with open(os.path.join(BINDINGS, "pulson", "__init__.pyi"), encoding="utf-8") as file:
            self.assertEqual(file.read(), make_stubs.stubs(), "run bindings/python/tools/make_stubs.py")

    def test_they_name_all(self):
        with open(os.path.join(BINDINGS, "pulson", "__init__.pyi"), encoding="utf-8") as file:
            names = {node.name for node in ast.parse(file.read()).body if hasattr(node, "name")}
        self.assertLessEqual(set(pulson.__all__), names)

    def test_members_are_there(self):
        import make_stubs
        for name, members in make_stubs._CLASSES.items():
            kind = getattr(pulson, name)
            if issubclass(kind, pulson.Result) and kind is not pulson.Registration:
                continue
            for member in members.split("; "):
                word = member.split(":")[0]
                self.assertTrue(not word or hasattr(kind, word) or word in ("notes",  "record", "summary"), f"{name}.{word}")


if __name__ == "__main__":
    unittest.main()
