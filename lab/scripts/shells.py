"""Writes two cubes as an OBJ file, of which the second is inside out: pictures of docs/meshes.md.

    python lab/scripts/shells.py shells.obj
"""

import sys

SIDES = [[1, 4, 3, 2], [5, 6, 7, 8], [1, 2, 6, 5], [2, 3, 7, 6], [3, 4, 8, 7], [4, 1, 5, 8]]
CORNERS = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]

with open(sys.argv[1], "w") as file:
    for first, shift, step in ((0, 0, 1), (8, 1.5, -1)):
        file.writelines(f"v {x + shift} {y} {z}\n" for x, y, z in CORNERS)
        file.writelines("f " + " ".join(str(first + corner) for corner in side[::step]) + "\n" for side in SIDES)
