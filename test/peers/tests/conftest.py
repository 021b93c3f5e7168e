"""Tests of what plugs into other libraries: test/peers/tests.sh. A library that is not installed
skips its tests with a message. Data of others lie in folders: IPCTK_DATA (meshes of
ipc-toolkit-tests-data), TRIMESH_MODELS (trimesh's models), PEERS_DATA (frames of simulations)."""

import os
import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))  # scenes.py


def folder(variable):
    """A folder that a variable names; skips the test where it names none."""
    path = os.environ.get(variable)
    if not path or not os.path.isdir(path):
        pytest.skip(f"{variable} names no folder")
    return pathlib.Path(path)


@pytest.fixture
def ipctk_data():
    return folder("IPCTK_DATA")
