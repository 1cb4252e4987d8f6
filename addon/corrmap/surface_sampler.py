# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples of a view: the whole way from triangles to a `SurfaceBuffer`, for any camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..caching.framebuffer import DeepFramebuffer
from ..caching.plan import ChannelPlan
from ..caching.surface_edit_reach import materials_on, out_of_reach
from ..camplace.hole_cameras import HolePoints
from ..glsl.shader import read_texture
from ..progress import Progress, silent
from ..scene.exposure import Exposure
from ..scene.geometry import SceneGeometry
from ..scene.surface_edit import NO_EDITS, SurfaceEdits
from ..scene.view import View, same_view
from .bent_surfaces import BentSurfaces
from .confidence import Confidence, ConfidencePass
from .correspondence import (
    CorrespondenceMap,
    CorrespondencePass,
    Coverage,
    GatherPass,
    measure_coverage,
)
from .geometry_buffer import GeometryBuffer
from .local_scene import LocalScene
from .normal_bend import NormalBendPass
from .pixel_list_pass import PixelListTextures
from .shading_normals import ShadingNormalPass
from .shading_samples import ShadingSamples, fits_lists, objects_of
from .surface_buffer import SurfaceBuffer
from .surface_edit_table import SurfaceEditTable
from .surface_layout import SurfaceLayout
from .tile_pages import CACHE_BUDGET, TilePages, upload_tiles
from .traced_triangles import TrianglesByRay
from .view_looks import ViewLooks
from .visible_surface import VisibleSurface, VisibleSurfacePass, local_eye

_BYTES_PER_RGBA32F = 16
_BYTES_PER_R32F = 4
_BYTES_PER_RG32F = 8

# How far the eye may go from local space's origin, in widths of the nearest clip distance:
# float32 then still has a thousandth of that distance for its spacing.
_FARTHEST_EYE = 2.0**24 * 1e-3


