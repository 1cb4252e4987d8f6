# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface that each pixel of a view sees (paper III.3, first step).

The paper projects a depth map back into the scene; here the rasterizer hands over position,
normal and material themselves, which costs nothing more and loses no precision.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camplace.parallel import in_parts
from ..glsl.shader import GlslType, PassShader, Texture, framebuffer, source, texture_2d
from ..scene.octahedral import GLSL as OCTAHEDRAL_GLSL
from ..scene.view import View
from .geometry_buffer import GeometryBuffer
from .pixel_bend import BEND_GLSL, BEND_LIBRARY, LOOK_BLOCK, look_uniforms
from .pixel_rays import RAY_BLOCK, clip_range, pixel_rays
from .pose_table import POSE_DEFINES, POSE_LIBRARY, POSE_SAMPLERS, upload_poses
from .raster_program import build_raster_program
from .seen_triangle import seen_textures, with_seen_triangle
from .seen_triangles import RayHits, SeenTriangles
from .sheer_layers import SheerLayersPass
from .traced_triangles import TrianglesByRay
from .triangle_codes import TriangleCodes

# First which triangle each pixel sees, then its surface: what lies hidden costs no more than a
# number, and nothing but positions has to pass through the vertex stage.
_TRIANGLE_PASS = PassShader(
    name="visible_triangle",
    fragment="visible_triangle",
    library=("view_depth",),
    blocks=(RAY_BLOCK,),
    outputs=(("VEC2", "visible_triangle"),),
    writes_depth=True,
)
_EXACT_TRIANGLE_PASS = replace(
    _TRIANGLE_PASS,
    name="visible_triangle_exact",
    library=("pixel_ray", "view_depth"),
    defines=(("EXACT_DEPTH", "1"),),
)
_PASS = PassShader(
    name="visible_surface",
    fragment="visible_surface",
    blocks=(RAY_BLOCK,),
    library=("pixel_ray",),
    samplers=(
        ("visible_triangle", "FLOAT_2D"),
        ("visible_depth", "DEPTH_2D"),
    ),
    outputs=(("VEC4", "visible_position"), ("VEC4", "visible_normal")),
)
_TRACED_PASS = replace(
    _PASS,
    name="visible_surface_traced",
    samplers=(
        ("visible_triangle", "FLOAT_2D"),
        ("visible_depth", "FLOAT_2D"),
    ),
    defines=(("HAS_TRACED_DEPTH", "1"),),
)

# A triangle that reaches behind the viewer is clipped at the near plane, and 1 / w interpolated
# from there: a depth of z is then off by z / near spacings of float32. From here on, where that
# is a thousandth at the scene's far end, depth is taken from the triangle's plane instead.
_FARTHEST_INTERPOLATED = 2.0**24 * 1e-3

# Pixels at once: they stay in the processor's cache.
_PART = 1 << 14


@dataclass(frozen=True)
class VisibleSurface:
    """One sample of the view, before anything was read from the cache.

    Attributes:
        position: RGBA32F, xyz local position in metres, w = 1 + material id or 0 for nothing.
        normal: RGBA32F, xyz unit geometric normal that faces the viewer.
        eye: (4,) float64: the camera's local place with w = 1, or for a parallel projection
            the unit direction toward the camera with w = 0.
        triangles: RG32F, `TriangleCodes`.
        objects: R32F, 1 + object id (exact: fewer than 2^24), 0 for nothing; if asked for.
        codes: what these stand for, if that is known.
        pixel: width of a pixel in metres, 1 m from the eye or of a parallel projection; 0 where
            that is not known.
        hits: where it was found by rays.
        through: RGBA32F, the share of its light that sheer layers before it let through; None for
            all.
        before: these layers, nearest first.
        shading_normal: as `ShadingNormalPass.draw`, where it was found along with the rest.
        bend: as `NormalBend.texture` for one sample, likewise.
    """

    position: Texture
    normal: Texture
    eye: NDArray[np.float64]
    triangles: Texture
    objects: Texture | None = None
    codes: TriangleCodes | None = None
    pixel: float = 0.0
    hits: RayHits | None = None
    through: Texture | None = None
    before: tuple[VisibleSurface, ...] = ()
    shading_normal: Texture | None = None
    bend: Texture | None = None

    def scene_triangles(self) -> NDArray[np.int64]:
        """(H, W) the scene's triangle that each pixel sees, -1 for nothing.

        Raises:
            ValueError: it is not known what their codes stand for.
        """
        if self.seen_triangles is None:
            raise ValueError("these triangles are of no known scene")
        return self.seen_triangles.read()

    @property
    def seen_triangles(self) -> SeenTriangles | None:
        """The triangles for `SurfaceBuffer`; None where it is not known what they are a number
        of."""
        if self.codes is None:
            return None
        return SeenTriangles(self.triangles, self.codes, self.hits)


