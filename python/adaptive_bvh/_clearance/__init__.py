"""The tool `adaptive_bvh clearance`: the least clearance of moving bodies over their motion.

| module | holds |
| --- | --- |
| `_arguments`, `_lengths` | the command line; lengths with units |
| `_inputs`, `_opening` | what the arguments name, opened: which files are a body or a part |
| `_frames` | a frame of a sequence, and how its vertices are joined; tables |
| `_rotations` | rotations of bodies, screws |
| `_files`, `_ply` | sequences of numbered files |
| `_arrays`, `_gltf` | sequences in one file: .npz, .pc2, animations of glTF |
| `_poses` | a mesh and its poses |
| `_motion` | the queries between two frames |
| `_search`, `_couples` | the search over all frames: of a body and the parts, of two moving bodies |
| `_settings`, `_results` | what a search is asked for, and what it finds |
| `_run`, `_progress` | a whole run: threads, Ctrl-C, time left |
| `_command`, `_table`, `_messages` | one run of the command: its text, the CSV file, what it says on stderr |
| `_report`, `_report_html` | the page |
| `_study`, `_study_page` | many motions, on Dask |
"""

from ._command import main

__all__ = ["main"]
