"""Programs that other bakers' own interpreters run: each reads a mesh, bakes it as its users would, and stores AO.

    python PROGRAM MESH.npz OUTPUT.npy MAX_DISTANCE EFFORT [WAY]

MESH.npz holds `positions` (n, 3) float64 and `faces` (m, 3) int32. OUTPUT.npy gets AO at the vertices, shape (n,), or
at the corners of the faces, shape (m, 3). The last line printed is the seconds from the mesh's file to the stored
result; starting the interpreter and importing its libraries do not count. A program that is not installed exits with
code 3.
"""
