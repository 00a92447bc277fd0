"""Makes the files of this folder: a cylinder of 60 tetrahedra, written by Gmsh, VTK and meshio.

    pip install gmsh==4.15.2 vtk==9.7.2 meshio==5.3.5
    python make.py

Gmsh writes 16 digits as text, so its binary files differ from those in the last bit; the VTU files hold what v22.msh does.
"""
import gmsh
import meshio
import vtk

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

mesh = meshio.read("v22.msh")
grid = vtk.vtkUnstructuredGrid()
points = vtk.vtkPoints()
points.SetDataTypeToDouble()
for p in mesh.points:
    points.InsertNextPoint(*p)
grid.SetPoints(points)
for block in mesh.cells:
    kind = {"vertex": 1, "line": 3, "triangle": 5, "tetra": 10}[block.type]
    for cell in block.data:
        ids = vtk.vtkIdList()
        for i in cell:
            ids.InsertNextId(int(i))
        grid.InsertNextCell(kind, ids)


def save_vtu(name, mode, zlib, *, base64=True, wide=False, big_endian=False):
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetFileName(name)
    getattr(writer, f"SetDataModeTo{mode}")()
    writer.SetCompressorTypeToZLib() if zlib else writer.SetCompressorTypeToNone()
    writer.SetEncodeAppendedData(base64)
    writer.SetHeaderTypeToUInt64() if wide else writer.SetHeaderTypeToUInt32()
    writer.SetByteOrderToBigEndian() if big_endian else writer.SetByteOrderToLittleEndian()
    if zlib:
        writer.SetBlockSize(512)
    writer.Write()


save_vtu("ascii.vtu", "Ascii", False)
save_vtu("base64.vtu", "Binary", False)
save_vtu("base64_zlib.vtu", "Binary", True)
save_vtu("base64_u64_big_endian.vtu", "Binary", False, wide=True, big_endian=True)
save_vtu("appended_base64.vtu", "Appended", False)
save_vtu("appended_base64_zlib.vtu", "Appended", True, wide=True)
save_vtu("appended_raw.vtu", "Appended", False, base64=False, wide=True)
save_vtu("appended_raw_zlib.vtu", "Appended", True, base64=False)
tetrahedra = [block for block in mesh.cells if block.type == "tetra"]
meshio.write("meshio.vtu", meshio.Mesh(mesh.points, tetrahedra), binary=True)
