"""VTK. Locators and implicit distances are built anew; most queries are of one point."""

from __future__ import annotations

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

from scenes import Frame, Work

precision = {"": "double"}
update = "rebuild"
absent = {
    "winding numbers": "vtkSelectEnclosedPoints counts crossings of rays",
    "distance": "vtkDistancePolyDataFilter has distances at vertices only",
    "self-intersection": "vtkCollisionDetectionFilter is of two meshes",
    "self-contacts": "vtkCollisionDetectionFilter is of two meshes",
    "": "no such query",
}


def set_threads(threads: int) -> None:
    vtk.vtkSMPTools.Initialize(threads)


class _Mesh:
    """A vtkPolyData; update replaces its points."""

    def __init__(self, faces: np.ndarray):
        self.data = vtk.vtkPolyData()
        cells = vtk.vtkCellArray()
        offsets = np.arange(0, 3 * len(faces) + 1, 3)
        cells.SetData(
            numpy_to_vtkIdTypeArray(offsets.astype(np.int64), deep=True),
            numpy_to_vtkIdTypeArray(faces.ravel().astype(np.int64), deep=True),
        )
        self.data.SetPolys(cells)

    def update(self, positions: np.ndarray) -> vtk.vtkPolyData:
        points = vtk.vtkPoints()
        points.SetData(numpy_to_vtk(positions, deep=True))
        self.data.SetPoints(points)
        self.data.Modified()
        return self.data


def _locator(data: vtk.vtkPolyData) -> vtk.vtkStaticCellLocator:
    locator = vtk.vtkStaticCellLocator()
    locator.SetDataSet(data)
    locator.BuildLocator()
    return locator


def _closest(work: Work):
    """One call a point."""
    mesh, points = _Mesh(work.faces), work.points.tolist()

    def step(frame: Frame):
        locator = _locator(mesh.update(frame.first))
        nearest, cell = [0.0, 0.0, 0.0], vtk.reference(0)
        sub, squared, generic = vtk.reference(0), vtk.reference(0.0), vtk.vtkGenericCell()
        found = []
        for point in points:
            locator.FindClosestPoint(point, nearest, generic, cell, sub, squared)
            found.append(squared.get())
        return found

    return step, lambda found: np.sqrt(np.array(found))


def _implicit(work: Work):
    mesh = _Mesh(work.faces)
    points = numpy_to_vtk(work.points, deep=True)

    def step(frame: Frame):
        distance = vtk.vtkImplicitPolyDataDistance()
        distance.SetInput(mesh.update(frame.first))
        found = vtk.vtkDoubleArray()
        distance.FunctionValue(points, found)
        return vtk_to_numpy(found)

    return step


def _inside(work: Work):
    mesh, cloud = _Mesh(work.faces), vtk.vtkPolyData()
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(work.points, deep=True))
    cloud.SetPoints(points)

    def step(frame: Frame):
        enclosed = vtk.vtkSelectEnclosedPoints()
        enclosed.SetInputData(cloud)
        enclosed.SetSurfaceData(mesh.update(frame.first))
        enclosed.SetTolerance(1e-12)
        enclosed.Update()
        return vtk_to_numpy(enclosed.GetOutput().GetPointData().GetArray("SelectedPoints")).copy()

    return step


def _first_hits(work: Work):
    """A ray is a segment that is long enough; one call a ray."""
    mesh = _Mesh(work.faces)
    length = 100.0 * max(1.0, float(np.abs(work.frames[0].first).max()))
    ends = (work.origins + length * work.directions).tolist()
    origins = work.origins.tolist()

    def step(frame: Frame):
        locator = _locator(mesh.update(frame.first))
        t, x, parametric = vtk.reference(0.0), [0.0] * 3, [0.0] * 3
        sub, cell, generic = vtk.reference(0), vtk.reference(0), vtk.vtkGenericCell()
        found = []
        for a, b in zip(origins, ends):
            hit = locator.IntersectWithLine(a, b, 0.0, t, x, parametric, sub, cell, generic)
            found.append(length * t.get() if hit else np.inf)
        return np.array(found)

    return step


def _contacts(work: Work):
    first, second = _Mesh(work.faces), _Mesh(work.other_faces)
    identity = vtk.vtkMatrix4x4()

    def step(frame: Frame):
        collide = vtk.vtkCollisionDetectionFilter()
        collide.SetInputData(0, first.update(frame.first))
        collide.SetInputData(1, second.update(frame.second))
        collide.SetMatrix(0, identity)
        collide.SetMatrix(1, identity)
        collide.SetCollisionModeToAllContacts()
        collide.SetBoxTolerance(0.0)
        collide.SetCellTolerance(0.0)
        collide.Update()
        return [vtk_to_numpy(collide.GetContactCells(i)).copy() for i in (0, 1)]

    return step, lambda cells: np.unique(np.stack(cells, 1).reshape(-1, 2), axis=0)


answers = {
    "closest points": {
        "vtkStaticCellLocator": _closest,
        "vtkImplicitPolyDataDistance": lambda w: (_implicit(w), np.abs),
    },
    "inside": _inside,
    "first hits": _first_hits,
    "contacts": _contacts,
}
