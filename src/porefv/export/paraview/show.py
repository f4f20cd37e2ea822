"""Show results of porefv in ParaView: grains, pores by pressure, throats as wide as their flux.

Run it in ParaView by Macros > Import New Macro, or View > Python Shell > Run Script, or without a window::

    pvpython --force-offscreen-rendering show.py --picture view.png --state view.pvsm --film film.avi

`RESULTS` is the directory of `porefv solve` or `porefv simulate`. Lengths are taken from the files, so that packings
of any size are drawn as well. This file is run by ParaView's Python, which has no porefv.
"""

from __future__ import annotations

import argparse
import os
from typing import Any

from paraview import simple as pv

RESULTS = "results"

# Part of the size of the box that grains are cut behind the pores, so that their caps are seen.
_BEHIND = 2.0e-3
_GREY = [0.75, 0.73, 0.70]


def show(results: str) -> Any:
    """Open the files of a results directory and make a view of them; the view."""
    frames = os.path.join(results, "frames")
    if os.path.isfile(os.path.join(frames, "grains.pvd")):
        grains, pores, throats = (_source(frames, f"{name}.pvd") for name in ("grains", "pores", "throats"))
    else:
        grains = _source(results, "spheres.vtp")
        pores, throats = _source(results, "pores.vtu"), _source(results, "throats.vtp")
    if grains is None:
        raise SystemExit(f"{results} has neither spheres.vtp nor frames/grains.pvd: ask for them in [output]")
    scene = pv.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    view = pv.GetActiveViewOrCreate("RenderView")
    times = [time for source in (grains, pores, throats) if source is not None for time in _times(source)]
    last = max(times, default=0.0)
    scene.AnimationTime = last
    for source in (grains, pores, throats):
        if source is not None:
            source.UpdatePipeline(last)  # the ranges of colours are those of the last time
    view.ViewSize = [1200, 900]
    view.UseColorPaletteForBackground = 0
    view.Background = [1.0, 1.0, 1.0]
    view.OrientationAxesLabelColor = [0.1, 0.1, 0.1]
    bounds = (pores or grains).GetDataInformation().GetBounds()
    size = [bounds[2 * k + 1] - bounds[2 * k] for k in range(3)]
    middle = [0.5 * (bounds[2 * k] + bounds[2 * k + 1]) for k in range(3)]
    _show_grains(view, grains, pores is not None, middle, size)
    if pores is not None:
        _show_pores(view, pores, middle)
    if throats is not None:
        _show_throats(view, throats)
    view.CameraFocalPoint = middle
    view.CameraPosition = [middle[0] - 3.0 * size[0], middle[1] - 1.2 * size[1], middle[2] + 1.1 * size[2]]
    view.CameraViewUp = [0.0, 0.0, 1.0]
    pv.Render(view)
    pv.ResetCamera(view)
    return view


def _source(directory: str, name: str) -> Any:
    path = os.path.join(directory, name)
    if not os.path.isfile(path):
        return None
    source = pv.OpenDataFile(path)
    pv.RenameSource(name, source)
    return source


def _times(source: Any) -> list[float]:
    """Times of the frames of a .pvd; none of a file."""
    return list(source.TimestepValues) if hasattr(source, "TimestepValues") else []


def _show_grains(view: Any, grains: Any, cut: bool, middle: list[float], size: list[float]) -> None:
    """Spheres coloured by the force of the fluid; the half behind the middle, capped, where pores are shown."""
    balls = pv.Glyph(registrationName="grains", Input=grains, GlyphType="Sphere")
    balls.GlyphType.Radius = 1.0
    balls.GlyphType.ThetaResolution = balls.GlyphType.PhiResolution = 24
    balls.OrientationArray = ["POINTS", "No orientation array"]
    balls.ScaleArray = ["POINTS", "radius"]
    balls.ScaleFactor = 1.0
    balls.GlyphMode = "All Points"
    if cut:
        halves = pv.ClipClosedSurface(registrationName="cut grains", Input=balls)
        halves.ClippingPlane.Origin = [middle[0] - _BEHIND * size[0], middle[1], middle[2]]
        halves.ClippingPlane.Normal = [1.0, 0.0, 0.0]
        pv.Hide(balls, view)
        display = pv.Show(halves, view)
        display.ColorArrayName = ["POINTS", ""]
        display.DiffuseColor = display.AmbientColor = _GREY
        return
    display = pv.Show(balls, view)
    names = grains.PointData.keys()
    force = next((name for name in ("fluid_force", "total_force", "contact_force") if name in names), None)
    if force is not None:
        _colour(view, display, "POINTS", force, "Inferno (matplotlib)", "N")


