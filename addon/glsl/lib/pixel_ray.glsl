/* SPDX-License-Identifier: GPL-3.0-or-later
 * The ray through a pixel's sample, in local space (addon/corrmap/pixel_rays.py). Its direction
 * has the length 1 along the camera's axis, so that a distance along it is a depth. */

vec3 ray_origin(vec2 pixel)
{
  return ray.origin.xyz + pixel.x * ray.origin_x.xyz + pixel.y * ray.origin_y.xyz;
}

vec3 ray_direction(vec2 pixel)
{
  return ray.direction.xyz + pixel.x * ray.direction_x.xyz + pixel.y * ray.direction_y.xyz;
}

/* Where the ray from o along d meets the plane; `interpolated` is what the rasterizer says.
 *
 * What is interpolated loses precision where a triangle reaches far behind the viewer, and lies
 * at the place of corners that were moved to 1/256 of a pixel. But that very move may give a pixel
 * to a triangle whose plane its ray hardly meets: within 1/64 of a pixel of where it meets it
 * nowhere, the rasterizer is right. */
float plane_depth(vec3 o, vec3 d, vec4 plane, float interpolated)
{
  float facing = dot(plane.xyz, d);
  float turn = abs(dot(plane.xyz, ray.direction_x.xyz)) + abs(dot(plane.xyz, ray.direction_y.xyz));
  if (abs(facing) <= turn / 64.0 + ray.axis.w) {
    return interpolated;
  }
  return (plane.w - dot(plane.xyz, o)) / facing;
}
