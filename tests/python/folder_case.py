"""Tests that write files."""

import os
import tempfile
import unittest


class FolderCase(unittest.TestCase):
    """folder: name of a folder of the test, removed after it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)