class SurfaceSampler:
    """Keeps a scene and its cache on the GPU and looks at them from views.

    Samples of the current view are kept, up to `memory_budget` bytes, so that light edits do
    not find the surfaces again.

    Args:
        geometry: the scene's triangles.
        framebuffers: see `upload_tiles`.
        plan: of the cache.
        memory_budget: bytes of the GPU's memory for samples.
        cache_budget: bytes of the GPU's memory for the cache; a view that needs more takes more.
        drop: whether texels that no view would choose are left out.
        progress: is told how far loading the cache is.
    """

    def __init__(
        self,
        geometry: SceneGeometry,
        framebuffers: Sequence[DeepFramebuffer],
        plan: ChannelPlan,
        memory_budget: int = 512 << 20,
        cache_budget: int = CACHE_BUDGET,
        *,
        drop: bool = True,
        progress: Progress = silent,
    ) -> None:
        self._plan = plan
        self._pages: TilePages = upload_tiles(
            framebuffers, plan, cache_budget, drop=drop, progress=progress
        )
        self._framebuffers = framebuffers
        self._cache_budget = cache_budget
        self._drop = drop
        self._memory_budget = memory_budget
        self._view: View | None = None
        self._samples: dict[int, SurfaceBuffer] = {}
        self._shading: ShadingSamples | None = None
        # Visibility samples that were asked for, and what there is without lists.
        self._visibility = self._least_visibility = 0
        self._bent: tuple[GeometryBuffer, BentSurfaces | None] | None = None
        self._correspondence: CorrespondenceMap | None = None
        self._buffer: GeometryBuffer | None = None
        self._local_scene: LocalScene | None = None
        self._by_ray: TrianglesByRay | None = None
        self._exposure: Exposure | None = None
        self._edits = NO_EDITS
        self._edit_table: SurfaceEditTable | None = None
        self._material_table = self._pages.material_table
        self._layout = self._pages.surface_layout
        self.set_geometry(geometry)

    @property
    def layout(self) -> SurfaceLayout:
        """How the surfaces hold the plan's channels; another one once surfaces are edited."""
        return self._layout

    @property
    def pages(self) -> TilePages:
        """The GPU's copy of the cache."""
        return self._pages

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each thing that goes beyond what it may take, or that an edit of a
        surface cannot reach."""
        short = self._short_lists()
        excess = (*self._pages.warnings, *([short] if short else ()))
        if self._edits.is_neutral or self._edit_table is None:
            return excess
        on = materials_on(self._geometry, self._edits.objects)
        limits = out_of_reach(self._plan, self._edits, self._edit_table.mean, on)
        return (*excess, *limits)

    def _short_lists(self) -> str:
        """What the view's pixels lack of the visibility samples that were asked for; "" for
        nothing."""
        if self._view is None or not self._visibility:
            return ""
        width, height = self._view.width, self._view.height
        if not fits_lists(width, height):
            return (
                f"of {width}x{height} pixels no lists of shading samples can be made: edges are as "
                "smooth as the samples of the lights alone make them; for smoother ones take more "
                "samples, or render a region of the picture at a time"
            )
        found = self._visibility if self.lists is None else self.lists.lists.visibility
        if self._shading is not None and self._shading.has_given_up:
            found = self._least_visibility
        if found >= self._visibility:
            return ""
        return (
            "the pixels see so many surfaces, or so much of them through the lens or the shutter, "
            f"that they are made of {found} instead of {self._visibility} visibility samples; take "
            f"{self._visibility} samples, or render a region of the picture at a time"
        )

    @property
    def geometry(self) -> SceneGeometry:
        """The triangles, numbered with the cache's materials."""
        return self._geometry

    @property
    def geometry_buffer(self) -> GeometryBuffer:
        """The triangles on the GPU.

        Raises:
            RuntimeError: no view was set yet.
        """
        if self._buffer is None:
            raise RuntimeError("set a view first: local space lies at its camera")
        return self._buffer

    @property
    def local_scene(self) -> LocalScene:
        """The triangles for rays, in the space of `geometry_buffer`.

        Raises:
            RuntimeError: no view was set yet.
        """
        buffer = self.geometry_buffer
        if self._local_scene is None:
            self._local_scene = LocalScene(self._geometry, buffer.origin)
            self._by_ray = TrianglesByRay(buffer, self._local_scene)
        return self._local_scene

    def set_geometry(self, geometry: SceneGeometry) -> None:
        """Show other triangles through the same cache; the view must be set again."""
        number = {name: index for index, name in enumerate(self._plan.material_names)}
        unknown = len(self._plan.material_names)
        column = np.array(
            [number.get(name, unknown) for name in geometry.material_names], dtype=np.int32
        )
        # What the cache does not know is of one number: a mask would be that of all of it.
        masked = column < unknown if np.count_nonzero(column == unknown) > 1 else column >= 0
        self._geometry = replace(
            geometry,
            material_id=column[geometry.material_id],
            material_names=(*self._plan.material_names, ""),
            cutouts=tuple(
                replace(cutout, material_id=int(column[cutout.material_id]))
                for cutout in geometry.cutouts
                if masked[cutout.material_id]
            ),
            sheers=tuple(
                replace(sheer, material_id=int(column[sheer.material_id]))
                for sheer in geometry.sheers
                if masked[sheer.material_id]
            ),
            copies=tuple(
                replace(copies, material_id=column[copies.material_id])
                for copies in geometry.copies
            ),
        )
        self._buffer = self._local_scene = self._by_ray = None
        self._view = None
        self._exposure = None
        self._forget()
        self._apply_edits()

    def set_edits(self, edits: SurfaceEdits) -> bool:
        """Change surfaces as the edits say; False when they are what they were.

        The samples are kept: what is edited is edited where it is read. Without an edit that
        changes anything, `layout` and all that is made from it are as if there were none.
        """
        if edits == self._edits:
            return False
        self._edits = edits
        self._apply_edits()
        return True

    def _apply_edits(self) -> None:
        pages = self._pages
        if self._edits.is_neutral:
            self._material_table, self._layout = pages.material_table, pages.surface_layout
            return
        if self._edit_table is None:
            self._edit_table = SurfaceEditTable(pages.surface_layout, pages.material_table)
        names = self._geometry.object_names
        self._material_table, self._layout = self._edit_table.make(self._edits, names)

    def set_added(self, framebuffers: Sequence[DeepFramebuffer]) -> None:
        """Choose texels from these too, in place of those that were added before; the cache's own
        stay where they are. The view's samples are made anew.

        Raises:
            InputError: they do not fit the GPU; or a framebuffer has to be read again, and is
                damaged.
        """
        framebuffers = [picture for each in framebuffers for picture in each.pictures]
        if not self._pages.set_added(framebuffers):
            every = [*self._framebuffers, *framebuffers]
            self._pages = upload_tiles(every, self._plan, self._cache_budget, drop=self._drop)
        self._edit_table = self._bent = None
        self._apply_edits()
        self._forget()
        if self._buffer is not None:
            self._search(self._buffer)

    def set_view(self, view: View) -> bool:
        """Look from another camera; False when it is the same one."""
        if self._view is not None and same_view(self._view, view):
            return False
        self._view = view
        self._forget()
        if self._buffer is None or self._is_far(view):
            self._build(view)
        return True

    def set_exposure(self, exposure: Exposure | None) -> bool:
        """What moves while the shutter is open, as read for the geometry that is set; None for
        nothing. False when it is the same."""
        if exposure is self._exposure:
            return False
        self._exposure = exposure
        self._forget()
        return True

    @property
    def looks(self) -> ViewLooks:
        """The current view's samples.

        Raises:
            RuntimeError: no view was set yet.
        """
        if self._view is None:
            raise RuntimeError("set a view before looking at it")
        count = len(self._geometry.object_names)
        return ViewLooks(self._view, self._visible_pass, self._exposure, count)

    def sample(self, index: int, *, with_objects: bool = False) -> SurfaceBuffer:
        """Sample `index` of the current view; sample 0 is at the pixels' centres.

        Args:
            index: which.
            with_objects: whether it must have its `objects`.

        Raises:
            RuntimeError: no view was set yet.
        """
        if self._view is None:
            raise RuntimeError("set a view before sampling it")
        with_objects = with_objects or self._layout.edits_objects
        surface = self._samples.get(index)
        if surface is None:
            surface = self._gathered(index, self._view, with_objects)
        elif with_objects and surface.objects is None:
            # Of the triangles that are seen there, rasterized or not.
            surface = self._samples[index] = self._with_objects(surface)
        return self._laid_out(surface)

    def _with_objects(self, surface: SurfaceBuffer) -> SurfaceBuffer:
        assert surface.triangles is not None
        return replace(
            surface,
            objects=objects_of(self.geometry_buffer, surface.triangles.texture),
            before=tuple(self._with_objects(layer) for layer in surface.before),
        )

    def find_shading_samples(self, visibility: int, least: int = 1) -> bool:
        """Do the next step towards the current view's shading samples; False when there is none.

        Args:
            visibility: visibility samples of each pixel; 0 for no lists. A picture whose samples
                are too many to be numbered has none either.
            least: see `ShadingSamples`.

        Raises:
            RuntimeError: no view was set yet.
        """
        if self._view is None:
            raise RuntimeError("set a view before sampling it")
        view, self._visibility, self._least_visibility = self._view, visibility, least
        if not visibility or not fits_lists(view.width, view.height):
            return False
        if self._shading is None:
            self._shading = ShadingSamples(
                self.looks,
                (self._correspondence_pass, self._gather_pass),
                self._pages,
                self.geometry_buffer,
                visibility=visibility,
                least=least,
                memory_budget=self._memory_budget,
                bent=self._bent_surfaces(self.geometry_buffer),
            )
        return self._shading.step()

    def forget_shading_samples(self) -> None:
        """They are to be made of another number of visibility samples."""
        self._shading = None
        self._visibility = 0

    def _bent_surfaces(self, buffer: GeometryBuffer) -> BentSurfaces | None:
        """Those of the scene, found once for the triangles as they are numbered."""
        if self._bent is None or self._bent[0] is not buffer:
            table = read_texture(self._pages.material_table)
            layout = self._pages.surface_layout
            self._bent = buffer, BentSurfaces.of(self._geometry, buffer.codes, layout, table)
        return self._bent[1]

    @property
    def shading_progress(self) -> float:
        """What share of these steps is done."""
        return 0.0 if self._shading is None else self._shading.progress

    @property
    def lists(self) -> PixelListTextures | None:
        """What the pixels make of the shading samples, once these are found."""
        return None if self._shading is None else self._shading.lists

    def shading_sample(self, index: int, *, with_objects: bool = False) -> SurfaceBuffer:
        """The atlas of the shading samples for sample `index` of the lights.

        Raises:
            RuntimeError: they are not found yet.
        """
        if self._shading is None:
            raise RuntimeError("find the shading samples first")
        with_objects = with_objects or self._layout.edits_objects
        return self._laid_out(self._shading.sample(index, with_objects=with_objects))

    def _laid_out(self, surface: SurfaceBuffer) -> SurfaceBuffer:
        """The same, read as the edits say."""
        if self._layout is self._pages.surface_layout:
            return surface
        return replace(
            surface,
            material_table=self._material_table,
            layout=self._layout,
            before=tuple(self._laid_out(layer) for layer in surface.before),
        )

    def _gathered(self, index: int, view: View, with_objects: bool) -> SurfaceBuffer:
        """A sample as the cache has it, kept if there is room."""
        visible = self._visible(index, view, with_objects)
        surface, correspondence = self._read(visible)
        if visible.before:
            layers = (self._read(layer)[0] for layer in visible.before)
            before = tuple(replace(layer, is_layer=True) for layer in layers)
            surface = replace(surface, before=before)
        surface = replace(surface, around=self.looks.around(index))
        if index == 0:
            self._correspondence = correspondence
        # Position, normals, how these turn, values, and the correspondence map once.
        more = (surface.bend is not None) + (surface.shading_normal is not None)
        textures = 3 + more + self.layout.texture_count
        pixels = view.width * view.height * len(self._samples) * (1 + len(surface.before))
        numbers = _BYTES_PER_RG32F + with_objects * _BYTES_PER_R32F
        kept = pixels * (textures * _BYTES_PER_RGBA32F + numbers)
        if kept < self._memory_budget:
            self._samples[index] = surface
        return surface

    def _read(self, visible: VisibleSurface) -> tuple[SurfaceBuffer, CorrespondenceMap]:
        """What the cache says of what is seen."""
        correspondence = self._correspondence_pass.draw(visible)
        if self._pages.is_paged:
            self._pages.bring(correspondence.read())
        surface = self._gather_pass.draw(visible, correspondence)
        return replace(surface, through=visible.through), correspondence

    def _visible(self, index: int, view: View, with_objects: bool) -> VisibleSurface:
        """What a sample sees. The first picture of a view, which stays for a moment, need not be
        that of the rasterizer where rays are faster."""
        sample = self.looks.sample(index)
        if index == 0 and sample.moved is None and self._by_ray is not None:
            seen = self._visible_pass.draw_traced(
                sample.view,
                sample.offset,
                self._by_ray,
                with_objects=with_objects,
                normals=self._gather_pass.has_normals,
                bends=self._gather_pass.has_bends,
            )
            if seen is not None:
                return replace(seen, eye=local_eye(view, self._visible_pass.origin))
        return self.looks.visible(index, with_objects=with_objects)

    def correspondence(self) -> CorrespondenceMap:
        """The correspondence map at the pixels' centres."""
        self.sample(0)
        if self._correspondence is None:
            raise RuntimeError("sample 0 left no correspondence map")
        return self._correspondence

    def confidence(self) -> Confidence:
        """How far the values at the pixels' centres may be trusted."""
        surface, found = self.sample(0), self.correspondence()
        assert self._view is not None
        return ConfidencePass(self._pages, surface.origin).draw(self._view, surface, found)

    def hole_points(self, *, and_soft: bool = False) -> HolePoints:
        """What the view sees at its pixels' centres, sheer layers too, and where the cache does
        not show it; and where it shows it with fewer texels than there are pixels, if that is
        asked. Sheer layers do not count as soft: what lies behind them does."""
        surface = self.sample(0)
        places, holes, soft = [], [], []
        for each in (surface, *surface.before):
            position = read_texture(each.position).astype(np.float64)
            hit = position[..., 3] > 0.0
            places.append(position[hit][:, :3] + surface.origin)
            holes.append(read_texture(each.geometric_normal)[..., 3][hit] <= 0.0)
            if and_soft:
                of = self.confidence().soft() if each is surface else np.zeros_like(hit)
                soft.append(of[hit])
        is_soft = np.concatenate(soft) if and_soft else None
        return HolePoints(np.concatenate(places), np.concatenate(holes), is_soft)

    def coverage(self) -> Coverage:
        """Holes at the pixels' centres."""
        return measure_coverage(self.sample(0))

    def _forget(self) -> None:
        self._samples.clear()
        self.forget_shading_samples()
        self._correspondence = None

    def _is_far(self, view: View) -> bool:
        """Whether local space's origin is so far that float32 would show."""
        if self._buffer is None:
            return True
        away = float(np.linalg.norm(view.origin - self._buffer.origin))
        return away > _FARTHEST_EYE * _near_clip(view)

    def _build(self, view: View) -> None:
        # Local space has its origin at the view, where precision matters most.
        copies = None if self._buffer is None else self._buffer.copies
        meshes = None if copies is None else copies.meshes
        self._buffer = GeometryBuffer(self._geometry, view.origin, meshes)
        self._local_scene = self._by_ray = self._bent = None
        self._visible_pass = VisibleSurfacePass(self._buffer)
        self._search(self._buffer)

    def _search(self, buffer: GeometryBuffer) -> None:
        """Make the passes that look for texels in the pages."""
        origin = buffer.origin
        self._correspondence_pass = CorrespondencePass(self._pages, origin)
        # Only where some material has the normals of the mesh, and some of these are smooth.
        is_smooth = self._geometry.corner_normals is not None
        layout = self._pages.surface_layout
        normals = ShadingNormalPass(buffer) if is_smooth and layout.mesh_normals else None
        shines = is_smooth and layout.has("HAS_SPECULAR")
        bends = NormalBendPass(buffer) if shines else None
        self._gather_pass = GatherPass(self._pages, origin, normals, bends)


def _near_clip(view: View) -> float:
    """Metres from the camera to its near plane (from the projection matrix)."""
    c = view.clip_from_camera
    if view.perspective:
        return float(c[2, 3] / (c[2, 2] - 1.0))
    return float(abs(2.0 / c[1, 1])) / view.height
