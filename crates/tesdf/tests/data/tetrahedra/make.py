"""Makes the files of this folder: a cylinder of 60 tetrahedra, written by Gmsh.

    pip install gmsh==4.15.2
    python make.py

Gmsh writes 16 digits as text, so its binary files differ from those in the last bit.
"""
import gmsh

gmsh.initialize(["gmsh", "-v", "1", "-nt", "1"])
gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, 1, 0.5)
gmsh.model.occ.synchronize()
gmsh.model.addPhysicalGroup(3, [1], 7, name="solid")
gmsh.option.setNumber("Mesh.MeshSizeMin", 0.9)
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.9)
gmsh.option.setNumber("Mesh.SaveAll", 1)
gmsh.model.mesh.generate(3)


def save_msh(name, version, binary, parametric=0):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.option.setNumber("Mesh.SaveParametric", parametric)
    gmsh.write(name)


save_msh("v22.msh", 2.2, 0)
save_msh("v22_binary.msh", 2.2, 1)
save_msh("v41.msh", 4.1, 0)
save_msh("v41_binary.msh", 4.1, 1)
save_msh("v41_parametric.msh", 4.1, 0, 1)
save_msh("v41_binary_parametric.msh", 4.1, 1, 1)
gmsh.model.mesh.setOrder(2)
save_msh("second_order.msh", 4.1, 0)
save_msh("second_order_v22_binary.msh", 2.2, 1)