def _show_pores(view: Any, pores: Any, middle: list[float]) -> None:
    """The half behind the middle, coloured by pressure."""
    half = pv.Clip(registrationName="cut pores", Input=pores, ClipType="Plane")
    half.ClipType.Origin = middle
    half.ClipType.Normal = [1.0, 0.0, 0.0]
    half.Invert = 0
    display = pv.Show(half, view)
    if pores.CellData.GetArray("pressure") is not None:
        _colour(view, display, "CELLS", "pressure", "Viridis (matplotlib)", "Pa")
        display.Ambient, display.Diffuse = 0.5, 0.5  # a colour of the pores is that of the bar


def _show_throats(view: Any, throats: Any) -> None:
    """Tubes as wide as the flux, of the throats that carry more than a twentieth of the largest; hidden at first."""
    name = "flux_magnitude"
    if throats.CellData.GetArray(name) is None:
        return
    most = throats.CellData[name].GetRange()[1]
    if not most > 0.0:
        return
    strong = pv.Threshold(registrationName="strong throats", Input=throats, Scalars=["CELLS", name])
    strong.ThresholdMethod, strong.LowerThreshold = "Above Upper Threshold", 0.0
    strong.UpperThreshold = 0.05 * most
    surface = pv.ExtractSurface(registrationName="lines", Input=strong)
    points = pv.CellDatatoPointData(registrationName="on points", Input=surface)
    points.ProcessAllArrays = 1
    points.PassCellData = 1
    tubes = pv.Tube(registrationName="tubes", Input=points, Scalars=["POINTS", name], VaryRadius="By Scalar")
    tubes.NumberofSides = 16
    tubes.Radius = 0.03 * throats.CellData["inscribed_radius"].GetRange()[1]
    tubes.RadiusFactor = 10.0
    display = pv.Show(tubes, view)
    _colour(view, display, "CELLS", name, "Viridis (matplotlib)", "m3/s", "Upper Right Corner")
    pv.Hide(tubes, view)


def _colour(
    view: Any, display: Any, place: str, name: str, colours: str, unit: str, corner: str = "Lower Right Corner"
) -> None:
    pv.ColorBy(display, (place, name))
    display.RescaleTransferFunctionToDataRange(False, True)
    table = pv.GetColorTransferFunction(name)
    table.ApplyPreset(colours, True)
    table.NanColor = _GREY
    bar = pv.GetScalarBar(table, view)
    bar.Title, bar.ComponentTitle = f"{name} [{unit}]", ""
    bar.WindowLocation = corner
    bar.TitleColor = bar.LabelColor = [0.1, 0.1, 0.1]
    display.SetScalarBarVisibility(view, True)


def main() -> None:
    """Show results, and write what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--results", default=RESULTS, help=f"results directory, {RESULTS} by default")
    parser.add_argument("--picture", help="PNG file to write")
    parser.add_argument("--throats", action="store_true", help="show the throats in place of grains and pores")
    parser.add_argument("--state", help="state (.pvsm) to write, for File > Load State")
    parser.add_argument("--film", help="film of all frames to write: .avi or .ogv, or .png for a picture of each")
    options, _ = parser.parse_known_args()  # in its window, ParaView has arguments of its own
    view = show(os.path.abspath(options.results))
    if options.throats:
        for name, shown in (("cut grains", False), ("cut pores", False), ("tubes", True)):
            source = pv.FindSource(name)
            if source is not None:
                (pv.Show if shown else pv.Hide)(source, view)
                display = pv.GetDisplayProperties(source, view)
                if display.ColorArrayName[1]:
                    display.SetScalarBarVisibility(view, shown)
        pv.ResetCamera(view)
    if options.picture:
        pv.SaveScreenshot(options.picture, view)
    if options.state:
        pv.SaveState(options.state)
    if options.film:
        pv.SaveAnimation(options.film, view, FrameRate=10)


main()