class VisibleSurfacePass:
    """Rasterizes views of one scene."""

    def __init__(self, geometry: GeometryBuffer) -> None:
        self._geometry = geometry
        self._sheer = SheerLayersPass(geometry) if geometry.has_sheer else None

    def draw(
        self,
        view: View,
        offset: tuple[float, float] = (0.0, 0.0),
        *,
        with_objects: bool = False,
        moved: NDArray[np.float64] | None = None,
    ) -> VisibleSurface:
        """The surfaces at the pixels' centres, moved by `offset` pixels (x, y).

        With `moved`, (O, 4, 4) world space, the view sees each object's points there, and what
        comes out is where the geometry has them, and which way they face there.
        """
        width, height, geometry = view.width, view.height, self._geometry
        triangles = texture_2d(width, height, "RG32F")
        depth = texture_2d(width, height, "DEPTH_COMPONENT32F")
        target = framebuffer([triangles], depth)
        exact = self._needs_exact_depth(view)
        program = build_raster_program(
            _EXACT_TRIANGLE_PASS if exact else _TRIANGLE_PASS,
            geometry.has_cutouts,
            numbers_triangles=True,
            reads_planes=exact,
            has_poses=moved is not None,
            with_copies=geometry.copies is not None,
        )
        poses = {} if moved is None else {"pose_table": upload_poses(moved, geometry.origin)}
        rays = pixel_rays(view, geometry.origin, geometry.bounds, offset)
        matrix = clip_from_local(view, geometry.origin, offset)
        with target.bind():
            target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
            geometry.draw(program, matrix, "camera", poses, {"ray": rays})
        resolve = _PASS if moved is None else _with_poses(_PASS)
        seen = (triangles, depth)
        drawn = self._resolve(resolve, view, rays, seen, poses, with_objects=with_objects)
        if self._sheer is None:
            return drawn
        layers, through = self._sheer.peel(matrix, rays, depth, poses, exact=exact)
        before = []
        for layer in layers:
            seen = (layer.triangles, layer.depth)
            whole = self._resolve(resolve, view, rays, seen, poses, with_objects=with_objects)
            before.append(replace(whole, through=layer.through))
        return replace(drawn, through=through, before=tuple(before))

    def draw_traced(
        self,
        view: View,
        offset: tuple[float, float],
        by_ray: TrianglesByRay,
        *,
        with_objects: bool = False,
        normals: bool = False,
        bends: bool = False,
    ) -> VisibleSurface | None:
        """The same by rays, where that is faster and as exact: but for pixels at outlines all is
        equal. None where it is not.

        With `normals` and `bends` it has its `shading_normal` and `bend`: what a triangle's corners
        are is found once.
        """
        if not by_ray.pays or self._needs_exact_depth(view):
            return None
        rays = pixel_rays(view, self._geometry.origin, self._geometry.bounds, offset)
        found = by_ray.find(view, rays)
        seen = (found.triangles, found.depth)
        resolve = _with_corners(_TRACED_PASS, normals=normals, bends=bends)
        drawn = self._resolve(resolve, view, rays, seen, {}, with_objects=with_objects)
        if drawn.shading_normal is None:
            return replace(drawn, hits=found.hits)
        # Read before anything else is drawn, which a reader would wait for.
        shaded = _first_three(drawn.shading_normal)
        return replace(drawn, hits=replace(found.hits, shaded=shaded))

    def _resolve(
        self,
        resolve: PassShader,
        view: View,
        rays: dict[str, Any],
        seen: tuple[Texture, Texture],
        poses: dict[str, Texture],
        *,
        with_objects: bool,
    ) -> VisibleSurface:
        """The surfaces of triangles that are seen, at depths."""
        geometry, size = self._geometry, (view.width, view.height)
        triangles, depth = seen
        description = _with_objects(resolve) if with_objects else resolve
        corners = ("HAS_CORNERS", "1") in description.defines
        asked = {"plane": True, "ids": True, "corners": corners}
        made = {
            name: texture_2d(*size, "R32F" if kind == "FLOAT" else "RGBA32F")
            for kind, name in description.outputs
        }
        eye, pixel = local_eye(view, geometry.origin), _pixel_width(view)
        look = {"look": look_uniforms(eye, pixel)} if "normal_bend" in made else {}
        has_copies = geometry.copies is not None
        with_seen_triangle(description, has_copies, **asked).build().draw_fullscreen(
            framebuffer(list(made.values())),
            {
                "visible_triangle": triangles,
                "visible_depth": depth,
                **seen_textures(geometry, **asked),
                **poses,
            },
            {"ray": rays, **look},
        )
        return VisibleSurface(
            made["visible_position"],
            made["visible_normal"],
            eye,
            triangles,
            made.get("visible_object"),
            geometry.codes,
            pixel,
            shading_normal=made.get("visible_shading_normal"),
            bend=made.get("normal_bend"),
        )

    @property
    def origin(self) -> NDArray[np.float64]:
        """(3,) world space: where local space has its origin."""
        return self._geometry.origin

    def _needs_exact_depth(self, view: View) -> bool:
        """Whether interpolated depths are too coarse, see `_FARTHEST_INTERPOLATED`."""
        if not view.perspective:
            return False
        farthest = np.abs(self._geometry.bounds - view.origin).max(axis=0)
        near, _ = clip_range(view)
        return bool(np.linalg.norm(farthest) > _FARTHEST_INTERPOLATED * near)


def _with_objects(description: PassShader) -> PassShader:
    """The pass that also says which object is seen."""
    return replace(
        description,
        name=f"{description.name}_object",
        outputs=(*description.outputs, ("FLOAT", "visible_object")),
        defines=(*description.defines, ("HAS_OBJECT_ID", "1")),
    )


def _with_corners(description: PassShader, *, normals: bool, bends: bool) -> PassShader:
    """The pass that also finds normals for shading, and by how much they turn."""
    if not (normals or bends):
        return description
    outputs: tuple[tuple[GlslType, str], ...] = (
        *((("VEC4", "visible_shading_normal"),) if normals else ()),
        *((("VEC4", "normal_bend"),) if bends else ()),
    )
    flags = {"HAS_CORNERS": True, "HAS_SHADING_NORMAL": normals, "HAS_BEND": bends}
    return replace(
        description,
        name=f"{description.name}{'_normals' * normals}{'_bends' * bends}",
        library=(*description.library, *(BEND_LIBRARY if bends else ())),
        blocks=(*description.blocks, *((LOOK_BLOCK,) if bends else ())),
        generated=OCTAHEDRAL_GLSL
        + source("lib/seen_corners.glsl")
        + (source("lib/corner_normal.glsl") if normals else "")
        + (BEND_GLSL if bends else ""),
        outputs=(*description.outputs, *outputs),
        defines=(*description.defines, *((name, "1") for name, on in flags.items() if on)),
    )


def _first_three(texture: Texture) -> NDArray[np.float32]:
    """(3, H W) components of an RGBA32F texture."""
    pixels = np.asarray(texture.read(), dtype=np.float32).reshape(-1, 4)
    found = np.empty((3, len(pixels)), dtype=np.float32)

    def work(part: slice) -> None:
        found[:, part] = pixels[part, :3].T

    in_parts(work, len(pixels), _PART)
    return found


def _pixel_width(view: View) -> float:
    """See `VisibleSurface.pixel`; of pixels that are not square the mean."""
    across, up = view.clip_from_camera[0, 0], view.clip_from_camera[1, 1]
    return float(2.0 / np.sqrt(abs(across * up) * view.width * view.height))


def _with_poses(description: PassShader) -> PassShader:
    """The pass for objects that are elsewhere than the geometry has them."""
    return replace(
        description,
        name=f"{description.name}_posed",
        library=(*POSE_LIBRARY, *description.library),
        samplers=(*POSE_SAMPLERS, *description.samplers),
        defines=(*description.defines, *POSE_DEFINES),
    )


def local_eye(view: View, origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4,) float64, see `VisibleSurface.eye`."""
    if view.perspective:
        return np.append(view.origin - origin, 1.0)
    return np.append(view.world_from_camera[:3, 2], 0.0)


def clip_from_local(
    view: View, origin: NDArray[np.float64], offset: tuple[float, float] = (0.0, 0.0)
) -> NDArray[np.float64]:
    """(4, 4) float64, the view's clip space from local space, but for z.

    z only clips what is nearer than the near plane, and for a parallel projection nothing: with
    far / near beyond 1e7 float32 has no far plane to clip at, or one in a wrong place. The rest
    is left to the fragment shader, as is depth.

    A sample `offset` pixels right of and above the pixel's centre comes to lie on the centre,
    so the picture is moved the other way.
    """
    camera_from_local = view.camera_from_world.copy()
    # Composed by differences: the world's coordinates may be millions of metres.
    camera_from_local[:3, 3] = view.world_from_camera[:3, :3].T @ (origin - view.origin)
    shift = np.eye(4)
    shift[0, 3] = -2.0 * offset[0] / view.width
    shift[1, 3] = -2.0 * offset[1] / view.height
    clip_from_camera = view.clip_from_camera.copy()
    clip_from_camera[2] = 0.0
    if view.perspective:
        # z + w >= 0 where w is at least the near distance.
        clip_from_camera[2] = [*clip_from_camera[3, :3], -2.0 * clip_range(view)[0]]
    return shift @ clip_from_camera @ camera_from_local
